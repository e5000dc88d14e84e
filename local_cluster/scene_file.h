// Scene files as commands take them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/world/scene_load.h"

namespace tessera::local {

// A file of this ending holds a serialised tessera.v1.Scene, for levels of millions of triangles; others hold JSON or
// textproto.
inline constexpr char kSerialisedEnding[] = ".pb";

// Reads, parses and checks. CommandError names file, place and field. `bodies` replaces the number of scattered bodies.
LoadedScene LoadScene(const std::string& path, std::optional<std::uint32_t> bodies = {});

// Where the scenes that come with tessera are: $TESSERA_SCENES, beside an installed binary (../share/tessera/scenes),
// or in the source tree that built it, as `name`.textproto; or in the folder of games beside that of scenes, as
// `name`/scene.json. CommandError if it is in none of them.
std::string FindScene(const std::string& name);
// The game beside a scene of a folder of games: its game.lua, or empty.
std::string GameBeside(const std::string& scene_path);

}  // namespace tessera::local
