#include "bench/hull_faces.h"

#include <algorithm>
#include <cmath>

namespace tessera::bench {
namespace {

// Sorts the face's points by their angle about its middle.
void Wind(HullFace& face, std::span<const Vec3f> points) {
  Vec3d middle;
  for (const std::size_t i : face.corners) middle += Vec3d(points[i]) / static_cast<double>(face.corners.size());
  const Vec3d x = Normalized(Vec3d(points[face.corners[0]]) - middle), y = Cross(face.normal, x);
  const auto angle = [&](std::size_t i) {
    const Vec3d r = Vec3d(points[i]) - middle;
    return std::atan2(Dot(r, y), Dot(r, x));
  };
  std::sort(face.corners.begin(), face.corners.end(),
            [&](std::size_t a, std::size_t b) { return angle(a) < angle(b); });
}

}  // namespace

std::vector<HullFace> FacesOf(std::span<const Vec3f> points) {
  Vec3d low = Vec3d(points[0]), high = low;
  for (const Vec3f& p : points) {
    low = {std::min<double>(low.x, p.x), std::min<double>(low.y, p.y), std::min<double>(low.z, p.z)};
    high = {std::max<double>(high.x, p.x), std::max<double>(high.y, p.y), std::max<double>(high.z, p.z)};
  }
  const double size = Length(high - low);
  const double flat = 1e-6 * size;  // floats of this size know no better
  std::vector<HullFace> faces;
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (std::size_t k = j + 1; k < n; ++k) {
        const Vec3d a = Vec3d(points[i]);
        const Vec3d cross = Cross(Vec3d(points[j]) - a, Vec3d(points[k]) - a);
        if (Length(cross) < flat * size) continue;
        HullFace face{.normal = Normalized(cross), .offset_m = 0, .corners = {}};
        double above = 0, below = 0;
        for (const Vec3f& p : points) {
          const double d = Dot(face.normal, Vec3d(p) - a);
          above = std::max(above, d);
          below = std::max(below, -d);
        }
        if (above > flat && below > flat) continue;
        if (above > flat) face.normal = -face.normal;
        face.offset_m = Dot(face.normal, a);
        const bool known = std::any_of(faces.begin(), faces.end(), [&](const HullFace& other) {
          return Dot(other.normal, face.normal) > 1 - 1e-8 && std::abs(other.offset_m - face.offset_m) < 2 * flat;
        });
        if (known) continue;
        for (std::size_t p = 0; p < n; ++p) {
          if (std::abs(Dot(face.normal, Vec3d(points[p])) - face.offset_m) <= flat) face.corners.push_back(p);
        }
        Wind(face, points);
        faces.push_back(std::move(face));
      }
    }
  }
  return faces;
}

}  // namespace tessera::bench
