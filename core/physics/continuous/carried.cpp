#include "core/physics/continuous/carried.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/physics/joint.h"
#include "core/physics/trig.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// Share of a motion that a body can go before it meets something that does not move.
double FreeShare(const RigidBody& body, const SweptMotion& motion, BroadPhase& broad_phase,
                 std::vector<RigidBody*>& candidates) {
  candidates.clear();
  broad_phase.Overlapping(broad_phase.SweptBounds(motion), &candidates);
  double share = 1;
  for (const RigidBody* other : candidates) {
    if (other->stirs() || other->trigger() || other->isolated || JointForbidsContact(body, *other)) continue;
    if (!body.layer().CollidesWith(other->layer())) continue;
    const bool low = body.id() < other->id();
    const SweptMotion still = SweptMotionOf(*other, {});
    const std::optional<Impact> impact = FirstImpact(low ? motion : still, low ? still : motion, kImpactDistance_m);
    if (impact) share = std::min(share, impact->fraction);
  }
  return share;
}

struct Carried {
  const Stop* stop;
  Placement met;  // placement of the carrier where the two met
};

// The heaviest carriers come first, for what is carried may carry.
std::vector<Carried> ListCarried(std::span<RigidBody* const> awake, std::span<const Stop> stops,
                                 std::span<const BodyMotion> motions) {
  std::vector<Carried> carried;
  std::vector<double> shares;
  for (const Stop& stop : stops) {
    if (!Carries(*stop.by, *awake[stop.index])) continue;
    if (shares.empty()) {
      shares.assign(awake.size(), 1.0);
      for (const Stop& any : stops) shares[any.index] = any.share;
    }
    const double goes = stop.by->awake() ? shares[stop.by->awake_index] : 1;
    if (goes <= stop.share) continue;  // The carrier was stopped before it got there.
    carried.push_back({&stop, SweptMotionOf(*stop.by, motions).At(stop.share / goes)});
  }
  // Nothing is as heavy as a kinematic body.
  const auto mass_kg = [](const Carried& one) {
    return one.stop->by->awake() ? one.stop->by->mass_kg() : std::numeric_limits<double>::infinity();
  };
  std::stable_sort(carried.begin(), carried.end(),
                   [&](const Carried& a, const Carried& b) { return mass_kg(a) > mass_kg(b); });
  return carried;
}

// Where a carrier is at the end of the step. It may have been stopped itself.
Placement EndOf(const RigidBody& carrier, std::span<const BodyMotion> motions) {
  if (!carrier.awake()) return SweptMotionOf(carrier, motions).At(1);
  Placement end;
  end.position = motions[carrier.awake_index].position;
  end.orientation = motions[carrier.awake_index].orientation;
  return end;
}

}  // namespace

void CarryStopped(std::span<RigidBody* const> awake, std::span<const Stop> stops, BroadPhase& broad_phase,
                  std::vector<RigidBody*>& candidates, std::span<BodyMotion> motions) {
  for (const auto& [stop, met] : ListCarried(awake, stops, motions)) {
    const RigidBody& body = *awake[stop->index];
    const Placement end_of_carrier = EndOf(*stop->by, motions);
    const Quatd turn = end_of_carrier.orientation * Conjugate(met.orientation);
    BodyMotion& motion = motions[stop->index];
    const Vec3d to = end_of_carrier.position + Rotate(turn, motion.position - met.position);
    const SweptMotion onward{body.geometry(), motion.position, to, motion.orientation, RotationVectorOf(turn)};
    const Placement end = onward.At(FreeShare(body, onward, broad_phase, candidates));
    motion.position = end.position;
    motion.orientation = end.orientation;
  }
}

}  // namespace tessera::physics
