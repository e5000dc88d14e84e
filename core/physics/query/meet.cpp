#include "core/physics/query/meet.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/physics/query/tuning.h"
#include "core/physics/query/way.h"

namespace tessera::physics {
namespace {

// One query against one body, in the body's frame.
class BodyMeeting {
 public:
  BodyMeeting(Quatd frame, const LocalRay& ray, const Probe* probe, WorkMeter& meter) : ray_(ray), meter_(meter) {
    if (probe != nullptr) probe_ = probe->In(frame);
  }

  std::optional<SurfaceHit> With(const Geometry& geometry) {
    switch (geometry.kind) {
      case GeometryKind::kCompound:
        return WithCompound(geometry);
      case GeometryKind::kMesh:
      case GeometryKind::kHeightField:
        return WithSurface(*geometry.surface);
      case GeometryKind::kPlane:
        if (!meter_.Spend(kPartWork)) return {};
        return probe_ ? CastAtPlane(geometry, *probe_, ray_) : HitPlane(geometry, ray_);
      default:
        return WithConvex(geometry, {}, {});
    }
  }

 private:
  // `rotation` and `position` place the shape in the body's frame.
  std::optional<SurfaceHit> WithConvex(const Geometry& convex, const Mat3f& rotation, Vec3f position) {
    if (probe_) {
      const double size = convex.outer_radius_m + static_cast<double>(Length(position));
      return Cast({.geometry = &convex, .triangle = {}, .position = position, .rotation = rotation}, size);
    }
    if (!meter_.Spend(kPartWork)) return {};
    const Vec3d x(rotation.x), y(rotation.y), z(rotation.z);
    const auto into = [&](Vec3d v) { return Vec3d{Dot(x, v), Dot(y, v), Dot(z, v)}; };
    std::optional<SurfaceHit> hit = HitConvex(convex, {into(ray_.from - Vec3d(position)), into(ray_.along)});
    if (!hit) return {};
    hit->point = ray_.At(hit->fraction);
    hit->normal = x * hit->normal.x + y * hit->normal.y + z * hit->normal.z;
    return hit;
  }

  std::optional<SurfaceHit> Cast(const Convex& target, double size_m) {
    int steps = 0;
    const std::optional<SurfaceHit> hit = CastAtConvex(target, size_m, *probe_, ray_, &steps);
    if (!meter_.Spend(kPartWork + kCastStepWork * static_cast<std::uint64_t>(steps))) return {};
    return hit;
  }

  std::optional<SurfaceHit> WithCompound(const Geometry& compound) {
    std::optional<SurfaceHit> first;
    for (const Geometry::Child& child : compound.children) {
      const std::optional<SurfaceHit> hit = WithConvex(*child.geometry, child.rotation, child.position);
      if (hit && (!first || hit->fraction < first->fraction)) first = hit;
      if (meter_.exhausted()) return {};
    }
    return first;
  }

  // The triangles along the way are looked for piece by piece, since the bounds of a long way hold far too many.
  std::optional<SurfaceHit> WithSurface(const Surface& surface) {
    const Vec3d half = probe_ ? probe_->half_m : Vec3d();
    const Bounds& bounds = surface.bounds();
    const Way way{ray_.from, ray_.along};
    const std::optional<WayPart> inside = way.PartIn({Vec3d(bounds.min) - half, Vec3d(bounds.max) + half});
    if (!inside) return {};
    const double length = Length(ray_.along) * (inside->end - inside->begin);
    const double wanted = std::ceil(length / std::max(surface.PieceLength(), Length(half)));
    const int pieces = static_cast<int>(std::clamp(wanted, 1.0, double{kMostSurfacePieces}));
    const double step = (inside->end - inside->begin) / pieces;
    std::optional<SurfaceHit> first;
    for (int i = 0; i < pieces; ++i) {
      const double begin = inside->begin + step * i, end = i + 1 == pieces ? inside->end : begin + step;
      const Vec3d a = ray_.At(begin), b = ray_.At(end);
      const Aabb box = Aabb{a, a}.United({b, b});
      triangles_.clear();
      // One more than can be paid for exhausts the meter.
      surface.TrianglesIn({box.min - half, box.max + half}, &triangles_, meter_.left() / kTriangleWork);
      if (!meter_.Spend(kPieceWork + kTriangleWork * triangles_.size())) return {};
      for (const std::uint32_t triangle : triangles_) {
        const std::optional<SurfaceHit> hit = WithTriangle(surface, triangle);
        if (meter_.exhausted()) return {};
        if (hit && (!first || hit->fraction < first->fraction)) first = hit;
        if (first && first->fraction == 0) return first;
      }
      if (first && first->fraction <= end) break;
    }
    return first;
  }

  std::optional<SurfaceHit> WithTriangle(const Surface& surface, std::uint32_t triangle) {
    if (!probe_) return HitTriangle(surface.Corners(triangle), ray_);
    const std::array<Vec3f, 3> corners = surface.RoundedCorners(triangle);
    double size = 0;
    for (const Vec3f& corner : corners) size = std::max(size, Length(Vec3d(corner)));
    return Cast(TriangleAt(corners), size);
  }

  const LocalRay& ray_;
  WorkMeter& meter_;
  std::optional<Probe::Turned> probe_;
  std::vector<std::uint32_t> triangles_;
};

}  // namespace

std::optional<SurfaceHit> Meet(const Geometry& geometry, Quatd frame, const LocalRay& ray, const Probe* probe,
                               WorkMeter& meter) {
  return BodyMeeting(frame, ray, probe, meter).With(geometry);
}

}  // namespace tessera::physics
