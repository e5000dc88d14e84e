// Bodies and joints of prefabs, as they are once a game has made one.
//
// Thread rule: free functions on values.
#pragma once

#include <vector>

#include "core/world/scene.h"
#include "core/world/spawned_id.h"

namespace tessera {

// The prefab's body whose id has been spawned; nullptr for ids that the scene's prefabs do not explain. Its own id is
// its number in the prefab.
const BodyDef* PrefabBodyOf(const Scene& scene, BodyId id);

// `PrefabBodyOf` with the id that it was spawned with.
BodyDef MakeSpawned(const Scene& scene, BodyId id);

// A joint of the assembly that `body` is of; `number` is its id in the prefab.
constexpr JointId SpawnedJointId(BodyId body, JointId number) {
  return JointId(WithMember(body, 0).value() + number.value() - 1);
}
// All of them, ascending; none for a prefab of one body.
std::vector<JointDef> SpawnedJoints(const Scene& scene, BodyId body);

// Where and how fast a prefab is made; velocities are those of the place, which the bodies share as one rigid body, on
// top of their own.
struct SpawnMotion {
  Vec3d position;
  Quatd rotation{0, 0, 0, 1};
  Vec3d velocity_m_s, spin_rad_s;
};
BodyState SpawnedState(const BodyDef& body, const SpawnMotion& motion);

}  // namespace tessera
