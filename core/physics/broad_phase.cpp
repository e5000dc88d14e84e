#include "core/physics/broad_phase.h"

#include <algorithm>
#include <cmath>

#include "core/physics/bullet_math.h"
#include "core/physics/query/tuning.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
PredictedMotion PredictMotion(const RigidBody& body, double dt_s) {
  const Vec3d a = body.Acceleration();
  const Vec3d v(body.state().linear_velocity);
  const Vec3f spin = body.state().angular_velocity;
  return {Vec3f(v * dt_s + a * (0.5 * dt_s * dt_s)), Vec3f(v + a * dt_s), spin,
          std::min(2.0f, Length(spin) * static_cast<float>(dt_s)) * body.geometry().outer_radius_m};
}

btBroadphasePair* BroadPhase::Sink::addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) {
  const auto fixed = [](const btBroadphaseProxy& proxy) {
    return proxy.m_collisionFilterGroup == btBroadphaseProxy::StaticFilter;
  };
  if (fixed(*a) && fixed(*b)) return nullptr;
  const auto first = static_cast<std::uint32_t>(a->m_uniqueId), second = static_cast<std::uint32_t>(b->m_uniqueId);
  met.push_back({PairTable::KeyOf(first, second), a, b});
  return nullptr;
}

RigidBody& BroadPhase::BodyOf(const btBroadphaseProxy& proxy) { return *static_cast<RigidBody*>(proxy.m_clientObject); }

BroadPhase::BroadPhase(Vec3d origin, ThreadTeam& team) : origin_(origin), team_(team), trees_(&sink_) {
  // Bullet would rebuild a share of the fixed bodies' tree in every step.
  trees_.m_fupdates = 0;
}

void BroadPhase::Add(RigidBody& body) {
  body.reach = body.fat = TightBounds(body);
  const int group = body.dynamic() ? btBroadphaseProxy::DefaultFilter : btBroadphaseProxy::StaticFilter;
  const std::size_t met = sink_.met.size();
  btBroadphaseProxy* proxy = trees_.createProxy(ToBullet(body.fat.min), ToBullet(body.fat.max), INVALID_SHAPE_PROXYTYPE,
                                                &body, group, btBroadphaseProxy::AllFilter, nullptr);
  sink_.met.resize(met);  // `UpdateTrees` reports all of them again.
  // Serials name pairs, so that a known pair is recognised by its proxies alone.
  proxy->m_uniqueId = static_cast<int>(body.serial);
  body.proxy = proxy;
  UpdateTrees(body);
}

void BroadPhase::Remove(RigidBody& body) {
  trees_.destroyProxy(body.proxy, nullptr);
  body.proxy = nullptr;
}

void BroadPhase::Move(RigidBody& body) {
  body.reach = TightBounds(body);
  if (!body.fat.Contains(body.reach)) Refit(body);
}

void BroadPhase::UpdateTrees(RigidBody& body) {
  trees_.setAabbForceUpdate(body.proxy, ToBullet(body.fat.min), ToBullet(body.fat.max), nullptr);
}

// Gives a body whose reach has left the bounds that the trees hold wider ones.
void BroadPhase::Refit(RigidBody& body) {
  const auto ahead = [](float move_m) { return std::clamp(kBoundsAhead * move_m, -kMostAhead_m, kMostAhead_m); };
  const Vec3f move = body.predicted.move_m;
  body.fat = body.reach.Grown(body.dynamic() || body.kinematic() ? kBoundsMargin_m : 0)
                 .Swept({ahead(move.x), ahead(move.y), ahead(move.z)});
  UpdateTrees(body);
}

bool BroadPhase::Predict(RigidBody& body, double dt_s) const {
  body.predicted = PredictMotion(body, dt_s);
  const float grow = kSpeculative_m + std::min(body.predicted.sweep_m, body.geometry().outer_radius_m);
  body.reach = TightBounds(body).Swept(body.predicted.move_m).Grown(grow);
  return !body.fat.Contains(body.reach);
}

