#include "core/physics/world.h"

#include <absl/container/flat_hash_map.h>

#include <algorithm>
#include <cassert>

#include "core/physics/bullet_math.h"
#include "core/physics/bullet_world.h"
#include "core/physics/contacts.h"
#include "core/physics/queries.h"

namespace tessera::physics {

struct World::Impl {
  explicit Impl(const Settings& settings_in)
      : settings(settings_in),
        bullet(std::make_unique<BulletWorld>(ToBullet(settings.gravity_m_s2), settings.solver_iterations)),
        ground(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, nullptr)) {}
  ~Impl();

  Body& At(BodyId id) {
    const auto it = bodies.find(id);
    assert(it != bodies.end() && "no such body");
    return *it->second;
  }
  void RefreshBounds(Body& body) {
    bullet->updateSingleAabb(&body.bullet());
    unsettled = true;
  }
  // What queries see: after a step Bullet's bounds are those from before it.
  BulletWorld& Current() {
    if (bounds_late) bullet->updateAabbs();
    bounds_late = false;
    return *bullet;
  }
  void RemoveJoint(Joint& joint);
  void DropContacts(Body& a, Body& b);

  Settings settings;
  ShapeCache shapes;
  std::unique_ptr<BulletWorld> bullet;
  btRigidBody ground;  // what joints to the world hold on to
  absl::flat_hash_map<BodyId, std::unique_ptr<Body>> bodies;
  absl::flat_hash_map<JointId, std::unique_ptr<Joint>> joints;
  std::vector<Body*> moving;  // the dynamic ones
  PairWatch pairs;
  std::vector<Contact> contacts;
  std::vector<PairEvent> events;
  double tuned_dt_s = 0;
  bool unsettled = true;  // something changed since the last step, or something is awake
  bool bounds_late = false;
};

World::Impl::~Impl() {
  for (auto& [id, joint] : joints) bullet->RemoveJoint(*joint);
  for (auto& [id, body] : bodies) bullet->removeRigidBody(&body->bullet());
}

World::World(const Settings& settings) : impl_(std::make_unique<Impl>(settings)) {}
World::~World() = default;

// --- What is in it
// ---------------------------------------------------------------------------------------------------------

void World::Add(const BodyDef& def, const BodyState& state) {
  assert(def.id != BodyId() && !Has(def.id));
  auto body = std::make_unique<Body>(def, impl_->shapes.FormOf(def), state, impl_->settings.origin,
                                     impl_->settings.gravity_m_s2);
  impl_->bullet->addRigidBody(&body->bullet());
  impl_->RefreshBounds(*body);
  if (body->dynamic()) impl_->moving.push_back(body.get());
  impl_->bodies.emplace(def.id, std::move(body));
}

void World::Remove(BodyId id) {
  Body& body = impl_->At(id);
  while (!body.joints.empty()) RemoveJoint(body.joints.back());
  impl_->bullet->WakeTouching(body);
  impl_->bullet->removeRigidBody(&body.bullet());
  std::erase(impl_->moving, &body);
  impl_->bodies.erase(id);
  impl_->unsettled = true;
}

bool World::Has(BodyId id) const { return impl_->bodies.contains(id); }
std::size_t World::size() const { return impl_->bodies.size(); }

void World::AddJoint(const JointDef& def) {
  assert(def.id != JointId() && !HasJoint(def.id));
  Body& a = impl_->At(def.body_a);
  Body* b = def.body_b == BodyId() ? nullptr : &impl_->At(def.body_b);
  auto joint = std::make_unique<Joint>(def, a, b, impl_->ground, impl_->settings.origin);
  impl_->bullet->AddJoint(*joint);
  for (Body* body : {&a, b}) {
    if (body == nullptr) continue;
    body->joints.push_back(def.id);
    body->Wake();
  }
  if (b != nullptr && !def.bodies_collide) impl_->DropContacts(a, *b);
  impl_->joints.emplace(def.id, std::move(joint));
  impl_->tuned_dt_s = 0;
  impl_->unsettled = true;
}

// Points found before the joint forbade them would go on pushing.
void World::Impl::DropContacts(Body& a, Body& b) {
  btOverlappingPairCache* pairs_of_bounds = bullet->getPairCache();
  btBroadphasePair* pair =
      pairs_of_bounds->findPair(a.bullet().getBroadphaseHandle(), b.bullet().getBroadphaseHandle());
  if (pair != nullptr) pairs_of_bounds->cleanOverlappingPair(*pair, bullet->getDispatcher());
}

void World::RemoveJoint(JointId id) {
  const auto it = impl_->joints.find(id);
  assert(it != impl_->joints.end() && "no such joint");
  impl_->RemoveJoint(*it->second);
  impl_->joints.erase(it);
}

