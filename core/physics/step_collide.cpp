// The first half of a step: what may touch what, where, and who wakes of it.
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/physics/tuning.h"
#include "core/physics/world_impl.h"
#include "core/world/state_check.h"

namespace tessera::physics {
namespace {

Course CourseOf(const RigidBody& body, double dt) {
  const Vec3d a = body.Acceleration();
  const Vec3d v(body.state().linear_velocity);
  const Vec3f spin = body.state().angular_velocity;
  return {Vec3f(v * dt + a * (0.5 * dt * dt)), Vec3f(v + a * dt), spin,
          std::min(2.0f, Length(spin) * static_cast<float>(dt)) * body.geometry().outer_radius_m};
}

// About what a surface bends where its outward normal is `normal`, m.
float RoundnessOf(const RigidBody& body, Vec3f normal) {
  const Geometry& geometry = body.geometry();
  switch (geometry.kind) {
    case GeometryKind::kSphere:
    case GeometryKind::kCapsule:
      return geometry.radius_m;
    case GeometryKind::kCylinder:
    case GeometryKind::kCone: {
      const float axial = Dot(body.placement().rotation.y, normal);
      const float radial = std::sqrt(std::max(0.0f, 1 - axial * axial));
      return radial > 0.5f ? geometry.radius_m * radial : 0;
    }
    default:
      return 0;
  }
}

// How near its surfaces are, and whether one of its points can come to push in this step.
void Measure(Pair* pair, float dt) {
  const Course &low = pair->low->course, &high = pair->high->course;
  pair->separation_m = std::numeric_limits<float>::max();
  pair->live = false;
  const Vec3f velocity = high.velocity_m_s - low.velocity_m_s;
  for (Manifold& manifold : pair->manifolds) {
    manifold.round_a_m = RoundnessOf(*pair->low, manifold.normal);
    manifold.round_b_m = RoundnessOf(*pair->high, -manifold.normal);
    const float approach = Dot(velocity, manifold.normal);
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      pair->separation_m = std::min(pair->separation_m, point.separation_m);
      const Vec3f turning = Cross(high.spin_rad_s, point.r_b) - Cross(low.spin_rad_s, point.r_a);
      const float closing = (approach + Dot(turning, manifold.normal)) * dt;
      if (point.separation_m + std::min(closing, 0.0f) < kTouchSoon_m) pair->live = true;
    }
  }
}

float Approach(const Pair& pair, const Manifold& manifold, const ManifoldPoint& point) {
  const auto velocity = [](const RigidBody& body, Vec3f r) {
    if (!body.awake()) return Vec3f();
    return body.state().linear_velocity + Cross(body.state().angular_velocity, r);
  };
  return -Dot(velocity(*pair.high, point.r_b) - velocity(*pair.low, point.r_a), manifold.normal);
}

// While it is warm in the cache.
Touch TouchOf(Pair& pair) {
  const auto index = [](const RigidBody& body) { return body.awake() ? body.awake_index : kAsleep; };
  Touch touch{.pair = &pair,
              .low = index(*pair.low),
              .high = index(*pair.high),
              .low_tag = pair.low->tag,
              .high_tag = pair.high->tag,
              .manifolds = pair.manifolds.data(),
              .count = static_cast<std::uint32_t>(pair.manifolds.size()),
              .substeps = pair.substeps,
              .responds = pair.responds(),
              .live = pair.live,
              .penetration_m = 0,
              .impact_m_s = 0,
              .load_ns = pair.load_ns,
              .inner_m = pair.inner_m,
              .slop_m = pair.slop_m,
              .normal = pair.manifolds.front().normal,
              .material = pair.material};
  if (!touch.live || !touch.responds) return touch;
  for (const Manifold& manifold : pair.manifolds) {
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      touch.penetration_m = std::max(touch.penetration_m, -point.separation_m);
      touch.impact_m_s = std::max(touch.impact_m_s, Approach(pair, manifold, point));
    }
  }
  return touch;
}

}  // namespace

bool World::Impl::Sane(const RigidBody& body) {
  return IsSane(body.state()) && CheckForce(body.id(), Vec3f(body.force_n), Vec3f(body.torque_nm)).ok();
}

void World::Impl::FindPairs() {
  for (std::size_t i = 0; i < awake.size();) {
    RigidBody& body = *awake[i];
    // Who came to be non-finite, or faster than anything in a world has a right to be, is taken out before it can touch
    // anything.
    if (!Sane(body)) {
      Isolate(body);
      continue;
    }
    ++i;
    body.PrepareDamping(dt_s);
    body.course = CourseOf(body, dt_s);
    const float grow = kSpeculative_m + std::min(body.course.sweep_m, body.geometry().outer_radius_m);
    SetReach(body, TightBounds(body).Swept(body.course.move_m).Grown(grow));
  }
  if (step % kTendSteps == 0) broad_phase.Tend();
  BeginPairs();
}

void World::Impl::BeginPairs() {
  for (const BroadPhase::Meeting& meeting : broad_phase.met()) {
    if (pairs.Has(meeting.key)) continue;
    RigidBody &a = BroadPhase::BodyOf(*meeting.a), &b = BroadPhase::BodyOf(*meeting.b);
    if (a.isolated || b.isolated) continue;
    pairs.Begin(a, b);
    if (Jointed(a, b)) pairs.Find(a, b)->jointed = true;
  }
  broad_phase.met().clear();
}

