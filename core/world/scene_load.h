// LoadScene: the one way from scene text, or a serialised scene, to a scene that is checked and resolved.
//
//   absl::StatusOr<LoadedScene> plaza = LoadScene(SceneForm::kText, text, "scenes/plaza.textproto");
//   plaza->message;   // the form that travels and is stored
//   plaza->hash;      // its identity on the wire
//   plaza->scene;     // the form that runs
//
// Each program that takes a scene from outside calls it on what it received, and only fetches the bytes itself: a
// command reads the file that a person named, the control plane takes the message of a request, a worker reads the file
// that its order names, a client takes the scene of the world it joined. Each checks again, because nobody behind an
// edge may be believed: anybody can send a request to the control plane, and a worker's file may be damaged, of another
// version or swapped. A resolved scene does not travel at all; a scatter makes it many times larger than its message,
// and all receivers come to the same bits.
//
// Pure functions, any thread. `name` is only what errors begin with: a path, or "scene" for one from the wire.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

// The largest file or message that is taken for a scene, with its meshes. A file with more is refused unread.
inline constexpr std::size_t kMaxSceneBytes = std::size_t{256} << 20;

struct LoadedScene {
  v1::Scene message;
  std::string hash;  // SceneHash of the message
  std::shared_ptr<const Scene> scene;
};

enum class SceneForm : std::uint8_t {
  kText,       // JSON or textproto, see ParseScene
  kSerialised  // tessera.v1.Scene
};
// Text if the path ends in .textproto, .txtpb or .json, else serialised.
SceneForm SceneFormOf(std::string_view path);

struct SceneDemands {
  // Number of bodies of the first scatter, so that one scene serves many sizes; 0 removes the scatter. Without a
  // scatter it changes nothing.
  std::optional<std::uint32_t> scatter_count;
  // The hash that the scene must have; empty: any.
  std::string hash;
};

// INVALID_ARGUMENT in one line: what ParseScene or ResolveScene finds, or that the hash is not the demanded one.
absl::StatusOr<LoadedScene> LoadScene(SceneForm form, std::string_view content, std::string_view name,
                                      const SceneDemands& demands = {});
absl::StatusOr<LoadedScene> LoadScene(v1::Scene message, std::string_view name, const SceneDemands& demands = {});

}  // namespace tessera
