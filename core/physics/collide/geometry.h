// Geometry: a shape as collision sees it, in a body's frame.
//
//   const auto geometry = MakeGeometry(*def.shape, frame);
//   const Bounds bounds = BoundsOf(*geometry, rotation);
//
// Immutable, and shared by bodies that look alike. Nothing here depends on Bullet.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/physics/body_frame.h"
#include "core/physics/bounds.h"
#include "core/physics/collide/polyhedron.h"
#include "core/physics/collide/surface.h"
#include "core/physics/linear.h"
#include "core/world/scene.h"

namespace tessera::physics {

enum class GeometryKind : std::uint8_t {
  kSphere,
  kCapsule,
  kBox,
  kCylinder,
  kCone,
  kHull,
  kCompound,
  kMesh,
  kHeightField,
  kPlane
};

struct Geometry {
  struct Child {
    std::shared_ptr<const Geometry> geometry;
    Vec3f position;
    Mat3f rotation;
  };

  GeometryKind kind = GeometryKind::kSphere;
  Vec3f half_extents_m;         // box
  float radius_m = 0;           // sphere, capsule, cylinder, base of a cone
  float half_height_m = 0;      // capsule and cylinder along y (a capsule's without its caps), cone
  float base_y_m = 0;           // cone: height of its base along y
  Vec3f plane_normal{0, 1, 0};  // plane: solid below dot(normal, p) = offset
  double plane_offset_m = 0;
  std::shared_ptr<const Polyhedron> polyhedron;  // box, hull
  std::vector<Child> children;                   // compound
  std::shared_ptr<const Surface> surface;        // mesh, height field

  // Radius of a solid ball about the origin; 0 where there is none. A body that moves by less than this in a tick
  // cannot pass through anything unseen.
  float inner_radius_m = 0;
  float outer_radius_m = 0;  // the ball about the origin that holds the shape; infinite for a plane

  // Convex shapes: a solid ball well inside, wherever the origin is.
  Vec3f middle;
  float middle_radius_m = 0;

  bool convex() const { return kind <= GeometryKind::kHull; }
};

// `shape` as seen from `frame`. A mesh, a height field and a plane belong to static bodies.
std::shared_ptr<const Geometry> MakeGeometry(const Shape& shape, const BodyFrame& frame);

// Bounds about the body's origin when the body is turned by `rotation`; without any margin. Not for planes.
Bounds BoundsOf(const Geometry& geometry, const Mat3f& rotation);

}  // namespace tessera::physics
