#include "core/physics/world.h"

#include <algorithm>
#include <cassert>

#include "core/physics/bullet_math.h"
#include "core/physics/motion/free_flight.h"
#include "core/physics/sphere_sweep.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {

World::World(const WorldSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
World::~World() = default;

// --- What is in it

void World::Add(const BodyDef& def, const BodyState& state) {
  assert(def.id != BodyId() && !Has(def.id));
  impl_->Add(def, state);
}

void World::Remove(BodyId id) { impl_->Remove(id); }
bool World::Has(BodyId id) const { return impl_->bodies.Has(id); }
std::size_t World::size() const { return impl_->bodies.all().size(); }

void World::AddJoint(const JointDef& def) {
  assert(def.id != JointId() && !HasJoint(def.id));
  impl_->AddJoint(def);
}

void World::RemoveJoint(JointId id) { impl_->RemoveJoint(impl_->bodies.JointAt(id)); }
bool World::HasJoint(JointId id) const { return impl_->bodies.HasJoint(id); }

// --- State in and out

BodyState World::StateOf(BodyId id) const { return impl_->bodies.At(id).state(); }
void World::SetState(BodyId id, const BodyState& state) { impl_->SetState(impl_->bodies.At(id), state); }
void World::Teleport(BodyId id, const BodyState& state) { impl_->Teleport(impl_->bodies.At(id), state); }
void World::SetMaterial(BodyId id, const Material& material) {
  RigidBody& body = impl_->bodies.At(id);
  body.SetMaterial(material);
  PairTable::NoteMaterial(body);
}
void World::SetGravityScale(BodyId id, double scale) {
  RigidBody& body = impl_->bodies.At(id);
  if (body.dynamic()) body.SetGravity(impl_->settings.gravity_m_s2 * scale);
}
Vec3f World::AngularImpulseFor(BodyId id, Vec3d spin_rad_s) const {
  const RigidBody& body = impl_->bodies.At(id);
  return AngularMomentumOf(body.inertia(), body.placement().orientation, Vec3f(spin_rad_s)) -
         body.state().angular_momentum;
}

void World::Park(BodyId id) { impl_->Park(impl_->bodies.At(id)); }
void World::Unpark(BodyId id) { impl_->Unpark(impl_->bodies.At(id)); }
bool World::IsParked(BodyId id) const { return impl_->bodies.At(id).parked; }
void World::Wake(BodyId id) { impl_->waking.Wake(impl_->bodies.At(id)); }

Aabb World::BoundsOf(BodyId id) const {
  const Bounds bounds = impl_->broad_phase.TightBounds(impl_->bodies.At(id));
  return {impl_->settings.origin + Vec3d(bounds.min), impl_->settings.origin + Vec3d(bounds.max)};
}

double World::MassOf(BodyId id) const { return impl_->bodies.At(id).mass_kg(); }
Vec3d World::InertiaOf(BodyId id) const { return impl_->bodies.At(id).inertia(); }

void World::ForEachStepped(absl::FunctionRef<void(std::uint32_t tag, const BodyState& state)> visit) const {
  for (const RigidBody* body : impl_->bodies.awake()) visit(body->tag, body->state());
  for (const RigidBody* body : impl_->sleep.fallen_asleep()) visit(body->tag, body->state());
  for (const RigidBody* body : impl_->bodies.Moving()) visit(body->tag, body->state());
}

void World::SetSupportHint(BodyId id, const SupportHint& hint) { impl_->bodies.At(id).support = hint; }
void World::SetExclusionGroup(BodyId id, ExclusionGroup group) { impl_->bodies.At(id).exclusion_group = group; }
void World::SetTag(BodyId id, std::uint32_t tag) { impl_->bodies.At(id).tag = tag; }

// --- Forces

void World::ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) {
  RigidBody& body = impl_->bodies.At(id);
  if (!body.dynamic() || body.isolated || (force_n == Vec3f() && torque_nm == Vec3f())) return;
  impl_->waking.Wake(body);
  body.force_n += Vec3d(force_n);
  body.torque_nm += Vec3d(torque_nm);
}

