// What is in a world: bodies and joints that come, go, are told where to be, and wake.
#include <algorithm>
#include <cassert>

#include "core/physics/bullet_math.h"
#include "core/physics/tuning.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {

World::Impl::Impl(const Settings& settings_in)
    : settings(settings_in), solver(settings.portable ? SimdPath::kSse2 : SimdPath::kBest) {}

World::Impl::~Impl() {
  for (auto& [id, body] : bodies) {
    if (!body->isolated) broad_phase.Remove(*body);
  }
}

RigidBody& World::Impl::At(BodyId id) const {
  const auto it = bodies.find(id);
  assert(it != bodies.end() && "no such body");
  return *it->second;
}

void World::Impl::Add(const BodyDef& def, const BodyState& state) {
  auto owned = std::make_unique<RigidBody>(def, shapes.FormOf(def), state, settings.origin, settings.gravity_m_s2);
  RigidBody& body = *owned;
  body.tag = kNoTag;
  if (free_serials.empty()) free_serials.push_back(next_serial++);
  body.serial = free_serials.back();
  free_serials.pop_back();
  body.reach = TightBounds(body);
  body.fat = body.reach;
  bodies.emplace(def.id, std::move(owned));
  broad_phase.Add(body);
  if (body.awake()) ListAwake(body);
}

void World::Impl::Remove(BodyId id) {
  RigidBody& body = At(id);
  if (!body.isolated) Withdraw(body);
  free_serials.push_back(body.serial);
  bodies.erase(id);
}

// From everything it is tied to, touches or is listed in. What it touched wakes.
void World::Impl::Withdraw(RigidBody& body) {
  while (!body.joints.empty()) RemoveJoint(body.joints.back());
  WakeTouching(body);
  while (!body.pairs.empty()) {
    Pair& pair = *body.pairs.back().pair;
    if (pair.touching) ended.push_back({pair.low->id(), pair.high->id(), pair.trigger, false});
    pairs.End(pair);
  }
  broad_phase.Remove(body);
  if (body.awake()) UnlistAwake(body);
}

void World::Impl::AddJoint(const JointDef& def) {
  RigidBody& a = At(def.body_a);
  RigidBody* b = def.body_b == BodyId() ? nullptr : &At(def.body_b);
  const Pose frame_a = a.LocalFrame(def.frame_a);
  // The world takes the part of body a: then its frame comes first, and the body is the model's b.
  Joint joint{.id = def.id,
              .a = &a,
              .b = b,
              .bodies_collide = def.bodies_collide,
              .model = b != nullptr ? JointModel(def, frame_a, b->LocalFrame(def.frame_b))
                                    : JointModel(def, def.frame_b, frame_a)};
  joints.emplace(def.id, joint);
  for (RigidBody* body : {&a, b}) {
    if (body == nullptr) continue;
    body->joints.push_back(def.id);
    Wake(*body);
  }
  if (b != nullptr && !def.bodies_collide) ForbidContacts(a, *b);
}

void World::Impl::ForbidContacts(RigidBody& a, RigidBody& b) {
  Pair* pair = pairs.Find(a, b);
  if (pair == nullptr || pair->trigger) return;
  if (pair->touching) ended.push_back({pair->low->id(), pair->high->id(), false, false});
  pair->jointed = true;
  pair->touching = false;
  pair->manifolds.clear();
}

void World::Impl::RemoveJoint(JointId id) {
  const auto it = joints.find(id);
  assert(it != joints.end() && "no such joint");
  RigidBody *a = it->second.a, *b = it->second.b;
  joints.erase(it);
  for (RigidBody* body : {a, b}) {
    if (body == nullptr) continue;
    std::erase(body->joints, id);
    Wake(*body);
  }
  Pair* pair = b != nullptr ? pairs.Find(*a, *b) : nullptr;
  if (pair != nullptr) pair->jointed = Jointed(*a, *b);
}

