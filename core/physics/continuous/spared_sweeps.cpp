#include "core/physics/continuous/spared_sweeps.h"

#include <algorithm>
#include <cassert>

#include "core/physics/continuous/stops.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// More than what is lost by rounding in a test that spares a sweep, m.
constexpr double kRounding_m = 1e-5;

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
    if (pair.high->awake() && CameThrough(high, on_low, on_low + low_moved.move, manifold.normal, depth_m)) return true;
    if (pair.low->awake() && CameThrough(low, on_high, on_high + high_moved.move, -manifold.normal, depth_m))
      return true;
  }
  return false;
}

}  // namespace

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

bool StayApart(const Moved& low, const Moved& high) {
  const Vec3d start = high.from - low.from, travel = high.move - low.move;
  const double all = LengthSquared(travel);
  const double nearest = all > 0 ? std::clamp(-Dot(start, travel) / all, 0.0, 1.0) : 0;
  const double room = low.outer_radius_m + high.outer_radius_m + kImpactDistance_m + kRounding_m;
  return LengthSquared(start + travel * nearest) > room * room;
}

bool GoesThrough(const Pair& pair, const Moved& low, const Moved& high, std::span<const BodyMotion> motions) {
  if (pair.swept) return true;
  const double depth_m = kThroughShare * pair.inner_m;
  const bool may = !GaveNoWay(pair, low, high, depth_m);
  assert(may || !CameThroughEither(pair, low, high, depth_m, motions));
  return may && CameThroughEither(pair, low, high, depth_m, motions);
}

}  // namespace tessera::physics
