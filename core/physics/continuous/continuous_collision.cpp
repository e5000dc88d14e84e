#include "core/physics/continuous/continuous_collision.h"

#include <algorithm>
#include <cassert>
#include <optional>

#include "core/physics/continuous/carried.h"
#include "core/physics/continuous/jointed_stops.h"
#include "core/physics/continuous/keep_turning.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// Number of swept bodies that a thread takes at a time.
constexpr std::size_t kChunkSwept = 8;

// A body's way through a step, as far as the tests that spare a sweep ask.
struct Moved {
  Vec3d from, move;       // the centre of mass, m
  double rim_m = 0;       // its turning brings no point further than this
  double outer_radius_m;  // about the centre of mass; infinite for a plane
};

Moved MovedOf(const RigidBody& body, std::span<const BodyMotion> motions) {
  const Geometry& geometry = body.geometry();
  Moved moved{.from = body.placement().position, .move = {}, .outer_radius_m = geometry.outer_radius_m};
  double turned_rad = 0;
  if (body.awake()) {
    const BodyMotion& motion = motions[body.awake_index];
    moved.move = motion.position - moved.from;
    turned_rad = Length(Vec3d(motion.turned_rad));
  } else {
    moved.move = Vec3d(body.predicted.move_m);
    if (body.moving()) turned_rad = Length(Vec3d(body.state().angular_velocity)) * body.driven_s;
  }
  if (geometry.kind != GeometryKind::kSphere && turned_rad > 0) {
    moved.rim_m = std::min(2.0, turned_rad) * geometry.outer_radius_m;
  }
  return moved;
}

// More than what is lost by rounding in a test that spares a sweep, m.
constexpr double kRounding_m = 1e-5;

// True if the balls about them that hold them stay apart: then a sweep finds no impact.
bool StayApart(const Moved& low, const Moved& high) {
  const Vec3d start = high.from - low.from, travel = high.move - low.move;
  const double all = LengthSquared(travel);
  const double nearest = all > 0 ? std::clamp(-Dot(start, travel) / all, 0.0, 1.0) : 0;
  const double room = low.outer_radius_m + high.outer_radius_m + kImpactDistance_m + kRounding_m;
  return LengthSquared(start + travel * nearest) > room * room;
}

// True if neither can have come through a contact plane of the pair by more than `depth_m`: no point comes further than
// the two approach along its normal, and than their turning brings it.
bool GaveNoWay(const Pair& pair, const Moved& low, const Moved& high, double depth_m) {
  const Vec3d approach = low.move - high.move;
  const double spare = depth_m - std::max(low.rim_m, high.rim_m) - kRounding_m;
  return std::ranges::all_of(pair.manifolds,
                             [&](const Manifold& manifold) { return Dot(Vec3d(manifold.normal), approach) < spare; });
}

// True if one of the two came through a contact plane of the pair by more than `depth_m`.
bool CameThroughEither(const Pair& pair, const Moved& low_moved, const Moved& high_moved, double depth_m,
                       std::span<const BodyMotion> motions) {
  const SweptMotion low = SweptMotionOf(*pair.low, motions), high = SweptMotionOf(*pair.high, motions);
  for (const Manifold& manifold : pair.manifolds) {
    const Vec3d on_low = low.from + Vec3d(manifold.points[0].r_a), on_high = high.from + Vec3d(manifold.points[0].r_b);
    if (pair.high->awake() && CameThrough(high, on_low, on_low + low_moved.move, manifold.normal) > depth_m) {
      return true;
    }
    if (pair.low->awake() && CameThrough(low, on_high, on_high + high_moved.move, -manifold.normal) > depth_m) {
      return true;
    }
  }
  return false;
}

// Whether a pair that was solved needs a sweep all the same, because it gave way: a rod that is stopped at its end
// turns about it, and most of it would be behind the wall by the end of the step.
bool GoesThrough(const Pair& pair, const Moved& low, const Moved& high, std::span<const BodyMotion> motions) {
  if (pair.swept) return true;
  const double depth_m = kThroughShare * pair.inner_m;
  const bool may = !GaveNoWay(pair, low, high, depth_m);
  assert(may || !CameThroughEither(pair, low, high, depth_m, motions));
  return may && CameThroughEither(pair, low, high, depth_m, motions);
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
  SweepKnownPairs(in.awake, motions);
  std::size_t chunk = 0, taken = 0;
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    RigidBody& body = *in.awake[candidates_[i]];
    if (deflected_[candidates_[i]] != 0) {
      const Bounds swept = broad_phase.SweptBounds(SweptMotionOf(body, motions));
      if (!body.fat.Contains(swept)) BeginPairs(body, swept, broad_phase, pairs);
    }
    for (; chunk < encounters_.size(); ++chunk, taken = 0) {
      const std::vector<Encounter>& encounters = encounters_[chunk];
      while (taken < encounters.size() && encounters[taken].candidate == i) Take(encounters[taken++]);
      if (taken < encounters.size()) break;
    }
    late_.clear();
    for (std::size_t k = swept_[i]; k < body.pairs.size(); ++k) Sweep(i, body, body.pairs[k], motions, &late_);
    for (const Encounter& encounter : late_) Take(encounter);
  }
  if (!stops_.empty()) StopBodies(in, broad_phase, motions);
}

