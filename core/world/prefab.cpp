#include "core/world/prefab.h"

#include <cassert>

namespace tessera {

const BodyDef* PrefabBodyOf(const Scene& scene, BodyId id) {
  if (!IsSpawned(id)) return nullptr;
  const SpawnedId parts = PartsOf(id);
  if (parts.prefab >= scene.prefabs.size() || parts.maker == 0 || parts.count == 0) return nullptr;
  const std::vector<BodyDef>& bodies = scene.prefabs[parts.prefab].bodies;
  return parts.member < bodies.size() ? &bodies[parts.member] : nullptr;
}

BodyDef MakeSpawned(const Scene& scene, BodyId id) {
  assert(PrefabBodyOf(scene, id) != nullptr);
  BodyDef def = *PrefabBodyOf(scene, id);
  def.id = id;
  return def;
}

std::vector<JointDef> SpawnedJoints(const Scene& scene, BodyId body) {
  if (PrefabBodyOf(scene, body) == nullptr) return {};
  std::vector<JointDef> joints = scene.prefabs[PartsOf(body).prefab].joints;
  for (JointDef& joint : joints) {
    joint.id = SpawnedJointId(body, joint.id);
    joint.body_a = WithMember(body, joint.body_a.value() - 1);
    joint.body_b = WithMember(body, joint.body_b.value() - 1);
  }
  return joints;
}

BodyState SpawnedState(const BodyDef& body, const SpawnMotion& motion) {
  const Vec3d arm = Rotate(motion.rotation, body.initial.position);
  BodyState state = body.initial;
  state.position = motion.position + arm;
  state.orientation = motion.rotation * body.initial.orientation;
  if (body.kinematic) return state;
  state.linear_velocity = Vec3f(motion.velocity_m_s + Cross(motion.spin_rad_s, arm) +
                                Rotate(motion.rotation, Vec3d(body.initial.linear_velocity)));
  state.angular_velocity = Vec3f(motion.spin_rad_s + Rotate(motion.rotation, Vec3d(body.initial.angular_velocity)));
  return state;
}

}  // namespace tessera
