#include "core/physics/motion/sweep_parts.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <algorithm>
#include <cmath>

#include "core/physics/bullet_math.h"

namespace tessera::physics {
namespace {

Turning TurningOf(const Way& way) { return {way.orientation, way.turned_rad}; }

// From its own origin to the farthest point of its core, without rounding.
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

// A child of a compound, or the whole of what is convex.
Part ChildOf(const Geometry& geometry, std::size_t index) {
  if (geometry.kind != GeometryKind::kCompound) return Part(AtOrigin(geometry));
  const Geometry::Child& child = geometry.children[index];
  return Part(
      {.geometry = child.geometry.get(), .triangle = {}, .position = child.position, .rotation = child.rotation});
}
std::size_t ChildrenOf(const Geometry& geometry) {
  return geometry.kind == GeometryKind::kCompound ? geometry.children.size() : 1;
}

// How far the middle of a part may leave its straight way because its body turns.
double Strays(const Part& part, const Turning& turning) {
  return std::min(2.0, Length(turning.turn)) * Length(part.middle);
}

bool MayMeet(const Part& a, const Part& b, const Ways& ways, double target_m) {
  const Vec3d from = ways.start + Rotate(ways.b.from, b.middle) - Rotate(ways.a.from, a.middle);
  const double all = LengthSquared(ways.travel);
  const double nearest = all > 0 ? std::clamp(-Dot(from, ways.travel) / all, 0.0, 1.0) : 0;
  const double room = a.size_m + b.size_m + target_m + Strays(a, ways.a) + Strays(b, ways.b);
  return LengthSquared(from + ways.travel * nearest) <= room * room * (1 + 1e-9);
}

// A flat triangle whose plane b stays above or below, all the way.
bool StaysOnOneSide(const Part& triangle, const Part& b, const Ways& ways, double target_m) {
  const auto& c = triangle.convex.triangle;
  const Vec3d corner(c[0]), cross = Cross(Vec3d(c[1]) - corner, Vec3d(c[2]) - corner);
  const Quatd into_a = Conjugate(ways.a.from);
  const double from = Dot(cross, Rotate(into_a, ways.start + Rotate(ways.b.from, b.middle)) - corner);
  const double to = from + Dot(cross, Rotate(into_a, ways.travel));
  const double room = (b.size_m + Strays(b, ways.b) + target_m) * (1 + 1e-9) * Length(cross);
  return (from > room && to > room) || (from < -room && to < -room);
}

// Bounds of all that `part` of b sweeps over, in a's frame; a stays.
struct Swept {
  Vec3d min, max;
};
Swept SweptInA(const Part& part, const Ways& ways, double target_m) {
  const Quatd into_a = Conjugate(ways.a.from);
  const Vec3d from = Rotate(into_a, ways.start + Rotate(ways.b.from, part.middle));
  const Vec3d to = from + Rotate(into_a, ways.travel);
  const double around = part.size_m + Strays(part, ways.b) + target_m;
  const Vec3d room{around, around, around};
  return {Vec3d{std::min(from.x, to.x), std::min(from.y, to.y), std::min(from.z, to.z)} - room,
          Vec3d{std::max(from.x, to.x), std::max(from.y, to.y), std::max(from.z, to.z)} + room};
}

// Runs over the triangles that Bullet's tree or grid finds.
class Triangles : public btTriangleCallback {
 public:
  explicit Triangles(const std::function<void(const Part&)>& each) : each_(each) {}
  void processTriangle(btVector3* corners, int, int) override {
    each_(Part(TriangleAt({FromBullet(corners[0]), FromBullet(corners[1]), FromBullet(corners[2])})));
  }

 private:
  const std::function<void(const Part&)>& each_;
};

void ForTriangles(const Geometry& geometry, const Swept& swept, const std::function<void(const Part&)>& each) {
  Triangles triangles(each);
  // Rounded to float, bounds may lose what lies on them.
  const double room = 1e-6 * (1 + std::max(Length(swept.min), Length(swept.max)));
  const Vec3d around{room, room, room};
  static_cast<btConcaveShape&>(*geometry.bullet->bullet())
      .processAllTriangles(&triangles, ToBullet(swept.min - around), ToBullet(swept.max + around));
}

}  // namespace

Ways::Ways(const Way& way_a, const Way& way_b)
    : geometry_a(way_a.geometry),
      geometry_b(way_b.geometry),
      a(TurningOf(way_a)),
      b(TurningOf(way_b)),
      start(way_b.from - way_a.from),
      travel((way_b.to - way_b.from) - (way_a.to - way_a.from)) {}

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

void ForPartsThatMayMeet(const Ways& ways, double target_m, const std::function<void(const Part&, const Part&)>& test) {
  for (std::size_t j = 0; j < ChildrenOf(ways.geometry_b); ++j) {
    const Part b = ChildOf(ways.geometry_b, j);
    if (ways.geometry_a.kind == GeometryKind::kPlane) {
      test(Part(ways.geometry_a, ways.a), b);
    } else if (HasNoParts(ways.geometry_a)) {
      ForTriangles(ways.geometry_a, SweptInA(b, ways, target_m), [&](const Part& triangle) {
        if (MayMeet(triangle, b, ways, target_m) && !StaysOnOneSide(triangle, b, ways, target_m)) test(triangle, b);
      });
    } else {
      for (std::size_t i = 0; i < ChildrenOf(ways.geometry_a); ++i) {
        const Part a = ChildOf(ways.geometry_a, i);
        if (MayMeet(a, b, ways, target_m)) test(a, b);
      }
    }
  }
}

}  // namespace tessera::physics