// A candidate moved by so much of its size that it may have passed through something, or came out so far from its
// predicted motion that the contacts along that say little.
void ContinuousCollision::FindCandidates(const ContinuousInput& in, std::span<const BodyMotion> motions) {
  deflected_.resize(in.awake.size());
  suspect_.resize(in.awake.size());
  team_.For(in.awake.size(), kChunkBodies, [this, in, motions](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PrefetchAfter(i, in.awake, kUpToForces);
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
      suspect_[i] = off > kSpeculative_m || Length(moved) + rim(motion.turned_rad) > fast ? 1 : 0;
    }
  });
  candidates_.clear();
  for (std::uint32_t i = 0; i < in.awake.size(); ++i) {
    if (suspect_[i] != 0) candidates_.push_back(i);
  }
}

void ContinuousCollision::BeginPairs(RigidBody& body, const Bounds& swept, BroadPhase& broad_phase, PairTable& pairs) {
  nearby_.clear();
  broad_phase.Overlapping(swept, &nearby_);
  for (RigidBody* other : nearby_) {
    if (other != &body) pairs.Begin(body, *other);
  }
}

// Sweeps the pairs that candidates have by now. What a deflected one meets beside those begins pairs, in the order of
// candidates, and is swept after.
void ContinuousCollision::SweepKnownPairs(std::span<RigidBody* const> awake, std::span<const BodyMotion> motions) {
  for (std::vector<Encounter>& encounters : encounters_) encounters.clear();
  encounters_.resize(std::max(encounters_.size(), candidates_.size() / kChunkSwept + 1));
  swept_.resize(candidates_.size());
  team_.For(candidates_.size(), kChunkSwept, [&](std::size_t begin, std::size_t end) {
    std::vector<Encounter>& encounters = encounters_[begin / kChunkSwept];
    for (std::size_t i = begin; i < end; ++i) {
      RigidBody& body = *awake[candidates_[i]];
      swept_[i] = body.pairs.size();
      for (const PairEnd& pair_end : body.pairs) Sweep(i, body, pair_end, motions, &encounters);
    }
  });
}

void ContinuousCollision::Sweep(std::size_t candidate, RigidBody& body, const PairEnd& end,
                                std::span<const BodyMotion> motions, std::vector<Encounter>* encounters) const {
  Pair* const pair = end.pair;
  RigidBody* const other = end.other;
  if (pair->jointed && !pair->trigger) return;
  const bool as_expected =
      deflected_[body.awake_index] == 0 && !(other->awake() && deflected_[other->awake_index] != 0);
  const bool solved = !pair->manifolds.empty();
  if (!pair->trigger && !solved && as_expected) return;
  const Moved low_moved = MovedOf(*pair->low, motions), high_moved = MovedOf(*pair->high, motions);
  if (!pair->trigger && solved && !GoesThrough(*pair, low_moved, high_moved, motions)) return;
  const SweptMotion low = SweptMotionOf(*pair->low, motions), high = SweptMotionOf(*pair->high, motions);
  if (StayApart(low_moved, high_moved)) {
    assert(!FirstImpact(low, high, kImpactDistance_m));
    return;
  }
  const std::optional<Impact> impact = FirstImpact(low, high, kImpactDistance_m);
  if (!impact) return;
  if (pair->trigger) {
    encounters->push_back({candidate, pair, {}});
  } else if (impact->fraction < 1 && TouchAt(*pair, low, high, impact->fraction)) {
    encounters->push_back({candidate, nullptr,
                           Carries(body, *other) ? Stop{other->awake_index, impact->fraction, &body}
                                                 : Stop{body.awake_index, impact->fraction, other}});
  }
}

void ContinuousCollision::Take(const Encounter& encounter) {
  if (encounter.crossed != nullptr) {
    crossed_.push_back(encounter.crossed);
  } else {
    stops_.push_back(encounter.stop);
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
