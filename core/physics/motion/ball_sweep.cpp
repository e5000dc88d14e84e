#include "core/physics/motion/ball_sweep.h"

#include <cmath>

namespace tessera::physics {
namespace {

// The distance falls from `distance_m` at a constant rate.
std::optional<Impact> MeetPlane(const SweptPair& pair, double target_m, double slack_m) {
  const Geometry& plane = pair.geometry_a;
  const Vec3d normal = Rotate(pair.a.from, Vec3d(plane.plane_normal));
  const double distance_m =
      Dot(normal, pair.start) - static_cast<double>(plane.plane_offset_m) - pair.geometry_b.radius_m;
  const double approach = -Dot(normal, pair.travel), spare = distance_m > target_m ? distance_m - target_m : slack_m;
  // Else it stays away, or grazes.
  if (!(approach > spare + slack_m)) return {};
  return Impact{spare / approach, Vec3f(normal)};
}

// The centres are at start + t travel from each other: their distance is `reach` at the earlier root of a square.
std::optional<Impact> MeetBall(const SweptPair& pair, double target_m, double slack_m) {
  const double between = Length(pair.start), radii = double{pair.geometry_a.radius_m} + pair.geometry_b.radius_m;
  const double reach = between > radii + target_m ? radii + target_m : between - slack_m;
  if (!(reach > 0)) return {};
  const double square = LengthSquared(pair.travel), slope = Dot(pair.start, pair.travel);
  const double spare = between * between - reach * reach, under = slope * slope - square * spare;
  if (!(slope < 0) || under < 0) return {};
  const double fraction = spare / (std::sqrt(under) - slope);
  if (!(fraction < 1)) return {};
  const Vec3d normal = Normalized(pair.ToB(fraction));
  if (Dot(normal, pair.ToB(1)) >= reach - slack_m) return {};
  return Impact{fraction, Vec3f(normal)};
}

}  // namespace

bool IsBallSweep(const SweptPair& pair) {
  const GeometryKind first = pair.geometry_a.kind;
  return pair.geometry_b.kind == GeometryKind::kSphere &&
         (first == GeometryKind::kSphere || first == GeometryKind::kPlane);
}

std::optional<Impact> FirstImpactOfBall(const SweptPair& pair, double target_m, double slack_m) {
  return pair.geometry_a.kind == GeometryKind::kPlane ? MeetPlane(pair, target_m, slack_m)
                                                      : MeetBall(pair, target_m, slack_m);
}

}  // namespace tessera::physics
