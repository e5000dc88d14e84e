#include "core/physics/continuous/continuous_collision.h"

#include <algorithm>
#include <optional>

#include "core/physics/continuous/carried.h"
#include "core/physics/continuous/jointed_stops.h"
#include "core/physics/continuous/keep_turning.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// Whether a pair that was solved needs a sweep all the same, because it gave way: a rod that is stopped at its end
// turns about it, and most of it would be behind the wall by the end of the step.
bool GoesThrough(const Pair& pair, std::span<const BodyMotion> motions) {
  if (pair.swept) return true;
  const SweptMotion low = SweptMotionOf(*pair.low, motions), high = SweptMotionOf(*pair.high, motions);
  const Vec3d low_moved = low.to - low.from, high_moved = high.to - high.from;
  const float inner = kThroughShare * pair.inner_m;
  for (const Manifold& manifold : pair.manifolds) {
    const Vec3d on_low = low.from + Vec3d(manifold.points[0].r_a), on_high = high.from + Vec3d(manifold.points[0].r_b);
    if (pair.high->awake() && CameThrough(high, on_low, on_low + low_moved, manifold.normal) > inner) return true;
    if (pair.low->awake() && CameThrough(low, on_high, on_high + high_moved, -manifold.normal) > inner) return true;
  }
  return false;
}

// Whether two touch where their sweep says that they meet. Boxes that meet rim by rim, as where one slides over the
// seams of a floor of boxes, do not press on each other.
bool TouchAt(const Pair& pair, const SweptMotion& low, const SweptMotion& high, double fraction) {
  const Placement low_then = low.At(fraction), high_then = high.At(fraction);
  PairCache cache;
  Manifolds manifolds;
  Collide({pair.low->geometry(), low_then}, {pair.high->geometry(), high_then}, kSpeculative_m, cache, manifolds);
  return !manifolds.empty();
}

}  // namespace

void ContinuousCollision::Clear() {
  stops_.clear();
  crossed_.clear();
  impulses_.clear();
}

void ContinuousCollision::Run(const ContinuousInput& in, BroadPhase& broad_phase, PairTable& pairs,
                              std::span<BodyMotion> motions) {
  Clear();
  FindCandidates(in, motions);
  for (const std::uint32_t index : candidates_) {
    RigidBody& body = *in.awake[index];
    if (deflected_[index] != 0) {
      const Bounds swept = broad_phase.SweptBounds(SweptMotionOf(body, motions));
      if (!body.fat.Contains(swept)) BeginPairs(body, swept, broad_phase, pairs);
    }
    Sweep(body, motions);
  }
  if (!stops_.empty()) StopBodies(in, broad_phase, motions);
}

// A candidate moved by so much of its size that it may have passed through something, or came out so far from its
// predicted motion that the contacts along that say little.
void ContinuousCollision::FindCandidates(const ContinuousInput& in, std::span<const BodyMotion> motions) {
  candidates_.clear();
  deflected_.resize(in.awake.size());
  for (std::uint32_t i = 0; i < in.awake.size(); ++i) {
    const RigidBody& body = *in.awake[i];
    const BodyMotion& motion = motions[i];
    const Vec3f moved(motion.position - body.placement().position);
    const auto rim = [&body](Vec3f turned_rad) {
      return std::min(2.0f, Length(turned_rad)) * body.geometry().outer_radius_m;
    };
    const Vec3f expected_turn = body.predicted.spin_rad_s * static_cast<float>(in.dt_s);
    const float off = Length(moved - body.predicted.move_m) + rim(motion.turned_rad - expected_turn);
    deflected_[i] = off > kDeflected_m ? 1 : 0;
    const float fast = std::max(kFastShare * body.geometry().inner_radius_m, kSpeculative_m);
    if (off > kSpeculative_m || Length(moved) + rim(motion.turned_rad) > fast) candidates_.push_back(i);
  }
}

void ContinuousCollision::BeginPairs(RigidBody& body, const Bounds& swept, BroadPhase& broad_phase, PairTable& pairs) {
  nearby_.clear();
  broad_phase.Overlapping(swept, &nearby_);
  for (RigidBody* other : nearby_) {
    if (other != &body) pairs.Begin(body, *other);
  }
}

void ContinuousCollision::Sweep(RigidBody& body, std::span<const BodyMotion> motions) {
  for (const auto& [pair, other] : body.pairs) {
    if (pair->jointed && !pair->trigger) continue;
    const bool as_expected =
        deflected_[body.awake_index] == 0 && !(other->awake() && deflected_[other->awake_index] != 0);
    if (!pair->trigger && (pair->manifolds.empty() ? as_expected : !GoesThrough(*pair, motions))) continue;
    const SweptMotion low = SweptMotionOf(*pair->low, motions), high = SweptMotionOf(*pair->high, motions);
    const std::optional<Impact> impact = FirstImpact(low, high, kImpactDistance_m);
    if (!impact) continue;
    if (pair->trigger) {
      crossed_.push_back(pair);
    } else if (impact->fraction < 1 && TouchAt(*pair, low, high, impact->fraction)) {
      stops_.push_back(Carries(body, *other) ? Stop{other->awake_index, impact->fraction, &body}
                                             : Stop{body.awake_index, impact->fraction, other});
    }
  }
}

void ContinuousCollision::StopBodies(const ContinuousInput& in, BroadPhase& broad_phase,
                                     std::span<BodyMotion> motions) {
  SortStops(in.awake, &stops_);
  const auto has_joints = [&](const Stop& stop) { return !in.awake[stop.index]->joints.empty(); };
  if (std::any_of(stops_.begin(), stops_.end(), has_joints)) {
    JointedStops jointed(in.awake, in.joints, in.groups);
    jointed.Spread(&stops_);
    SortStops(in.awake, &stops_);
    jointed.NoteGaps(stops_, motions);
    MoveBack(in.awake, stops_, motions);
    jointed.Rejoin(motions);
  } else {
    MoveBack(in.awake, stops_, motions);
  }
  CarryStopped(in.awake, stops_, broad_phase, nearby_, motions);
  for (const Stop& stop : stops_) {
    const std::optional<PairImpulse> impulse = KeepTurning(in.awake, stop, motions);
    if (impulse) impulses_.push_back(*impulse);
  }
}

bool ContinuousCollision::Validate(std::span<RigidBody* const> awake) const {
  for (std::size_t i = 0; i < stops_.size(); ++i) {
    const Stop& stop = stops_[i];
    if (stop.index >= awake.size() || !(stop.share >= 0 && stop.share < 1)) return false;
    if (i > 0 && !(awake[stops_[i - 1].index]->id() < awake[stop.index]->id())) return false;
  }
  return true;
}

}  // namespace tessera::physics