// Whether a joint forbids them to collide.
bool World::Impl::Jointed(const RigidBody& a, const RigidBody& b) const {
  return std::any_of(a.joints.begin(), a.joints.end(), [&](JointId id) {
    const Joint& joint = joints.at(id);
    return !joint.bodies_collide && (joint.a == &b || joint.b == &b);
  });
}

void World::Impl::SetState(RigidBody& body, const BodyState& state) {
  const RigidBody::Change change = body.Compare(state);
  if (body.isolated) return;
  if (change == RigidBody::Change::kNone) {
    if (body.awake()) body.SetStill(state.still_s);
    return;
  }
  const bool was_awake = body.awake();
  if (change == RigidBody::Change::kMoves && !was_awake) WakeTouching(body);
  body.Set(state, settings.origin);
  if (body.awake() && !was_awake) {
    ListAwake(body);
  } else if (!body.awake() && was_awake) {
    UnlistAwake(body);
  }
  SetReach(body, TightBounds(body));
}

void World::Impl::Wake(RigidBody& body) {
  waking.assign(1, &body);
  while (!waking.empty()) {
    RigidBody& next = *waking.back();
    waking.pop_back();
    if (!next.dynamic() || next.awake() || next.isolated) continue;
    next.Wake();
    ListAwake(next);
    ListJointed(next, &waking);
  }
}

void World::Impl::ListJointed(const RigidBody& body, std::vector<RigidBody*>* others) {
  for (const JointId id : body.joints) {
    const Joint& joint = joints.at(id);
    for (RigidBody* other : {joint.a, joint.b}) {
      if (other != nullptr) others->push_back(other);
    }
  }
}

// And what is jointed to it. A pair that came into the world asleep was never searched: its bounds have to do.
void World::Impl::WakeTouching(RigidBody& body) {
  BeginPairs();
  touched.clear();
  for (const auto& [pair, other] : body.pairs) {
    const bool may_touch = pair->searched ? pair->touching : pair->low->reach.Overlaps(pair->high->reach);
    if (may_touch && !pair->trigger) touched.push_back(other);
  }
  ListJointed(body, &touched);
  for (RigidBody* other : touched) Wake(*other);
}

void World::Impl::ListAwake(RigidBody& body) {
  body.awake_index = static_cast<std::uint32_t>(awake.size());
  awake.push_back(&body);
  pairs.Activate(body);
}

void World::Impl::UnlistAwake(RigidBody& body) {
  awake.back()->awake_index = body.awake_index;
  awake[body.awake_index] = awake.back();
  awake.pop_back();
}

Bounds World::Impl::TightBounds(const RigidBody& body) const {
  const Geometry& geometry = body.geometry();
  if (geometry.kind == GeometryKind::kPlane) {
    return {{-kEverywhere_m, -kEverywhere_m, -kEverywhere_m}, {kEverywhere_m, kEverywhere_m, kEverywhere_m}};
  }
  const LocalBounds local = physics::BoundsOf(geometry, body.placement().rotation);
  const Vec3f center(body.placement().position - settings.origin);
  return {center + local.min, center + local.max};
}

// The trees hear of it only when it leaves what they believe.
void World::Impl::SetReach(RigidBody& body, const Bounds& reach) {
  body.reach = reach;
  if (body.fat.Contains(reach)) return;
  const auto ahead = [](float move_m) { return std::clamp(kBoundsAhead * move_m, -kMostAhead_m, kMostAhead_m); };
  const Vec3f move = body.course.move_m;
  body.fat = reach.Grown(body.dynamic() ? kBoundsMargin_m : 0).Swept({ahead(move.x), ahead(move.y), ahead(move.z)});
  broad_phase.Update(body);
}

btCollisionWorld& World::Impl::Shown() {
  for (auto& [id, body] : bodies) {
    if (body->shown || body->isolated) continue;
    SetReach(*body, TightBounds(*body));
    body->ShowToBullet(settings.origin);
  }
  return broad_phase.bullet();
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
  body.reach = body.fat = TightBounds(body);
  broad_phase.Add(body);
  Wake(body);
}

}  // namespace tessera::physics
