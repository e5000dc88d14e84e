#include "core/physics/continuous/continuous_collision.h"

#include <algorithm>
#include <cassert>
#include <optional>

#include "core/physics/continuous/carried.h"
#include "core/physics/continuous/jointed_stops.h"
#include "core/physics/continuous/keep_turning.h"
#include "core/physics/continuous/spared_sweeps.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// Number of swept bodies that a thread takes at a time.
constexpr std::size_t kChunkSwept = 8;

// Whether two touch where their sweep says that they meet. Boxes that meet rim by rim, as where one slides over the
// seams of a floor of boxes, do not press on each other.
bool TouchAt(const Pair& pair, const SweptMotion& low, const SweptMotion& high, double fraction) {
  const Placement low_then = low.At(fraction), high_then = high.At(fraction);
  PairCache cache;
  Manifolds manifolds;
  Collide({pair.low->geometry(), low_then}, {pair.high->geometry(), high_then}, kSpeculative_m, cache, manifolds);
  return !manifolds.empty();
}

// Where `body`, which is swept, meets `other`, one of the two is stopped.
Stop StopOf(RigidBody& body, RigidBody& other, double share) {
  return Carries(body, other) ? Stop{other.awake_index, share, &body} : Stop{body.awake_index, share, &other};
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
    // Those that began since the known ones were swept, with a candidate before this one, were swept with that.
    const std::size_t swept_pairs = body.pairs.size();
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
    for (std::size_t k = swept_pairs; k < body.pairs.size(); ++k) Sweep(i, body, body.pairs[k], motions, &late_);
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

bool ContinuousCollision::IsCandidate(const RigidBody& body) const {
  return body.awake() && suspect_[body.awake_index] != 0;
}

void ContinuousCollision::BeginPairs(RigidBody& body, const Bounds& swept, BroadPhase& broad_phase, PairTable& pairs) {
  nearby_.clear();
  broad_phase.Overlapping(swept, &nearby_);
  for (RigidBody* other : nearby_) {
    if (other != &body) pairs.Begin(body, *other);
  }
}

// Sweeps the pairs that candidates have by now, those of two candidates with the first of them. What a deflected one
// meets beside those begins pairs, in the order of candidates, and is swept after.
void ContinuousCollision::SweepKnownPairs(std::span<RigidBody* const> awake, std::span<const BodyMotion> motions) {
  for (std::vector<Encounter>& encounters : encounters_) encounters.clear();
  encounters_.resize(std::max(encounters_.size(), candidates_.size() / kChunkSwept + 1));
  team_.For(candidates_.size(), kChunkSwept, [&](std::size_t begin, std::size_t end) {
    std::vector<Encounter>& encounters = encounters_[begin / kChunkSwept];
    for (std::size_t i = begin; i < end; ++i) {
      RigidBody& body = *awake[candidates_[i]];
      for (const PairEnd& pair_end : body.pairs) {
        const bool swept_by_other = IsCandidate(*pair_end.other) && pair_end.other->awake_index < body.awake_index;
        if (!swept_by_other) Sweep(i, body, pair_end, motions, &encounters);
      }
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
    const Stop stop = StopOf(body, *other, impact->fraction);
    encounters->push_back({candidate, nullptr, stop});
    if (!IsCandidate(*other)) return;
    const Stop others = StopOf(*other, body, impact->fraction);
    if (others.index != stop.index) encounters->push_back({candidate, nullptr, others});
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