void World::ApplyImpulse(BodyId id, Vec3f impulse_ns, Vec3f angular_impulse_nms) {
  RigidBody& body = impl_->bodies.At(id);
  if (!body.dynamic() || body.isolated || (impulse_ns == Vec3f() && angular_impulse_nms == Vec3f())) return;
  impl_->waking.Wake(body);
  body.SetMotion(body.state().linear_velocity + impulse_ns / static_cast<float>(body.mass_kg()),
                 body.state().angular_momentum + angular_impulse_nms);
}

// --- Time

void World::Step(double dt_s) {
  assert(dt_s > 0);
  impl_->Step(dt_s);
  impl_->team.Dismiss();
}

void World::PrimeContacts(double dt_s, int times) {
  assert(dt_s > 0 && times >= 0);
  impl_->PrimeContacts(dt_s, times);
  impl_->team.Dismiss();
}

std::span<const Contact> World::contacts() const { return impl_->report.Contacts(impl_->Outcome(), impl_->bodies); }
std::span<const PairImpulse> World::ImpulsesOf(std::span<const std::uint8_t> bits) const {
  return impl_->report.ImpulsesOf(bits, impl_->Outcome(), impl_->bodies);
}

void World::AddNear(BodyId id, std::vector<std::uint32_t>* near) const {
  const RigidBody& body = impl_->bodies.At(id);
  for (const PairEnd& end : body.pairs) near->push_back(end.other->tag);
}

void World::AddTouching(BodyId id, std::vector<std::uint32_t>* touching) const {
  const RigidBody& body = impl_->bodies.At(id);
  for (const auto& [pair, other] : body.pairs) {
    if (pair->touching) touching->push_back(other->tag);
  }
}

bool World::AreTouching(BodyId a, BodyId b) const {
  const RigidBody* body = impl_->bodies.Find(a);
  return body != nullptr && std::any_of(body->pairs.begin(), body->pairs.end(),
                                        [b](const PairEnd& end) { return end.other->id() == b && end.pair->touching; });
}

std::optional<Contact> World::ContactBetween(BodyId a, BodyId b) const {
  const RigidBody* body = impl_->bodies.Find(a);
  if (body == nullptr) return std::nullopt;
  const auto touches = [b](const PairEnd& end) { return end.other->id() == b && end.pair->touching; };
  const auto found = std::find_if(body->pairs.begin(), body->pairs.end(), touches);
  if (found == body->pairs.end() || !found->pair->responds()) return std::nullopt;
  return ContactOf(*found->pair);
}

std::span<const PairEvent> World::events() const { return impl_->report.events(); }
std::span<const BodyId> World::isolated() const { return impl_->isolated; }

// --- The past

void World::NotePoses(Tick tick, double tick_s, const NotedBodies& noted, std::size_t ticks) {
  if (impl_->history == nullptr) {
    impl_->history = std::make_unique<PoseHistory>(ticks);
    impl_->queries.SetHistory(impl_->history.get());
  }
  impl_->history->Note(tick, tick_s, impl_->bodies, noted);
}

void World::ForgetPoses() {
  if (impl_->history != nullptr) impl_->history->Forget();
}

// --- Queries

QueryResult World::FindBodies(const BodyQuery& query, const BodyPredicate& accept) const {
  return impl_->queries.Find(query, accept);
}
std::vector<BodyId> World::Overlapping(const Aabb& box) const { return impl_->queries.Overlapping(box); }
std::optional<SphereHit> World::SweepSphere(Vec3d from, Vec3d to, double radius_m, BodyId ignored) const {
  SphereWay way{from, to, radius_m, ignored, {}};
  if (const RigidBody* who = impl_->bodies.Find(ignored); who != nullptr) way.layer = who->layer();
  std::vector<const RigidBody*> near;
  for (const BodyId id : impl_->queries.Overlapping(physics::BoundsOf(way))) near.push_back(&impl_->bodies.At(id));
  return physics::SweepSphere(near, way);
}

float World::IslandLoadOf(BodyId id) const {
  return std::clamp(impl_->bodies.At(id).load.island_load, 0.0f, kMostIslandLoad);
}
int World::SubstepsOf(BodyId id) const { return impl_->bodies.At(id).load.substeps; }

std::size_t World::asleep_count() const {
  const auto asleep = [](const auto& entry) { return entry.second->dynamic() && !entry.second->awake(); };
  return static_cast<std::size_t>(std::count_if(impl_->bodies.all().begin(), impl_->bodies.all().end(), asleep));
}

}  // namespace tessera::physics
