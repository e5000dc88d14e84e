// SceneWarnings: what is hardly meant in a scene that loads: a body that begins inside another, a joint that is torn.
//
//   for (const std::string& warning : SceneWarnings(*loaded->scene)) std::cerr << "warning: " << warning << "\n";
//
// None of it stops a world, so none of it is refused; a person who writes a scene wants to know. It looks at every
// joint and triangle, which takes as long as loading: tools call it, and no server does.
//
// Thread rule: a free function on values.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/world/scene.h"

namespace tessera {

// A sign of something systematic rather than of so many mistakes.
inline constexpr std::size_t kMaxSceneWarnings = 20;
// Frames of a joint that are this far apart at the start, m, are no rounding: it pulls them together at once.
inline constexpr double kTornJoint_m = 0.05;
// A spawn point this deep in a static body, m, is inside it: a player's body is pushed out, or falls out of the world.
inline constexpr double kBuriedSpawn_m = 0.01;

// One line each; beyond kMaxSceneWarnings a last one says how many more there are:
//   "player: spawn_points[0] is inside static body 1 \"ground\""
//   "joints (id 3): the frames are 0.42 m apart at the start; the joint pulls them together"
//   "body 40 \"crate\": is dynamic and a trigger: it falls through everything"
//   "player: max_force is 0 and there is no character, so inputs move nobody"
//   "body 7: the mesh is closed and its triangles face inward: bodies fall in and are held there"
// Spawn points are looked for in all shapes but meshes that are open; frames of joints where the position is the
// shape's origin, which leaves out dynamic cones, hulls and compounds.
std::vector<std::string> SceneWarnings(const Scene& scene);

}  // namespace tessera
