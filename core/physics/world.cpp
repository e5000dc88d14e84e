#include "core/physics/world.h"

#include <algorithm>
#include <cassert>

#include "core/physics/bullet_math.h"
#include "core/physics/queries.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {

World::World(const Settings& settings) : impl_(std::make_unique<Impl>(settings)) {}
World::~World() = default;

// --- What is in it
// ---------------------------------------------------------------------------------------------------------

void World::Add(const BodyDef& def, const BodyState& state) {
  assert(def.id != BodyId() && !Has(def.id));
  impl_->Add(def, state);
}

void World::Remove(BodyId id) { impl_->Remove(id); }
bool World::Has(BodyId id) const { return impl_->bodies.contains(id); }
std::size_t World::size() const { return impl_->bodies.size(); }

void World::AddJoint(const JointDef& def) {
  assert(def.id != JointId() && !HasJoint(def.id));
  impl_->AddJoint(def);
}

void World::RemoveJoint(JointId id) { impl_->RemoveJoint(id); }
bool World::HasJoint(JointId id) const { return impl_->joints.contains(id); }

// --- State in and out
// --------------------------------------------------------------------------------------------------------

BodyState World::StateOf(BodyId id) const { return impl_->At(id).state(); }
void World::SetState(BodyId id, const BodyState& state) { impl_->SetState(impl_->At(id), state); }
void World::Park(BodyId id) { impl_->Park(impl_->At(id)); }
void World::Unpark(BodyId id) { impl_->Unpark(impl_->At(id)); }
bool World::IsParked(BodyId id) const { return impl_->At(id).parked; }
void World::Wake(BodyId id) { impl_->Wake(impl_->At(id)); }

Aabb World::BoundsOf(BodyId id) const {
  const Bounds bounds = impl_->TightBounds(impl_->At(id));
  return {impl_->settings.origin + Vec3d(bounds.min), impl_->settings.origin + Vec3d(bounds.max)};
}

double World::MassOf(BodyId id) const { return impl_->At(id).mass_kg(); }
Vec3d World::InertiaOf(BodyId id) const { return impl_->At(id).inertia(); }

void World::SetElsewhere(BodyId id, const Elsewhere& elsewhere) { impl_->At(id).elsewhere = elsewhere; }
void World::SetTag(BodyId id, std::uint32_t tag) { impl_->At(id).tag = tag; }

// --- Forces
// ------------------------------------------------------------------------------------------------------------------

void World::ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) {
  RigidBody& body = impl_->At(id);
  if (!body.dynamic() || body.isolated || (force_n == Vec3f() && torque_nm == Vec3f())) return;
  impl_->Wake(body);
  body.force_n += Vec3d(force_n);
  body.torque_nm += Vec3d(torque_nm);
}

void World::ApplyImpulse(BodyId id, Vec3f impulse_ns, Vec3f angular_impulse_nms) {
  RigidBody& body = impl_->At(id);
  if (!body.dynamic() || body.isolated || (impulse_ns == Vec3f() && angular_impulse_nms == Vec3f())) return;
  impl_->Wake(body);
  body.SetMotion(body.state().linear_velocity + impulse_ns / static_cast<float>(body.mass_kg()),
                 body.state().angular_momentum + angular_impulse_nms);
}

// --- Time
// --------------------------------------------------------------------------------------------------------------------

void World::Step(double dt_s) {
  assert(dt_s > 0);
  impl_->Step(dt_s);
}

void World::Impl::Step(double dt) {
  contacts.clear();
  contacts_told = false;
  isolated.clear();
  touching.clear();
  parting.clear();
  turnings.clear();
  if (awake.empty() && ended.empty()) {
    events.clear();
    return;
  }
  dt_s = dt;
  ++step;
  FindPairs();
  CollidePairs();
  BuildIslands();
  motions.resize(awake.size());
  FlyFree();
  if (!touching.empty() || !awake_joints.empty()) {
    FillBatches();
    SolveBatches();
  }
  Sweep();
  MoveBodies();
  FallAsleep();
  for (RigidBody* body : failing) Isolate(*body);
  failing.clear();
  ReportEvents();
}

void World::Rehearse(double dt_s, int times) {
  assert(dt_s > 0 && times >= 0);
  impl_->Rehearse(dt_s, times);
}

void World::Impl::Rehearse(double dt, int times) {
  const auto insane = [](const RigidBody* body) { return !Sane(*body); };
  if (awake.empty() || std::any_of(awake.begin(), awake.end(), insane)) return;  // the step has to tell of those
  dt_s = dt;
  ++step;  // joints are listed once in each
  FindPairs();
  CollidePairs();
  BuildIslands();
  motions.resize(awake.size());
  if (touching.empty() && awake_joints.empty()) return;
  for (int i = 0; i < times; ++i) {
    FillBatches();
    SolveBatches();
  }
  for (const Touch& touch : touching) touch.pair->substeps = touch.substeps;
}

std::span<const Contact> World::contacts() const {
  impl_->ReportContacts();
  return impl_->contacts;
}
std::span<const PairImpulse> World::ImpulsesOf(std::span<const std::uint8_t> bits) const {
  return impl_->ReportImpulsesOf(bits);
}

void World::AddNear(BodyId id, std::vector<std::uint32_t>* near) const {
  const RigidBody& body = impl_->At(id);
  for (const PairEnd& end : body.pairs) near->push_back(end.other->tag);
}

void World::AddTouching(BodyId id, std::vector<std::uint32_t>* touching) const {
  const RigidBody& body = impl_->At(id);
  for (const auto& [pair, other] : body.pairs) {
    if (pair->touching) touching->push_back(other->tag);
  }
}

std::span<const PairEvent> World::events() const { return impl_->events; }
std::span<const BodyId> World::isolated() const { return impl_->isolated; }

// --- Queries
// -----------------------------------------------------------------------------------------------------------------

std::optional<RayHit> World::CastRay(Vec3d from, Vec3d to) const {
  return physics::CastRay(impl_->Shown(), impl_->settings.origin, from, to);
}
std::vector<BodyId> World::Overlapping(const Shape& convex, const Pose& pose) const {
  return OverlappingShape(impl_->Shown(), impl_->settings.origin, convex, pose);
}
std::vector<BodyId> World::Overlapping(const Aabb& box) const {
  return OverlappingBox(impl_->Shown(), impl_->settings.origin, box);
}

float World::IslandLoadOf(BodyId id) const { return std::clamp(impl_->At(id).island_load, 0.0f, kMostIslandLoad); }
int World::SubstepsOf(BodyId id) const { return impl_->At(id).substeps; }

std::size_t World::asleep_count() const {
  const auto asleep = [](const auto& entry) { return entry.second->dynamic() && !entry.second->awake(); };
  return static_cast<std::size_t>(std::count_if(impl_->bodies.begin(), impl_->bodies.end(), asleep));
}

}  // namespace tessera::physics
