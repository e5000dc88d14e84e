#include "bench/solid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "bench/hull_faces.h"

namespace tessera::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void AddDirection(std::vector<Vec3d>& list, Vec3d direction) {
  const double length = Length(direction);
  if (length < 1e-12) return;
  direction = direction / length;
  const bool known =
      std::any_of(list.begin(), list.end(), [&](Vec3d other) { return std::abs(Dot(other, direction)) > 1 - 1e-10; });
  if (!known) list.push_back(direction);
}

Solid Polytope(const std::vector<Vec3f>& corners) {
  Solid solid;
  for (const Vec3f& corner : corners) solid.points.push_back(Vec3d(corner));
  for (const HullFace& face : FacesOf(corners)) {
    AddDirection(solid.normals, face.normal);
    const std::size_t n = face.corners.size();
    for (std::size_t i = 0; i < n; ++i) {
      AddDirection(solid.edges, solid.points[face.corners[(i + 1) % n]] - solid.points[face.corners[i]]);
      if (i >= 2) solid.triangles.push_back({face.corners[0], face.corners[i - 1], face.corners[i]});
    }
  }
  return solid;
}

// Rings of a round shape: radius and height of each; a radius of 0 is a tip.
Solid Turned(std::initializer_list<std::array<double, 2>> rings) {
  constexpr int kSides = 48;
  std::vector<Vec3f> points;
  for (const auto& [radius, height] : rings) {
    for (int i = 0; i < (radius > 0 ? kSides : 1); ++i) {
      const double angle = 2 * std::numbers::pi * i / kSides;
      points.push_back(Vec3f(Vec3d{radius * std::cos(angle), height, radius * std::sin(angle)}));
    }
  }
  return Polytope(points);
}

Solid Of(const BoxShape& box) {
  const Vec3d h = box.half_extents_m;
  Solid solid;
  for (int i = 0; i < 8; ++i) {
    solid.points.push_back({(i & 1) != 0 ? h.x : -h.x, (i & 2) != 0 ? h.y : -h.y, (i & 4) != 0 ? h.z : -h.z});
  }
  solid.normals = solid.edges = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::size_t quads[6][4] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};
  for (const auto& quad : quads) {
    solid.triangles.push_back({quad[0], quad[1], quad[2]});
    solid.triangles.push_back({quad[0], quad[2], quad[3]});
  }
  return solid;
}
Solid Of(const SphereShape& ball) {
  Solid solid;
  solid.points = {{}};
  solid.rounding_m = ball.radius_m;
  return solid;
}
Solid Of(const CapsuleShape& capsule) {
  Solid solid;
  solid.points = {{0, -capsule.half_height_m, 0}, {0, capsule.half_height_m, 0}};
  solid.edges = {{0, 1, 0}};
  solid.rounding_m = capsule.radius_m;
  return solid;
}
Solid Of(const CylinderShape& cylinder) {
  const double r = cylinder.radius_m, h = cylinder.half_height_m;
  return Turned({{r, -h}, {r, h}});
}
Solid Of(const ConeShape& cone) { return Turned({{cone.radius_m, -cone.height_m / 2}, {0, cone.height_m / 2}}); }
Solid Of(const ConvexHullShape& hull) { return Polytope(hull.points); }
Solid Of(const auto&) {
  assert(false && "no convex shape");
  return {};
}

struct Span {
  double low = kInfinity, high = -kInfinity;
};
Span Along(const Solid& solid, Vec3d axis) {
  Span span;
  for (const Vec3d& p : solid.points) {
    const double d = Dot(p, axis);
    span.low = std::min(span.low, d);
    span.high = std::max(span.high, d);
  }
  return span;
}

// Greatest gap between the two, roundings left out, over the axes that can separate them; stops at one beyond `enough`.
double Separation(const Solid& a, const Solid& b, double enough) {
  double best = -kInfinity;
  const auto beyond = [&](Vec3d axis) {
    const Span on_a = Along(a, axis), on_b = Along(b, axis);
    best = std::max({best, on_b.low - on_a.high, on_a.low - on_b.high});
    return best > enough;
  };
  for (const Vec3d& axis : a.normals)
    if (beyond(axis)) return best;
  for (const Vec3d& axis : b.normals)
    if (beyond(axis)) return best;
  for (const Vec3d& along_a : a.edges) {
    for (const Vec3d& along_b : b.edges) {
      const Vec3d axis = Cross(along_a, along_b);
      const double length = Length(axis);
      if (length > 1e-6 && beyond(axis / length)) return best;  // parallel edges: a face's normal does it
    }
  }
  return best;
}