void World::Impl::RemoveJoint(Joint& joint) {
  bullet->RemoveJoint(joint);
  for (const BodyId id : {joint.body_a(), joint.body_b()}) {
    if (id == BodyId()) continue;
    std::erase(At(id).joints, joint.id());
    At(id).Wake();
  }
  unsettled = true;
}

bool World::HasJoint(JointId id) const { return impl_->joints.contains(id); }

// --- State in and out
// --------------------------------------------------------------------------------------------------------

BodyState World::StateOf(BodyId id) const { return impl_->At(id).state(); }

void World::SetState(BodyId id, const BodyState& state) {
  Body& body = impl_->At(id);
  switch (body.Compare(state)) {
    case Body::Change::kNone:
      return;
    case Body::Change::kSilent:
      body.Set(state, impl_->settings.origin);
      break;
    case Body::Change::kMoves:
      if (body.asleep() || !body.dynamic()) impl_->bullet->WakeTouching(body);
      body.Set(state, impl_->settings.origin);
      break;
  }
  impl_->RefreshBounds(body);
}

void World::Wake(BodyId id) {
  impl_->At(id).Wake();
  impl_->unsettled = true;
}

Aabb World::BoundsOf(BodyId id) const {
  btVector3 min, max;
  impl_->At(id).bullet().getAabb(min, max);
  return {impl_->settings.origin + Vec3d(FromBullet(min)), impl_->settings.origin + Vec3d(FromBullet(max))};
}

double World::MassOf(BodyId id) const { return impl_->At(id).mass_kg(); }
Vec3d World::InertiaOf(BodyId id) const { return impl_->At(id).inertia(); }

// --- Forces
// ------------------------------------------------------------------------------------------------------------------

void World::ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) {
  Body& body = impl_->At(id);
  if (!body.dynamic() || (force_n == Vec3f() && torque_nm == Vec3f())) return;
  body.Wake();
  body.bullet().applyCentralForce(ToBullet(force_n));
  body.bullet().applyTorque(ToBullet(torque_nm));
  impl_->unsettled = true;
}

void World::ApplyImpulse(BodyId id, Vec3f impulse_ns, Vec3f angular_impulse_nms) {
  Body& body = impl_->At(id);
  if (!body.dynamic() || (impulse_ns == Vec3f() && angular_impulse_nms == Vec3f())) return;
  body.Wake();
  body.bullet().applyCentralImpulse(ToBullet(impulse_ns));
  body.bullet().applyTorqueImpulse(ToBullet(angular_impulse_nms));
  body.PublishVelocity();
  impl_->unsettled = true;
}

// --- Time
// --------------------------------------------------------------------------------------------------------------------

void World::Step(double dt_s) {
  assert(dt_s > 0);
  if (!impl_->unsettled) {
    impl_->contacts.clear();
    impl_->events.clear();
    return;
  }
  if (dt_s != impl_->tuned_dt_s) {
    for (auto& [id, joint] : impl_->joints) joint->Tune(dt_s);
    impl_->tuned_dt_s = dt_s;
  }
  impl_->bullet->stepSimulation(static_cast<btScalar>(dt_s), 0);
  impl_->bounds_late = true;
  impl_->unsettled = false;
  for (Body* body : impl_->moving) {
    if (!body->asleep() || body->bullet().isActive()) body->Publish(impl_->settings.origin);
    if (!body->asleep()) impl_->unsettled = true;
  }
  SummarizeContacts(impl_->bullet->solved(), impl_->bullet->impulses(), impl_->settings.origin, &impl_->contacts);
  impl_->pairs.Update(impl_->bullet->touches(), &impl_->events);
}

std::span<const Contact> World::contacts() const { return impl_->contacts; }
std::span<const PairEvent> World::events() const { return impl_->events; }

// --- Queries
// -----------------------------------------------------------------------------------------------------------------

std::optional<RayHit> World::CastRay(Vec3d from, Vec3d to) const {
  return physics::CastRay(impl_->Current(), impl_->settings.origin, from, to);
}
std::vector<BodyId> World::Overlapping(const Shape& convex, const Pose& pose) const {
  return OverlappingShape(impl_->Current(), impl_->settings.origin, convex, pose);
}
std::vector<BodyId> World::Overlapping(const Aabb& box) const {
  return OverlappingBox(impl_->Current(), impl_->settings.origin, box);
}

std::size_t World::asleep_count() const {
  const auto asleep = [](const Body* body) { return body->asleep(); };
  return static_cast<std::size_t>(std::count_if(impl_->moving.begin(), impl_->moving.end(), asleep));
}

}  // namespace tessera::physics