void World::Impl::CollidePairs() {
  touched.clear();
  touching.clear();
  parting.clear();
  const auto list = [this](Pair& pair) {
    if (!pair.manifolds.empty()) {
      touching.push_back(TouchOf(pair));
    } else if (pair.touching || pair.crossed) {
      parting.push_back(&pair);
    }
  };
  pairs.Walk([&](Pair& pair) {
    CollidePair(pair);
    if (pair.low != nullptr) list(pair);
  });
  if (touched.empty()) return;
  // Who wakes brings pairs of its own, in which it may wake others.
  while (!touched.empty()) {
    WakeTouched();
    for (Pair* pair : pairs.News()) CollidePair(*pair);
  }
  touching.clear();
  parting.clear();
  pairs.Revisit(list);
}

void World::Impl::CollidePair(Pair& pair) {
  RigidBody &low = *pair.low, &high = *pair.high;
  if (!low.fat.Overlaps(high.fat)) {
    if (pair.touching) ended.push_back({low.id(), high.id(), pair.trigger, false});
    pairs.End(pair);
    return;
  }
  pair.searched = true;
  pair.live = pair.swept = false;
  pair.separation_m = std::numeric_limits<float>::max();
  if (pair.jointed && !pair.trigger) return;
  const bool told = low.elsewhere.stand_in && high.elsewhere.stand_in && !pair.trigger;
  if (told || !low.reach.Overlaps(high.reach)) {
    if (!std::exchange(pair.apart, true)) {
      pair.manifolds.clear();
      pair.cache = {};
      pair.impulse_ns = pair.load_ns = 0;
      pair.substeps = 0;
    }
    return;
  }
  pair.apart = false;
  const float inner = pair.inner_m;
  const float move = Length(low.course.move_m - high.course.move_m) + low.course.sweep_m + high.course.sweep_m;
  const bool fast = move > kFastShare * inner;
  const float speculative = kSpeculative_m + (fast ? 0.0f : move);
  Collide({low.geometry(), low.placement()}, {high.geometry(), high.placement()}, speculative, pair.cache,
          pair.manifolds);
  Measure(&pair, static_cast<float>(dt_s));
  if (fast && !pair.trigger && pair.separation_m > kTouchEnd_m) {
    CollideFast(pair);
    Measure(&pair, static_cast<float>(dt_s));
  }
  if (!pair.live || pair.trigger) return;
  if (low.dynamic() && !low.awake()) touched.push_back(&low);
  if (high.dynamic() && !high.awake()) touched.push_back(&high);
}

// Two that move by much of their own size in a step. Their nearest points of now say nothing of where they will meet,
// so contacts are found where they do, and told as far apart as the way to there is long. One that only passes by meets
// nothing.
void World::Impl::CollideFast(Pair& pair) {
  const Way low = PredictedWay(*pair.low), high = PredictedWay(*pair.high);
  pair.manifolds.clear();
  pair.cache = {};
  const std::optional<Impact> impact = FirstImpact(low, high, kImpactDistance_m);
  if (!impact) return;
  const Placement low_then = low.At(impact->fraction), high_then = high.At(impact->fraction);
  PairCache cache;
  Collide({low.geometry, low_then}, {high.geometry, high_then}, 2 * kImpactDistance_m, cache, pair.manifolds);
  const Vec3f moved(((high.to - high.from) - (low.to - low.from)) * impact->fraction);
  const Vec3f low_turned(low.turned_rad * impact->fraction), high_turned(high.turned_rad * impact->fraction);
  pair.swept = true;
  for (Manifold& manifold : pair.manifolds) {
    manifold.ahead_m = moved;
    for (int i = 0; i < manifold.count; ++i) {
      ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      const Vec3f way = moved + Cross(high_turned, point.r_b) - Cross(low_turned, point.r_a);
      point.separation_m -= Dot(way, manifold.normal);
    }
  }
}

void World::Impl::WakeTouched() {
  std::vector<RigidBody*> sleepers;
  std::swap(sleepers, touched);
  for (RigidBody* body : sleepers) Wake(*body);
}

Way World::Impl::PredictedWay(const RigidBody& body) const {
  const Placement& from = body.placement();
  if (!body.awake()) return {body.geometry(), from.position, from.position, from.orientation, {}};
  return {body.geometry(), from.position, from.position + Vec3d(body.course.move_m), from.orientation,
          Vec3d(body.course.spin_rad_s) * dt_s};
}

void World::Impl::BuildIslands() {
  islands.Reset(awake.size());
  for (const Touch& touch : touching) {
    if (touch.responds && touch.both()) islands.Unite(touch.low, touch.high);
  }
  ListJoints();
  for (const Joint* joint : awake_joints) {
    if (joint->b != nullptr && joint->a->awake() && joint->b->awake()) {
      islands.Unite(joint->a->awake_index, joint->b->awake_index);
    }
  }
  islands.Number();
  MakeJointRows();
  WeighIslands();
  PassLoadsDown();
  EvenLoads();
}

void World::Impl::ListJoints() {
  awake_joints.clear();
  if (joints.empty()) return;
  for (RigidBody* body : awake) {
    for (const JointId id : body->joints) {
      Joint& joint = joints.at(id);
      if (joint.step == step) continue;
      joint.step = step;
      awake_joints.push_back(&joint);
    }
  }
  std::sort(awake_joints.begin(), awake_joints.end(), [](const Joint* a, const Joint* b) { return a->id < b->id; });
}

}  // namespace tessera::physics
