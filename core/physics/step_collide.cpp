// The first half of a step: what may touch what, where, and who wakes of it.
#include <algorithm>
#include <cmath>

#include "core/physics/motion/turn.h"
#include "core/physics/tuning.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {
namespace {

bool Sane(const RigidBody& body) {
  const BodyState& s = body.state();
  return IsFinite(s.position) && IsFinite(s.orientation) && IsFinite(body.force_n) && IsFinite(body.torque_nm) &&
         Length(s.linear_velocity) <= kAbsurdSpeed_m_s && Length(s.angular_velocity) <= kAbsurdSpin_rad_s &&
         Length(body.force_n) <= kAbsurdSpeed_m_s * body.mass_kg() * kAbsurdRate_hz;
}

// What it moves in a step if nothing hinders it, m.
Vec3f MoveOf(const RigidBody& body, double dt) {
  if (!body.awake()) return {};
  const Vec3d a = body.gravity_m_s2() + body.force_n / body.mass_kg();
  return Vec3f(Vec3d(body.state().linear_velocity) * dt + a * (0.5 * dt * dt));
}

// Its fastest point, against its centre.
float SweepOf(const RigidBody& body, double dt) {
  if (!body.awake()) return 0;
  return std::min(2.0f, Length(body.state().angular_velocity) * static_cast<float>(dt)) *
         body.geometry().outer_radius_m;
}

float InnerRadius(const Pair& pair) {
  if (!pair.low->dynamic()) return pair.high->geometry().inner_radius_m;
  if (!pair.high->dynamic()) return pair.low->geometry().inner_radius_m;
  return std::min(pair.low->geometry().inner_radius_m, pair.high->geometry().inner_radius_m);
}

Vec3f VelocityAt(const RigidBody& body, Vec3f r, double dt) {
  if (!body.awake()) return {};
  const Vec3d a = body.gravity_m_s2() + body.force_n / body.mass_kg();
  return body.state().linear_velocity + Cross(body.state().angular_velocity, r) + Vec3f(a * dt);
}

// Whether one of its points can come to push in this step.
bool MayTouch(const Pair& pair, double dt) {
  for (const Manifold& manifold : pair.manifolds) {
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      const Vec3f approach = VelocityAt(*pair.high, point.r_b, dt) - VelocityAt(*pair.low, point.r_a, dt);
      const float closing = Dot(approach, manifold.normal) * static_cast<float>(dt);
      if (point.separation_m + std::min(closing, 0.0f) < kTouchSoon_m) return true;
    }
  }
  return false;
}

float Separation(const std::vector<Manifold>& manifolds) {
  float least = std::numeric_limits<float>::max();
  for (const Manifold& manifold : manifolds) {
    for (int i = 0; i < manifold.count; ++i) {
      least = std::min(least, manifold.points[static_cast<std::size_t>(i)].separation_m);
    }
  }
  return least;
}

}  // namespace

// Who came to be non-finite, or faster than anything in a world has a right to be, is taken out before it can touch
// anything.
void World::Impl::DropAbsurd() {
  for (std::size_t i = 0; i < awake.size();) {
    RigidBody& body = *awake[i];
    if (Sane(body)) {
      ++i;
    } else {
      Isolate(body);
    }
  }
}

void World::Impl::FindPairs() {
  for (RigidBody* body : awake) {
    Bounds reach = TightBounds(*body);
    const Vec3f move = MoveOf(*body, dt_s);
    const float grow = kSpeculative_m + std::min(SweepOf(*body, dt_s), body->geometry().outer_radius_m);
    const Vec3f margin{grow, grow, grow};
    const auto low = [](float v) { return std::min(v, 0.0f); };
    const auto high = [](float v) { return std::max(v, 0.0f); };
    reach.min += Vec3f{low(move.x), low(move.y), low(move.z)} - margin;
    reach.max += Vec3f{high(move.x), high(move.y), high(move.z)} + margin;
    SetReach(*body, reach);
  }
  broad_phase.Tend();
  for (const auto& [a, b] : broad_phase.begun()) {
    if (a->isolated || b->isolated) continue;
    pairs.Begin(*a, *b);
    if (Jointed(*a, *b)) pairs.Find(*a, *b)->jointed = true;
  }
  broad_phase.begun().clear();
}

