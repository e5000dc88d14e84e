#include "core/world/shape_checks.h"

#include <algorithm>
#include <cmath>

#include "core/world/limits.h"

namespace tessera {
namespace {

// A hull thinner than this share of its furthest coordinate is flat in float coordinates.
constexpr double kFlat = 1e-5;

}  // namespace

double ThicknessOf(const std::vector<Vec3f>& points) {
  const auto furthest = [&](auto measure) {
    return Vec3d(*std::ranges::max_element(points, {}, [&](Vec3f p) { return measure(Vec3d(p)); }));
  };
  const Vec3d a(points.front());
  const Vec3d b = furthest([&](Vec3d p) { return LengthSquared(p - a); });
  const Vec3d along = Normalized(b - a);
  const auto from_line = [&](Vec3d p) { return Cross(along, p - a); };
  const Vec3d c = furthest([&](Vec3d p) { return LengthSquared(from_line(p)); });
  if (LengthSquared(from_line(c)) == 0) return 0;
  const Vec3d up = Normalized(from_line(c));
  const auto height = [&](Vec3d p) { return std::abs(Dot(up, p - a)); };
  return height(furthest(height));
}

double LeastThicknessOf(const std::vector<Vec3f>& points) {
  double furthest = 0;
  for (const Vec3f& p : points) {
    furthest = std::max({furthest, std::abs(double{p.x}), std::abs(double{p.y}), std::abs(double{p.z})});
  }
  return std::max(kMinExtent_m, kFlat * furthest);
}

}  // namespace tessera
