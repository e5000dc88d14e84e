#include "core/physics/motion/sweep_parts.h"

#include <algorithm>
#include <cmath>

namespace tessera::physics {
namespace {

Turning TurningOf(const SweptMotion& motion) { return {motion.orientation, motion.turned_rad}; }

// Distance from a shape's own origin to the farthest point of its core, without rounding.
double ReachOfCore(const Geometry& g) {
  switch (g.kind) {
    case GeometryKind::kSphere:
      return 0;
    case GeometryKind::kCapsule:
      return g.half_height_m;
    case GeometryKind::kBox:
      return Length(Vec3d(g.half_extents_m));
    case GeometryKind::kCylinder:
      return std::hypot(g.half_height_m, g.radius_m);
    default:
      return g.outer_radius_m;
  }
}

// A child of a compound, or the whole of a convex shape.
Part ChildOf(const Geometry& geometry, std::size_t index) {
  if (geometry.kind != GeometryKind::kCompound) return Part(AtOrigin(geometry));
  const Geometry::Child& child = geometry.children[index];
  return Part(
      {.geometry = child.geometry.get(), .triangle = {}, .position = child.position, .rotation = child.rotation});
}
std::size_t ChildrenOf(const Geometry& geometry) {
  return geometry.kind == GeometryKind::kCompound ? geometry.children.size() : 1;
}

// How far the middle of a part may leave its straight line because its body turns, m.
double Strays(const Part& part, const Turning& turning) {
  return std::min(2.0, Length(turning.turn)) * Length(part.middle);
}

bool MayMeet(const Part& a, const Part& b, const SweptPair& pair, double target_m) {
  const Vec3d from = pair.start + Rotate(pair.b.from, b.middle) - Rotate(pair.a.from, a.middle);
  const double all = LengthSquared(pair.travel);
  const double nearest = all > 0 ? std::clamp(-Dot(from, pair.travel) / all, 0.0, 1.0) : 0;
  const double room = a.size_m + b.size_m + target_m + Strays(a, pair.a) + Strays(b, pair.b);
  return LengthSquared(from + pair.travel * nearest) <= room * room * (1 + 1e-9);
}

// Whether b stays above, or below, the plane of a flat triangle for the whole step.
bool StaysOnOneSide(const Part& triangle, const Part& b, const SweptPair& pair, double target_m) {
  const auto& c = triangle.convex.triangle;
  const Vec3d corner(c[0]), cross = Cross(Vec3d(c[1]) - corner, Vec3d(c[2]) - corner);
  const Quatd into_a = Conjugate(pair.a.from);
  const double from = Dot(cross, Rotate(into_a, pair.start + Rotate(pair.b.from, b.middle)) - corner);
  const double to = from + Dot(cross, Rotate(into_a, pair.travel));
  const double room = (b.size_m + Strays(b, pair.b) + target_m) * (1 + 1e-9) * Length(cross);
  return (from > room && to > room) || (from < -room && to < -room);
}

// Bounds of everything that `part` of b sweeps over, in the frame of a, which stays.
Aabb SweptInA(const Part& part, const SweptPair& pair, double target_m) {
  const Quatd into_a = Conjugate(pair.a.from);
  const Vec3d from = Rotate(into_a, pair.start + Rotate(pair.b.from, part.middle));
  const Vec3d to = from + Rotate(into_a, pair.travel);
  const double around = part.size_m + Strays(part, pair.b) + target_m;
  const Vec3d room{around, around, around};
  return {Vec3d{std::min(from.x, to.x), std::min(from.y, to.y), std::min(from.z, to.z)} - room,
          Vec3d{std::max(from.x, to.x), std::max(from.y, to.y), std::max(from.z, to.z)} + room};
}

void ForTriangles(const Surface& surface, const Aabb& swept, const std::function<void(const Part&)>& each) {
  thread_local std::vector<std::uint32_t> found;
  found.clear();
  surface.TrianglesIn(swept, &found);
  for (const std::uint32_t triangle : found) each(Part(TriangleAt(surface.RoundedCorners(triangle))));
}

}  // namespace

SweptPair::SweptPair(const SweptMotion& motion_a, const SweptMotion& motion_b)
    : geometry_a(motion_a.geometry),
      geometry_b(motion_b.geometry),
      a(TurningOf(motion_a)),
      b(TurningOf(motion_b)),
      start(motion_b.from - motion_a.from),
      travel((motion_b.to - motion_b.from) - (motion_a.to - motion_a.from)) {}

Part::Part(const Convex& in_body) : convex(in_body), core(in_body, 0), placed(core) {
  if (convex.geometry == nullptr) {
    middle = Vec3d(MiddleOf(convex));
    for (const Vec3f& corner : convex.triangle) {
      size_m = std::max(size_m, Length(Vec3d(corner) - middle));
      reach_m = std::max(reach_m, Length(Vec3d(corner)));
    }
    return;
  }
  middle = Vec3d(convex.position);
  size_m = convex.geometry->outer_radius_m;
  reach_m = Length(middle) + ReachOfCore(*convex.geometry);
}

Part::Part(const Geometry& geometry, const Turning& turning)
    : core(convex, 0),
      placed(core),
      plane(true),
      plane_normal(Rotate(turning.from, Vec3d(geometry.plane_normal))),
      plane_offset_m(geometry.plane_offset_m) {}

void Part::PlaceIn(Vec3d position, Quatd orientation) {
  const Mat3f& r = convex.rotation;
  placed.Place(position + Rotate(orientation, Vec3d(convex.position)),
               {Rotate(orientation, Vec3d(r.x)), Rotate(orientation, Vec3d(r.y)), Rotate(orientation, Vec3d(r.z))});
}

double Part::Shrink() {
  const double inset = plane ? 0 : InsetOf(convex);
  core = placed = Core(convex, inset);
  return inset;
}

bool HasNoParts(const Geometry& geometry) { return geometry.kind > GeometryKind::kCompound; }

void ForPartsThatMayMeet(const SweptPair& pair, double target_m,
                         const std::function<void(const Part&, const Part&)>& test) {
  for (std::size_t j = 0; j < ChildrenOf(pair.geometry_b); ++j) {
    const Part b = ChildOf(pair.geometry_b, j);
    if (pair.geometry_a.kind == GeometryKind::kPlane) {
      test(Part(pair.geometry_a, pair.a), b);
    } else if (HasNoParts(pair.geometry_a)) {
      ForTriangles(*pair.geometry_a.surface, SweptInA(b, pair, target_m), [&](const Part& triangle) {
        if (MayMeet(triangle, b, pair, target_m) && !StaysOnOneSide(triangle, b, pair, target_m)) test(triangle, b);
      });
    } else {
      for (std::size_t i = 0; i < ChildrenOf(pair.geometry_a); ++i) {
        const Part a = ChildOf(pair.geometry_a, i);
        if (MayMeet(a, b, pair, target_m)) test(a, b);
      }
    }
  }
}

}  // namespace tessera::physics