void World::Impl::CollidePairs() {
  touched.clear();
  for (Pair* pair : pairs.Refresh()) CollidePair(*pair);
  // Who wakes brings pairs of its own, in which it may wake others.
  while (!touched.empty()) {
    WakeTouched();
    for (Pair* pair : pairs.News()) CollidePair(*pair);
  }
  touching.clear();
  for (Pair* pair : pairs.active()) {
    if (pair->low != nullptr && !pair->manifolds.empty()) touching.push_back(pair);
  }
}

void World::Impl::CollidePair(Pair& pair) {
  RigidBody &low = *pair.low, &high = *pair.high;
  if (!low.fat.Overlaps(high.fat)) {
    if (pair.touching) ended.push_back({low.id(), high.id(), pair.trigger, false});
    pairs.End(pair);
    return;
  }
  pair.live = false;
  if (pair.jointed && !pair.trigger) return;
  if (!low.reach.Overlaps(high.reach)) {
    pair.manifolds.clear();
    pair.cache = {};
    return;
  }
  const float inner = InnerRadius(pair);
  const float move = Length(MoveOf(low, dt_s) - MoveOf(high, dt_s)) + SweepOf(low, dt_s) + SweepOf(high, dt_s);
  const bool fast = move > kFastShare * inner;
  const float speculative = kSpeculative_m + (fast ? 0.0f : move);
  Collide({low.geometry(), low.placement()}, {high.geometry(), high.placement()}, speculative, pair.cache,
          pair.manifolds);
  if (fast && !pair.trigger && Separation(pair.manifolds) > kTouchEnd_m) CollideFast(pair);
  pair.live = !pair.manifolds.empty() && MayTouch(pair, dt_s);
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
  const auto at = [&](const Way& way, const RigidBody& body) {
    Placement placement;
    placement.position = way.from + (way.to - way.from) * impact->fraction;
    placement.orientation = Turned(way.orientation_from, Vec3d(body.awake() ? body.state().angular_velocity : Vec3f()) *
                                                             (dt_s * impact->fraction));
    placement.rotation = RotationOf(placement.orientation);
    return placement;
  };
  const Placement low_then = at(low, *pair.low), high_then = at(high, *pair.high);
  PairCache cache;
  Collide({low.geometry, low_then}, {high.geometry, high_then}, 2 * kImpactDistance_m, cache, pair.manifolds);
  const Vec3f moved(((high.to - high.from) - (low.to - low.from)) * impact->fraction);
  const auto turned = [&](const RigidBody& body) {
    return body.awake() ? body.state().angular_velocity * static_cast<float>(dt_s * impact->fraction) : Vec3f();
  };
  for (Manifold& manifold : pair.manifolds) {
    for (int i = 0; i < manifold.count; ++i) {
      ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      const Vec3f way = moved + Cross(turned(*pair.high), point.r_b) - Cross(turned(*pair.low), point.r_a);
      point.separation_m -= Dot(way, manifold.normal);
    }
  }
}

void World::Impl::WakeTouched() {
  std::vector<RigidBody*> waking;
  std::swap(waking, touched);
  for (RigidBody* body : waking) Wake(*body);
}

Way World::Impl::PredictedWay(const RigidBody& body) const {
  const Placement& from = body.placement();
  if (!body.awake()) return {body.geometry(), from.position, from.position, from.orientation, from.orientation};
  return {body.geometry(), from.position, from.position + Vec3d(MoveOf(body, dt_s)), from.orientation,
          Turned(from.orientation, Vec3d(body.state().angular_velocity) * dt_s)};
}

void World::Impl::BuildIslands() {
  islands.Reset(awake.size());
  for (const Pair* pair : touching) {
    if (pair->responds() && pair->low->awake() && pair->high->awake()) {
      islands.Unite(pair->low->awake_index, pair->high->awake_index);
    }
  }
  ListJoints();
  for (const Joint* joint : awake_joints) {
    if (joint->b != nullptr && joint->a->awake() && joint->b->awake()) {
      islands.Unite(joint->a->awake_index, joint->b->awake_index);
    }
  }
  islands.Number();
  WeighIslands();
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
