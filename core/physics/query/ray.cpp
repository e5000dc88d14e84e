#include "core/physics/query/ray.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::physics {
namespace {

// A ray through the edge between two triangles must not pass between them: this much outside of a triangle, as a share
// of its area, still counts as in it.
constexpr double kEdgeSlack = 1e-9;

// The part of a ray's whole line that lies in all of the convex sets that it was clipped to.
class Clipped {
 public:
  explicit Clipped(const LocalRay& ray) : ray_(ray) {}

  bool empty() const { return in_ > out_; }
  double in() const { return in_; }
  double out() const { return out_; }
  Vec3d normal() const { return normal_; }

  // dot(normal, p) <= offset.
  void ToHalfSpace(Vec3d normal, double offset) {
    const double height = Dot(normal, ray_.from) - offset, slope = Dot(normal, ray_.along);
    if (slope < 0) {
      EnterAt(-height / slope, normal);
    } else if (slope > 0) {
      LeaveAt(-height / slope);
    } else if (height > 0) {
      Empty();
    }
  }
  void ToSphere(Vec3d center, double radius) {
    Round(ray_.from - center, ray_.along, radius, [&](Vec3d at) { return at; });
  }
  // Around y.
  void ToCylinder(double radius) {
    const Vec3d from{ray_.from.x, 0, ray_.from.z}, along{ray_.along.x, 0, ray_.along.z};
    Round(from, along, radius, [](Vec3d at) { return at; });
  }
  // The solid cone below its apex on y: hypot(x, z) <= slope * (apex - y). The ray is clipped to y <= apex already, so
  // that one half of the double cone, which is convex, is left.
  void ToCone(double apex, double slope) {
    const double k = slope * slope, down = apex - ray_.from.y, dy = ray_.along.y;
    const Vec3d p = ray_.from, d = ray_.along;
    const double a = d.x * d.x + d.z * d.z - k * dy * dy, b = p.x * d.x + p.z * d.z + k * down * dy;
    const double c = p.x * p.x + p.z * p.z - k * down * down;  // a t^2 + 2 b t + c <= 0 inside
    const auto normal = [&](double t) {
      const Vec3d at = ray_.At(t);
      return Normalized(Vec3d{at.x, k * (apex - at.y), at.z});
    };
    if (a == 0) {
      if (b > 0) return LeaveAt(-c / (2 * b));
      if (b < 0) return EnterAt(-c / (2 * b), normal(-c / (2 * b)));
      return c > 0 ? Empty() : void();
    }
    const double square = b * b - a * c;
    if (square < 0) return a > 0 ? Empty() : void();
    const double root = b > 0 ? -b - std::sqrt(square) : -b + std::sqrt(square);  // the one without cancellation
    const double one = root / a, other = root == 0 ? one : c / root;
    const double low = std::min(one, other), high = std::max(one, other);
    if (a > 0) {
      EnterAt(low, normal(low));
      LeaveAt(high);
    } else if (dy < 0) {  // steeper than the side: the lower half is entered at the later root
      EnterAt(high, normal(high));
    } else {
      LeaveAt(low);
    }
  }

 private:
  void Empty() {
    in_ = std::numeric_limits<double>::infinity();
    out_ = -in_;
  }
  void EnterAt(double t, Vec3d normal) {
    if (t > in_) in_ = t, normal_ = normal;
  }
  void LeaveAt(double t) { out_ = std::min(out_, t); }
  // |from + along t| <= radius. It is reckoned from the nearest point, so that a far beginning costs no digits.
  template <class Normal>
  void Round(Vec3d from, Vec3d along, double radius, const Normal& normal) {
    const double square = LengthSquared(along);
    if (square == 0) return LengthSquared(from) > radius * radius ? Empty() : void();
    const double middle = -Dot(from, along) / square;
    const double room = radius * radius - LengthSquared(from + along * middle);
    if (room < 0) return Empty();
    const double half = std::sqrt(room / square);
    EnterAt(middle - half, Normalized(normal(from + along * (middle - half))));
    LeaveAt(middle + half);
  }

