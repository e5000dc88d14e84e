// Adding, removing and moving the bodies and joints of a world.
#include <cassert>
#include <memory>
#include <utility>

#include "core/physics/world_impl.h"

namespace tessera::physics {

World::Impl::Impl(const WorldSettings& settings_in)
    : settings(settings_in),
      broad_phase(settings.origin, team),
      loads(settings.gravity_m_s2, settings.substeps, team),
      solve(settings.portable, team),
      sleep(settings.sleep, team) {}

World::Impl::~Impl() {
  for (const auto& [id, body] : bodies.all()) {
    if (!body->isolated) broad_phase.Remove(*body);
  }
}

void World::Impl::Add(const BodyDef& def, const BodyState& state) {
  RigidBody& body = bodies.Add(std::make_unique<RigidBody>(def, forms.Of(def), state, settings.gravity_m_s2));
  broad_phase.Add(body);
  if (body.awake()) waking.Activate(body);
}

void World::Impl::Teleport(RigidBody& body, const BodyState& state) {
  if (body.isolated) {
    if (!body.parked) return;
    body.Set(state);
    body.SetMotion(Vec3f(), Vec3f());
    return body.FallAsleep();
  }
  WakeNeighbours(body);
  while (!body.pairs.empty()) pairs.End(*body.pairs.back().pair);
  broad_phase.Remove(body);
  const bool listed = body.awake();
  body.predicted = {};
  body.Set(state);
  broad_phase.Add(body);
  if (body.awake() && !listed) {
    waking.Activate(body);
  } else if (!body.awake() && listed) {
    bodies.UnlistAwake(body);
  }
  queries.Moved();
}

void World::Impl::Remove(BodyId id) {
  RigidBody& body = bodies.At(id);
  if (history != nullptr && !body.isolated) history->Left(body);
  if (!body.isolated) Withdraw(body);
  bodies.Remove(body);
}

void World::Impl::Withdraw(RigidBody& body) {
  while (!body.joints.empty()) RemoveJoint(*body.joints.back());
  WakeNeighbours(body);
  while (!body.pairs.empty()) pairs.End(*body.pairs.back().pair);
  broad_phase.Remove(body);
  if (body.awake()) bodies.UnlistAwake(body);
  queries.Moved();
}

void World::Impl::AddJoint(const JointDef& def) {
  const Joint& joint = bodies.AddJoint(def);
  waking.Wake(*joint.a);
  if (joint.b == nullptr) return;
  waking.Wake(*joint.b);
  pairs.NoteJoints(*joint.a, *joint.b);
}

void World::Impl::RemoveJoint(Joint& joint) {
  RigidBody *a = joint.a, *b = joint.b;
  bodies.RemoveJoint(joint);
  waking.Wake(*a);
  if (b == nullptr) return;
  waking.Wake(*b);
  pairs.NoteJoints(*a, *b);
}

void World::Impl::SetState(RigidBody& body, const BodyState& state) {
  const RigidBody::Change change = body.Compare(state);
  if (body.isolated) return;
  if (change == RigidBody::Change::kNone) {
    if (body.awake()) body.SetStill(state.still_s);
    return;
  }
  if (change == RigidBody::Change::kMoves && !body.awake()) WakeNeighbours(body);
  const bool listed = body.awake();  // A body wakes with the bodies that joints connect to it.
  body.Set(state);
  if (body.awake() && !listed) {
    waking.Activate(body);
  } else if (!body.awake() && listed) {
    bodies.UnlistAwake(body);
  }
  if (body.moving()) pairs.Activate(body);
  broad_phase.Move(body);
}

void World::Impl::WakeNeighbours(const RigidBody& body) {
  broad_phase.BeginPairs(&pairs);
  waking.WakeNeighbours(body);
}

void World::Impl::Isolate(RigidBody& body) {
  isolated.push_back(body.id());
  Withdraw(body);
  body.FallAsleep();
  body.isolated = true;
}

void World::Impl::Park(RigidBody& body) {
  if (body.isolated || !body.dynamic()) return;
  Withdraw(body);
  body.SetMotion(Vec3f(), Vec3f());
  body.FallAsleep();
  body.force_n = body.torque_nm = Vec3d();
  body.isolated = body.parked = true;
}

void World::Impl::Unpark(RigidBody& body) {
  if (!body.parked) return;
  body.isolated = body.parked = false;
  broad_phase.Add(body);
  waking.Wake(body);
}

}  // namespace tessera::physics
