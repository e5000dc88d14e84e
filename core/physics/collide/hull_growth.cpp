#include "core/physics/collide/hull_growth.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace tessera::physics {
namespace {

using Index = std::uint32_t;

class HullGrower {
 public:
  HullGrower(GrownHull& hull, double rounding) : hull_(hull), rounding_(rounding), outside_(hull.given.size()) {}

  void Grow() {
    if (!Start()) return;
    // The furthest point first: so there are few thin triangles, whose normals are rounding.
    for (Index next = Furthest(); outside_[next].height > rounding_; next = Furthest()) Add(next);
    std::erase_if(hull_.triangles, [](const HullTriangle& t) { return !t.alive; });
  }

 private:
  // How far a point lies outside the hull so far.
  struct OutsidePoint {
    std::size_t triangle = 0;  // that it is furthest above
    double height = 0;
  };

  HullTriangle TriangleOf(Index a, Index b, Index c) const {
    const std::vector<Vec3d>& p = hull_.points;
    HullTriangle t{.v = {a, b, c}, .normal = {}, .offset = 0, .alive = true};
    t.normal = Normalized(Cross(p[b] - p[a], p[c] - p[a]));
    t.offset = Dot(t.normal, p[a]);
    return t;
  }

  // Starts from the four points that span the most: two furthest apart, the one furthest from their line, the one
  // furthest from their plane. In the hull's own coordinates they are the corners of the unit simplex.
  bool Start() {
    const std::vector<Vec3d>& given = hull_.given;
    const auto furthest = [&](auto&& measure) {
      Index best = 0;
      for (Index i = 1; i < given.size(); ++i)
        if (measure(given[i]) > measure(given[best])) best = i;
      return best;
    };
    std::array<Index, 4> f{};
    f[0] = furthest([&](Vec3d p) { return LengthSquared(p - given[0]); });
    const Vec3d origin = given[f[0]];
    f[1] = furthest([&](Vec3d p) { return LengthSquared(p - origin); });
    const Vec3d line = Normalized(given[f[1]] - origin);
    f[2] = furthest([&](Vec3d p) { return LengthSquared(Cross(line, p - origin)); });
    const Vec3d plane = Normalized(Cross(line, given[f[2]] - origin));
    f[3] = furthest([&](Vec3d p) { return std::abs(Dot(plane, p - origin)); });
    if (Dot(plane, given[f[3]] - origin) < 0) std::swap(f[1], f[2]);
    const Vec3d u = given[f[1]] - origin, v = given[f[2]] - origin, w = given[f[3]] - origin;
    const double volume = Dot(u, Cross(v, w));
    if (!(volume > 0)) return false;
    for (const Vec3d& p : given) {
      const Vec3d q = p - origin;
      hull_.points.push_back(Vec3d{Dot(q, Cross(v, w)), Dot(q, Cross(w, u)), Dot(q, Cross(u, v))} / volume);
    }
    hull_.triangles = {TriangleOf(f[0], f[2], f[1]), TriangleOf(f[0], f[1], f[3]), TriangleOf(f[1], f[2], f[3]),
                       TriangleOf(f[2], f[0], f[3])};
    for (Index i = 0; i < hull_.points.size(); ++i) Place(i);
    return true;
  }

  double HeightOver(const HullTriangle& t, Index point) const { return Dot(t.normal, hull_.points[point]) - t.offset; }

  // Finds the triangle that a point is furthest above.
  void Place(Index point) {
    OutsidePoint& place = outside_[point];
    place = {};
    for (std::size_t i = 0; i < hull_.triangles.size(); ++i) {
      const double height = hull_.triangles[i].alive ? HeightOver(hull_.triangles[i], point) : 0;
      if (height > place.height) place = {i, height};
    }
  }

  Index Furthest() const {
    const auto lower = [](const OutsidePoint& x, const OutsidePoint& y) { return x.height < y.height; };
    return static_cast<Index>(std::max_element(outside_.begin(), outside_.end(), lower) - outside_.begin());
  }

  // Takes away the triangles that the point sees and closes the hole with triangles to it.
  void Add(Index point) {
    std::map<std::pair<Index, Index>, bool> seen;  // directed edges of the triangles that go
    for (HullTriangle& t : hull_.triangles) {
      if (!t.alive || HeightOver(t, point) <= rounding_) continue;
      t.alive = false;
      for (std::size_t k = 0; k < 3; ++k) seen[{t.v[k], t.v[(k + 1) % 3]}] = true;
    }
    for (const auto& [edge, unused] : seen) {
      if (!seen.contains({edge.second, edge.first})) {
        hull_.triangles.push_back(TriangleOf(edge.first, edge.second, point));
      }
    }
    outside_[point] = {};
    for (Index i = 0; i < hull_.points.size(); ++i) {
      if (outside_[i].height > rounding_ && !hull_.triangles[outside_[i].triangle].alive) Place(i);
    }
  }

  GrownHull& hull_;
  double rounding_;
  std::vector<OutsidePoint> outside_;  // by point
};

}  // namespace

GrownHull GrowHull(std::span<const Vec3f> points, double rounding) {
  GrownHull hull;
  for (const Vec3f& p : points) hull.given.push_back(Vec3d(p));
  HullGrower(hull, rounding).Grow();
  return hull;
}

}  // namespace tessera::physics