  const LocalRay& ray_;
  double in_ = -std::numeric_limits<double>::infinity(), out_ = std::numeric_limits<double>::infinity();
  Vec3d normal_;
};

std::optional<SurfaceHit> Hit(const LocalRay& ray, double in, double out, Vec3d normal) {
  if (in > out || in > 1 || out <= 0) return {};
  if (in < 0) return SurfaceHit{0, ray.from, ray.Back()};
  return SurfaceHit{in, ray.At(in), normal};
}

std::optional<SurfaceHit> Hit(const LocalRay& ray, const Clipped& clipped) {
  return Hit(ray, clipped.in(), clipped.out(), clipped.normal());
}

void ClipToSlab(Clipped& clipped, Vec3d axis, double half) {
  clipped.ToHalfSpace(axis, half);
  clipped.ToHalfSpace(-axis, half);
}

// A capsule is the union of a cylinder and two balls; the ray is in it from the first of them to the last.
std::optional<SurfaceHit> HitCapsule(const Geometry& capsule, const LocalRay& ray) {
  const double radius = capsule.radius_m, half = capsule.half_height_m;
  Clipped upper(ray), lower(ray), between(ray);
  upper.ToSphere({0, half, 0}, radius);
  lower.ToSphere({0, -half, 0}, radius);
  ClipToSlab(between, {0, 1, 0}, half);
  between.ToCylinder(radius);
  const Clipped* first = nullptr;
  double out = -std::numeric_limits<double>::infinity();
  for (const Clipped* part : {&upper, &lower, &between}) {
    if (part->empty()) continue;
    if (first == nullptr || part->in() < first->in()) first = part;
    out = std::max(out, part->out());
  }
  if (first == nullptr) return {};
  return Hit(ray, first->in(), out, first->normal());
}

}  // namespace

std::optional<SurfaceHit> HitConvex(const Geometry& convex, const LocalRay& ray) {
  Clipped clipped(ray);
  switch (convex.kind) {
    case GeometryKind::kSphere:
      clipped.ToSphere({}, convex.radius_m);
      break;
    case GeometryKind::kCapsule:
      return HitCapsule(convex, ray);
    case GeometryKind::kBox:
      ClipToSlab(clipped, {1, 0, 0}, convex.half_extents_m.x);
      ClipToSlab(clipped, {0, 1, 0}, convex.half_extents_m.y);
      ClipToSlab(clipped, {0, 0, 1}, convex.half_extents_m.z);
      break;
    case GeometryKind::kCylinder:
      ClipToSlab(clipped, {0, 1, 0}, convex.half_height_m);
      clipped.ToCylinder(convex.radius_m);
      break;
    case GeometryKind::kCone: {
      const double base = convex.base_y_m, height = 2.0 * convex.half_height_m;
      clipped.ToHalfSpace({0, -1, 0}, -base);
      clipped.ToHalfSpace({0, 1, 0}, base + height);
      clipped.ToCone(base + height, convex.radius_m / height);
      break;
    }
    default:
      for (const Polyhedron::Face& face : convex.polyhedron->faces) {
        clipped.ToHalfSpace(Vec3d(face.normal), face.offset_m);
      }
  }
  return Hit(ray, clipped);
}

std::optional<SurfaceHit> HitPlane(const Geometry& plane, const LocalRay& ray) {
  Clipped clipped(ray);
  clipped.ToHalfSpace(Vec3d(plane.plane_normal), plane.plane_offset_m);
  return Hit(ray, clipped);
}

// Moeller and Trumbore 1997.
std::optional<SurfaceHit> HitTriangle(const std::array<Vec3d, 3>& corners, const LocalRay& ray) {
  const Vec3d ab = corners[1] - corners[0], ac = corners[2] - corners[0], across = Cross(ray.along, ac);
  const double volume = Dot(ab, across);
  if (volume == 0) return {};
  const Vec3d to = ray.from - corners[0];
  const double u = Dot(to, across) / volume;
  const Vec3d beside = Cross(to, ab);
  const double v = Dot(ray.along, beside) / volume;
  if (!(u >= -kEdgeSlack && v >= -kEdgeSlack && u + v <= 1 + kEdgeSlack)) return {};
  const double t = Dot(ac, beside) / volume;
  if (!(t >= 0 && t <= 1)) return {};
  const Vec3d normal = Normalized(Cross(ab, ac));
  return SurfaceHit{t, ray.At(t), volume > 0 ? normal : -normal};
}

}  // namespace tessera::physics