void BroadPhase::Predict(std::span<RigidBody* const> awake, double dt_s, std::span<RigidBody* const> moving) {
  outgrown_.resize(awake.size());
  team_.For(awake.size(), kChunkBodies, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      awake[i]->PrepareDamping(dt_s);
      outgrown_[i] = Predict(*awake[i], dt_s) ? 1 : 0;
    }
  });
  for (std::size_t i = 0; i < awake.size(); ++i) {
    if (outgrown_[i] != 0) Refit(*awake[i]);
  }
  for (RigidBody* body : moving) {
    body->driven_s = dt_s;
    if (Predict(*body, dt_s)) Refit(*body);
  }
  if (++passes_ % kOptimiseSteps == 0) trees_.collide(nullptr);
}

void BroadPhase::BeginPairs(PairTable* pairs) {
  for (const Meeting& meeting : sink_.met) {
    if (pairs->Has(meeting.key)) continue;
    RigidBody &a = BodyOf(*meeting.a), &b = BodyOf(*meeting.b);
    if (!a.isolated && !b.isolated) pairs->Begin(a, b);
  }
  sink_.met.clear();
}

Bounds BroadPhase::TightBounds(const RigidBody& body) const {
  const Geometry& geometry = body.geometry();
  if (geometry.kind == GeometryKind::kPlane) {
    return {{-kEverywhere_m, -kEverywhere_m, -kEverywhere_m}, {kEverywhere_m, kEverywhere_m, kEverywhere_m}};
  }
  return BoundsOf(geometry, body.placement().rotation).Moved(Vec3f(body.placement().position - origin_));
}

Bounds BroadPhase::SweptBounds(const SweptMotion& motion) const {
  const float outer = motion.geometry.outer_radius_m;
  const Vec3f from(motion.from - origin_), to(motion.to - origin_), around{outer, outer, outer};
  return {Vec3f{std::min(from.x, to.x), std::min(from.y, to.y), std::min(from.z, to.z)} - around,
          Vec3f{std::max(from.x, to.x), std::max(from.y, to.y), std::max(from.z, to.z)} + around};
}

void BroadPhase::Overlapping(const Bounds& bounds, std::vector<RigidBody*>* bodies) {
  struct Collect : btBroadphaseAabbCallback {
    bool process(const btBroadphaseProxy* proxy) override {
      bodies->push_back(&BodyOf(*proxy));
      return true;
    }
    std::vector<RigidBody*>* bodies = nullptr;
  } collect;
  collect.bodies = bodies;
  trees_.aabbTest(ToBullet(bounds.min), ToBullet(bounds.max), collect);
}

// Bullet's own walk along a ray is in single precision, and cannot be ended.
void BroadPhase::Along(const Way& way, Vec3d half_m, absl::FunctionRef<bool(RigidBody&)> visit) const {
  const auto crosses = [&](const btDbvtVolume& volume) {
    const Vec3d min(FromBullet(volume.Mins())), max(FromBullet(volume.Maxs()));
    const double margin = kQueryMargin_m + kQueryMarginShare * std::max(Length(min), Length(max));
    return way.PartIn(Aabb{min - half_m, max + half_m}.Expanded(margin)).has_value();
  };
  std::vector<const btDbvtNode*> open;
  for (const btDbvt& tree : trees_.m_sets) {
    if (tree.m_root != nullptr) open.push_back(tree.m_root);
  }
  while (!open.empty()) {
    const btDbvtNode& node = *open.back();
    open.pop_back();
    if (!crosses(node.volume)) continue;
    if (node.isinternal()) {
      open.push_back(node.childs[0]);
      open.push_back(node.childs[1]);
    } else if (!visit(BodyOf(*static_cast<const btDbvtProxy*>(node.data)))) {
      return;
    }
  }
}

bool BroadPhase::Validate(std::span<RigidBody* const> awake) {
  return std::all_of(awake.begin(), awake.end(), [](const RigidBody* body) {
    return IsFinite(body->reach.min) && IsFinite(body->reach.max) && body->fat.Contains(body->reach);
  });
}

}  // namespace tessera::physics
