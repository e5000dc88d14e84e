#include "core/physics/collide/convex.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::physics {
namespace {

// Depth of a core below its surface: at most this, m, and this share of the largest ball inside.
constexpr float kInset_m = 0.02f, kInsetShare = 0.15f;

double ReachAround(const Geometry& g, Vec3d d) {
  const double across = std::sqrt(d.x * d.x + d.z * d.z);
  if (g.kind == GeometryKind::kCylinder) return std::abs(d.y) * g.half_height_m + across * g.radius_m;
  const double base = d.y * g.base_y_m + across * g.radius_m;
  return std::max(base, d.y * (static_cast<double>(g.base_y_m) + 2.0 * g.half_height_m));
}

double LocalReach(const Geometry& g, Vec3d d) {
  switch (g.kind) {
    case GeometryKind::kSphere:
      return Length(d) * g.radius_m;
    case GeometryKind::kCapsule:
      return std::abs(d.y) * g.half_height_m + Length(d) * g.radius_m;
    case GeometryKind::kBox:
      return std::abs(d.x) * g.half_extents_m.x + std::abs(d.y) * g.half_extents_m.y +
             std::abs(d.z) * g.half_extents_m.z;
    case GeometryKind::kCylinder:
    case GeometryKind::kCone:
      return ReachAround(g, d);
    default:
      break;
  }
  double reach = -std::numeric_limits<double>::infinity();
  for (const Vec3f& v : g.polyhedron->vertices) reach = std::max(reach, Dot(d, Vec3d(v)));
  return reach;
}

}  // namespace

Convex AtOrigin(const Geometry& geometry) {
  return {.geometry = &geometry, .triangle = {}, .position = {}, .rotation = {}};
}

Convex Placed(const Geometry& geometry, const LocalPose& pose) {
  return {.geometry = &geometry, .triangle = {}, .position = pose.position, .rotation = pose.rotation};
}

Convex TriangleAt(const std::array<Vec3f, 3>& corners) {
  return {.geometry = nullptr, .triangle = corners, .position = {}, .rotation = {}};
}

Vec3f MiddleOf(const Convex& convex) {
  if (convex.geometry == nullptr) return (convex.triangle[0] + convex.triangle[1] + convex.triangle[2]) / 3.0f;
  return convex.Out(convex.geometry->middle);
}

double ReachOf(const Convex& convex, Vec3f direction) {
  const Vec3d d(direction);
  if (convex.geometry == nullptr) {
    return std::max(
        {Dot(d, Vec3d(convex.triangle[0])), Dot(d, Vec3d(convex.triangle[1])), Dot(d, Vec3d(convex.triangle[2]))});
  }
  const Mat3f& r = convex.rotation;
  const Vec3d local{Dot(Vec3d(r.x), d), Dot(Vec3d(r.y), d), Dot(Vec3d(r.z), d)};
  return Dot(d, Vec3d(convex.position)) + LocalReach(*convex.geometry, local);
}

float InsetOf(const Convex& convex) {
  if (convex.geometry == nullptr || convex.geometry->kind <= GeometryKind::kCapsule) return 0;
  return std::min(kInset_m, kInsetShare * convex.geometry->middle_radius_m);
}

Core::Core(const Convex& convex, double inset)
    : x_(convex.rotation.x), y_(convex.rotation.y), z_(convex.rotation.z), position_(convex.position) {
  if (convex.geometry == nullptr) {
    form_ = Form::kPoints;
    triangle_ = convex.triangle;
    return;
  }
  const Geometry& g = *convex.geometry;
  switch (g.kind) {
    case GeometryKind::kSphere:
      radius_ = g.radius_m;
      return;
    case GeometryKind::kCapsule:
      form_ = Form::kSegment;
      half_.y = g.half_height_m;
      radius_ = g.radius_m;
      return;
    case GeometryKind::kBox:
      form_ = Form::kBox;
      half_ = Vec3d(g.half_extents_m) - Vec3d{inset, inset, inset};
      return;
    case GeometryKind::kCylinder:
      form_ = Form::kCylinder;
      half_.y = g.half_height_m - inset;
      round_ = g.radius_m - inset;
      return;
    case GeometryKind::kCone: {
      // Inset by m, the side moves down its axis by m / sin(half angle).
      const double height = 2.0 * g.half_height_m, radius = g.radius_m;
      form_ = Form::kCone;
      base_y_ = g.base_y_m + inset;
      apex_y_ = g.base_y_m + height - inset * std::sqrt(radius * radius + height * height) / radius;
      round_ = radius * (apex_y_ - base_y_) / height;
      return;
    }
    default:
      form_ = Form::kPoints;
      points_ = g.polyhedron->vertices.data();
      count_ = g.polyhedron->vertices.size();
      scale_ = inset > 0 ? 1 - inset / static_cast<double>(g.middle_radius_m) : 1;
      middle_ = Vec3d(g.middle) * (1 - scale_);
  }
}

Vec3d Core::LocalSupport(Vec3d d) const {
  switch (form_) {
    case Form::kPoint:
      return {};
    case Form::kSegment:
      return {0, d.y >= 0 ? half_.y : -half_.y, 0};
    case Form::kBox:
      return {d.x >= 0 ? half_.x : -half_.x, d.y >= 0 ? half_.y : -half_.y, d.z >= 0 ? half_.z : -half_.z};
    case Form::kCylinder:
    case Form::kCone: {
      const double across = std::sqrt(d.x * d.x + d.z * d.z);
      const double scale = across > 0 ? round_ / across : 0;
      const Vec3d rim{across > 0 ? d.x * scale : round_, 0, d.z * scale};
      if (form_ == Form::kCylinder) return {rim.x, d.y >= 0 ? half_.y : -half_.y, rim.z};
      if (d.y * apex_y_ > d.y * base_y_ + across * round_) return {0, apex_y_, 0};
      return {rim.x, base_y_, rim.z};
    }
    case Form::kPoints:
      break;
  }
  std::size_t best = 0;
  double reach = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < count_; ++i) {
    const double along = Dot(d, Vec3d(points_[i]));
    if (along > reach) reach = along, best = i;
  }
  return Vec3d(points_[best]) * scale_ + middle_;
}

Vec3d Core::Support(Vec3d d) const {
  if (form_ == Form::kPoint) return position_;
  if (form_ == Form::kPoints && points_ == nullptr) {
    const double a = Dot(d, Vec3d(triangle_[0])), b = Dot(d, Vec3d(triangle_[1])), c = Dot(d, Vec3d(triangle_[2]));
    return Vec3d(triangle_[a >= b && a >= c ? 0 : b >= c ? 1 : 2]);
  }
  const Vec3d local = LocalSupport({Dot(x_, d), Dot(y_, d), Dot(z_, d)});
  return position_ + x_ * local.x + y_ * local.y + z_ * local.z;
}

}  // namespace tessera::physics
