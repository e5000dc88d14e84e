// Geometry: a shape as collision sees it, in the frame of a body: origin at the centre of mass, axes along the
// principal ones (for a static body, the shape's own frame as `BodyFrame` says). Immutable, shared by bodies that look
// alike.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/physics/linear.h"
#include "core/physics/shapes.h"

namespace tessera::physics {

class Surface;

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

// A convex polyhedron: faces as loops of vertices, counter-clockwise from outside.
struct Polyhedron {
  struct Face {
    Vec3f normal;                        // unit, outward
    float offset_m = 0;                  // dot(normal, p) on the face
    std::uint32_t first = 0, count = 0;  // in `loops`
  };
  struct Edge {
    std::uint32_t a = 0, b = 0;         // vertices
    std::uint32_t left = 0, right = 0;  // faces
  };
  std::vector<Vec3f> vertices;
  std::vector<std::uint32_t> loops;
  std::vector<Face> faces;
  std::vector<Edge> edges;
  Vec3f inside;  // a point well inside
};

struct Geometry {
  struct Child {
    std::shared_ptr<const Geometry> geometry;
    Vec3f position;
    Mat3f rotation;
  };

  GeometryKind kind = GeometryKind::kSphere;
  Vec3f half_extents_m;         // box
  float radius_m = 0;           // sphere, capsule, cylinder, cone's base
  float half_height_m = 0;      // capsule and cylinder along y (without the capsule's caps); cone: half its height
  float base_y_m = 0;           // cone: where its base lies along y
  Vec3f plane_normal{0, 1, 0};  // plane: solid below dot(normal, p) = offset
  double plane_offset_m = 0;
  std::shared_ptr<const Polyhedron> polyhedron;  // hull
  std::vector<Child> children;                   // compound
  std::shared_ptr<const Surface> surface;        // mesh and height field
  std::shared_ptr<CollisionShape> bullet;        // for GJK, EPA, trees of triangles, and queries

  float inner_radius_m = 0;  // of a ball about the origin that is solid; 0 where there is none. What moves less than
                             // this in a tick cannot pass through anything unseen
  float outer_radius_m = 0;  // of a ball about the origin that holds all of it; infinite for a plane

  Vec3f middle;               // of a ball well inside, wherever the origin is; convex shapes only
  float middle_radius_m = 0;  // of that ball

  bool convex() const { return kind <= GeometryKind::kHull; }
};

// `shape` as seen from `frame`. Static bodies may be anything; dynamic ones no mesh, height field or plane.
std::shared_ptr<const Geometry> MakeGeometry(const ShapePtr& shape, const BodyFrame& frame);

// Axis-aligned bounds about the body's origin when turned by `rotation`; without any margin. Not for planes.
struct LocalBounds {
  Vec3f min, max;
};
LocalBounds BoundsOf(const Geometry& geometry, const Mat3f& rotation);

}  // namespace tessera::physics
