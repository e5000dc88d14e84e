// The steps by which scene_load.h takes a scene from outside: parse, resolve, hash.
//
// Pure functions, any thread. `file` is only what errors begin with: a path, or "scene" for one from the wire.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

// Reads JSON if the first character that is not blank is '{', else textproto. INVALID_ARGUMENT in one line, as
// `file:line:column: what` where the parser knows the place. A field that does not exist is an error.
absl::StatusOr<v1::Scene> ParseScene(std::string_view text, std::string_view file);

// Checks everything that scene.proto and limits.h ask for and expands what is written short: defaults, materials by
// name, scatters into bodies; quaternions are normalised. INVALID_ARGUMENT in one line, with every fault, up to
// 20, and how many more there are: `scenes/x.textproto: bodies[12] (id 40 "crate"): mass must be > 0, got -1;
// bodies[13] (id 41): mass must be > 0, got -2`.
absl::StatusOr<std::shared_ptr<const Scene>> ResolveScene(const v1::Scene& scene, std::string_view file);

// The scene's identity on the wire: BLAKE2b-256 over its serialised form, 64 hexadecimal digits.
std::string SceneHash(const v1::Scene& scene);

}  // namespace tessera
