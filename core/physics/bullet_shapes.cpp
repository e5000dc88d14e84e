#include "core/physics/bullet_shapes.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <vector>

#include "core/physics/bullet_math.h"
#include "core/physics/collide/surface.h"
#include "core/physics/cone_shape.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

using ShapeOwner = std::shared_ptr<btCollisionShape>;

// A compound that owns its children.
class OwningCompound : public btCompoundShape {
 public:
  explicit OwningCompound(const Geometry& compound) {
    for (const Geometry::Child& child : compound.children) {
      children_.push_back(MakeBulletShape(*child.geometry));
      addChildShape(btTransform(ToBullet(child.rotation), ToBullet(child.position)), children_.back().get());
    }
  }

 private:
  std::vector<ShapeOwner> children_;
};

// Bullet pads a hull by its margin. Shrinking the hull by as much first keeps the faces where they were given.
ShapeOwner MakeHull(const Polyhedron& hull) {
  const float* first = &hull.vertices[0].x;
  const int count = static_cast<int>(hull.vertices.size());
  btConvexHullComputer computer;
  const btScalar margin = computer.compute(first, sizeof(Vec3f), count, kHullMargin_m, kHullMarginShare);
  if (margin < 0) computer.compute(first, sizeof(Vec3f), count, 0, 0);
  auto shape =
      std::make_shared<btConvexHullShape>(&computer.vertices[0].x(), computer.vertices.size(), sizeof(btVector3));
  shape->setMargin(std::max(margin, btScalar(0)));
  shape->initializePolyhedralFeatures();
  return shape;
}

ShapeOwner MakeCone(const Geometry& cone) {
  const float margin = std::min(kConeMargin_m, kConeMarginShare * std::min(cone.radius_m, cone.half_height_m));
  return std::make_shared<ConeShapeBt>(cone.radius_m, 2 * cone.half_height_m, cone.base_y_m, margin);
}

ShapeOwner MakeHeightField(const HeightFieldShape& field) {
  const auto [low, high] = std::minmax_element(field.heights_m.begin(), field.heights_m.end());
  auto shape = std::make_shared<btHeightfieldTerrainShape>(
      static_cast<int>(field.columns), static_cast<int>(field.rows), field.heights_m.data(), *low, *high, 1, false);
  const auto spacing = static_cast<btScalar>(field.spacing_m);
  shape->setLocalScaling({spacing, 1, spacing});
  shape->setMargin(0);  // a margin would lift everything that lies on the field
  return shape;
}

}  // namespace

ShapeOwner MakeBulletShape(const Geometry& geometry) {
  switch (geometry.kind) {
    case GeometryKind::kSphere:
      return std::make_shared<btSphereShape>(geometry.radius_m);
    case GeometryKind::kCapsule:
      return std::make_shared<btCapsuleShape>(geometry.radius_m, 2 * geometry.half_height_m);
    case GeometryKind::kBox:
      return std::make_shared<btBoxShape>(ToBullet(geometry.half_extents_m));
    case GeometryKind::kCylinder:
      return std::make_shared<btCylinderShape>(btVector3(geometry.radius_m, geometry.half_height_m, geometry.radius_m));
    case GeometryKind::kCone:
      return MakeCone(geometry);
    case GeometryKind::kHull:
      return MakeHull(*geometry.polyhedron);
    case GeometryKind::kCompound:
      return std::make_shared<OwningCompound>(geometry);
    case GeometryKind::kMesh:
      return {ShapeOwner(), &geometry.surface->mesh_shape()};  // the surface owns it
    case GeometryKind::kHeightField:
      return MakeHeightField(geometry.surface->field());
    case GeometryKind::kPlane:
      return std::make_shared<btStaticPlaneShape>(ToBullet(geometry.plane_normal),
                                                  static_cast<btScalar>(geometry.plane_offset_m));
  }
  return nullptr;
}

}  // namespace tessera::physics