double DistanceToTriangle(Vec3d p, Vec3d a, Vec3d b, Vec3d c) {
  // Inside the triangle's three sides it is that to its plane, else to the nearest side.
  const auto to_side = [p](Vec3d from, Vec3d to) {
    const Vec3d along = to - from;
    const double t = std::clamp(Dot(p - from, along) / LengthSquared(along), 0.0, 1.0);
    return Length(p - from - along * t);
  };
  const Vec3d normal = Normalized(Cross(b - a, c - a));
  const bool above = Dot(Cross(b - a, p - a), normal) >= 0 && Dot(Cross(c - b, p - b), normal) >= 0 &&
                     Dot(Cross(a - c, p - c), normal) >= 0;
  if (above) return std::abs(Dot(p - a, normal));
  return std::min({to_side(a, b), to_side(b, c), to_side(c, a)});
}

// Distance of a point outside to a solid without its rounding.
double DistanceTo(const Solid& solid, Vec3d p) {
  if (solid.points.size() == 1) return Length(p - solid.points[0]);
  if (solid.points.size() == 2) {
    const Vec3d along = solid.points[1] - solid.points[0];
    const double t = std::clamp(Dot(p - solid.points[0], along) / LengthSquared(along), 0.0, 1.0);
    return Length(p - solid.points[0] - along * t);
  }
  double nearest = kInfinity;
  for (const auto& [i, j, k] : solid.triangles) {
    nearest = std::min(nearest, DistanceToTriangle(p, solid.points[i], solid.points[j], solid.points[k]));
  }
  return nearest;
}

// From a point or line to a solid apart from it. Along a line the distance to a convex body has one valley, which the
// golden section finds.
double DistanceFromThin(const Solid& thin, const Solid& other) {
  if (thin.points.size() == 1) return DistanceTo(other, thin.points[0]);
  const Vec3d from = thin.points[0], along = thin.points[1] - thin.points[0];
  const auto at = [&](double t) { return DistanceTo(other, from + along * t); };
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kNarrowings = 60;  // the line's length shrinks to 3e-13 of itself
  double low = 0, high = 1, x = 1 - kGolden, y = kGolden, at_x = at(x), at_y = at(y);
  for (int i = 0; i < kNarrowings; ++i) {
    if (at_x < at_y) {
      high = y;
      y = x;
      at_y = at_x;
      x = high - kGolden * (high - low);
      at_x = at(x);
    } else {
      low = x;
      x = y;
      at_x = at_y;
      y = low + kGolden * (high - low);
      at_y = at(y);
    }
  }
  return std::min({at_x, at_y, at(0), at(1)});
}

}  // namespace

Solid SolidOf(const Shape& convex) {
  return std::visit([](const auto& form) { return Of(form); }, convex.form);
}

Solid PrismBelow(Vec3d a, Vec3d b, Vec3d c, double thickness_m) {
  Solid solid;
  const Vec3d normal = Normalized(Cross(b - a, c - a)), down = normal * -thickness_m;
  solid.points = {a, b, c, a + down, b + down, c + down};
  AddDirection(solid.normals, normal);
  for (const Vec3d& side : {b - a, c - b, a - c}) AddDirection(solid.normals, Cross(side, normal));
  for (const Vec3d& edge : {b - a, c - b, a - c, normal}) AddDirection(solid.edges, edge);
  solid.triangles = {{0, 1, 2}, {3, 5, 4}, {0, 3, 1}, {1, 3, 4}, {1, 4, 2}, {2, 4, 5}, {2, 5, 0}, {0, 5, 3}};
  return solid;
}

Solid Posed(const Solid& solid, const Pose& pose) {
  Solid posed = solid;
  for (Vec3d& point : posed.points) point = pose.position + Rotate(pose.orientation, point);
  for (Vec3d& normal : posed.normals) normal = Rotate(pose.orientation, normal);
  for (Vec3d& edge : posed.edges) edge = Rotate(pose.orientation, edge);
  return posed;
}

Aabb BoundsOf(const Solid& solid) {
  Aabb bounds{solid.points[0], solid.points[0]};
  for (const Vec3d& p : solid.points) bounds = bounds.United({p, p});
  return bounds.Expanded(solid.rounding_m);
}

double DepthBetween(const Solid& a, const Solid& b) {
  const double rounding = a.rounding_m + b.rounding_m;
  const double gap = Separation(a, b, rounding);
  const bool lines = a.thin() && b.thin();  // have no inside
  if (gap > rounding || (gap <= 0 && !lines) || (!a.thin() && !b.thin())) return rounding - gap;
  return rounding - (a.thin() ? DistanceFromThin(a, b) : DistanceFromThin(b, a));
}

double DepthInPlane(const Solid& solid, Vec3d normal, double offset_m) {
  return offset_m - Along(solid, normal).low + solid.rounding_m;
}

}  // namespace tessera::bench
