#include "core/physics/shapes.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <cassert>

#include "core/physics/bullet_math.h"
#include "core/physics/collide/geometry.h"
#include "core/physics/cone_shape.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// A shape that points into nothing else.
class Simple : public CollisionShape {
 public:
  explicit Simple(std::unique_ptr<btCollisionShape> shape) : shape_(std::move(shape)) {}
  btCollisionShape* bullet() override { return shape_.get(); }

 private:
  std::unique_ptr<btCollisionShape> shape_;
};

class Compound : public CollisionShape {
 public:
  void Add(const Pose& pose, std::shared_ptr<CollisionShape> child) {
    shape_.addChildShape(ToBullet(pose), child->bullet());
    children_.push_back(std::move(child));
  }
  btCollisionShape* bullet() override { return &shape_; }

 private:
  std::vector<std::shared_ptr<CollisionShape>> children_;
  btCompoundShape shape_;
};

class Mesh : public CollisionShape {
 public:
  explicit Mesh(const TriangleMeshShape& mesh) : vertices_(mesh.vertices), triangles_(mesh.triangles) {
    btIndexedMesh part;
    part.m_numTriangles = static_cast<int>(triangles_.size());
    part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(triangles_.data());
    part.m_triangleIndexStride = sizeof(triangles_[0]);
    part.m_numVertices = static_cast<int>(vertices_.size());
    part.m_vertexBase = reinterpret_cast<const unsigned char*>(vertices_.data());
    part.m_vertexStride = sizeof(Vec3f);
    arrays_.addIndexedMesh(part, PHY_INTEGER);
    shape_ = std::make_unique<btBvhTriangleMeshShape>(&arrays_, true);
    shape_->setMargin(0);  // a margin would lift all that lies on the mesh
  }
  btCollisionShape* bullet() override { return shape_.get(); }

 private:
  std::vector<Vec3f> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  btTriangleIndexVertexArray arrays_;
  std::unique_ptr<btBvhTriangleMeshShape> shape_;
};

class HeightField : public CollisionShape {
 public:
  explicit HeightField(const HeightFieldShape& field) : heights_(field.heights_m) {
    const auto [low, high] = std::minmax_element(heights_.begin(), heights_.end());
    shape_ = std::make_unique<btHeightfieldTerrainShape>(static_cast<int>(field.columns), static_cast<int>(field.rows),
                                                         heights_.data(), *low, *high, 1, false);
    const auto spacing = static_cast<btScalar>(field.spacing_m);
    shape_->setLocalScaling({spacing, 1, spacing});
    shape_->setMargin(0);
  }
  btCollisionShape* bullet() override { return shape_.get(); }

 private:
  std::vector<float> heights_;
  std::unique_ptr<btHeightfieldTerrainShape> shape_;
};

// Faces lie where they were given: shrunk by the margin, which Bullet adds again.
std::unique_ptr<btCollisionShape> MakeHull(const ConvexHullShape& hull, const BodyFrame& frame) {
  std::vector<Vec3f> points;
  const Quatd to_frame = Conjugate(frame.axes);
  for (const Vec3f& p : hull.points) points.push_back(Vec3f(Rotate(to_frame, Vec3d(p) - frame.origin)));
  btConvexHullComputer computer;
  const btScalar margin =
      computer.compute(&points[0].x, sizeof(Vec3f), static_cast<int>(points.size()), kHullMargin_m, kHullMarginShare);
  if (margin < 0) computer.compute(&points[0].x, sizeof(Vec3f), static_cast<int>(points.size()), 0, 0);
  auto shape =
      std::make_unique<btConvexHullShape>(&computer.vertices[0].x(), computer.vertices.size(), sizeof(btVector3));
  shape->setMargin(std::max(margin, btScalar(0)));
  shape->initializePolyhedralFeatures();
  return shape;
}

// Every convex form but the hull, in its own coordinates.
struct MakePrimitive {
  std::unique_ptr<btCollisionShape> operator()(const BoxShape& box) const {
    return std::make_unique<btBoxShape>(ToBullet(box.half_extents_m));
  }
  std::unique_ptr<btCollisionShape> operator()(const SphereShape& sphere) const {
    return std::make_unique<btSphereShape>(static_cast<btScalar>(sphere.radius_m));
  }
  std::unique_ptr<btCollisionShape> operator()(const CapsuleShape& capsule) const {
    return std::make_unique<btCapsuleShape>(static_cast<btScalar>(capsule.radius_m),
                                            static_cast<btScalar>(2 * capsule.half_height_m));
  }
  std::unique_ptr<btCollisionShape> operator()(const CylinderShape& cylinder) const {
    return std::make_unique<btCylinderShape>(
        ToBullet(Vec3d{cylinder.radius_m, cylinder.half_height_m, cylinder.radius_m}));
  }
};

// The cone carries its own origin on the axis, so it needs no wrapper to be centred on its mass.
std::unique_ptr<btCollisionShape> MakeCone(const ConeShape& cone, const BodyFrame& frame) {
  const double smaller = std::min(cone.radius_m, cone.height_m / 2);
  const auto margin = std::min(kConeMargin_m, kConeMarginShare * static_cast<float>(smaller));
  return std::make_unique<ConeShapeBt>(static_cast<btScalar>(cone.radius_m), static_cast<btScalar>(cone.height_m),
                                       static_cast<btScalar>(-cone.height_m / 2 - frame.origin.y), margin);
}

std::shared_ptr<CollisionShape> MakeCompound(const CompoundShape& compound, const BodyFrame& frame) {
  auto result = std::make_shared<Compound>();
  const Quatd to_frame = Conjugate(frame.axes);
  for (const CompoundChild& child : compound.children) {
    const Pose pose{Rotate(to_frame, child.pose.position - frame.origin),
                    to_frame * Normalized(child.pose.orientation)};
    result->Add(pose, MakeShape(*child.shape, {}));
  }
  return result;
}

struct MakeForm {
  const BodyFrame& frame;
  std::shared_ptr<CollisionShape> operator()(const ConvexHullShape& hull) const {
    return std::make_shared<Simple>(MakeHull(hull, frame));
  }
  std::shared_ptr<CollisionShape> operator()(const ConeShape& cone) const {
    return std::make_shared<Simple>(MakeCone(cone, frame));
  }
  std::shared_ptr<CollisionShape> operator()(const CompoundShape& compound) const {
    return MakeCompound(compound, frame);
  }
  std::shared_ptr<CollisionShape> operator()(const TriangleMeshShape& mesh) const {
    return std::make_shared<Mesh>(mesh);
  }
  std::shared_ptr<CollisionShape> operator()(const HeightFieldShape& field) const {
    return std::make_shared<HeightField>(field);
  }
  std::shared_ptr<CollisionShape> operator()(const PlaneShape&) const {
    assert(false && "a plane is made by MakePlane");
    return nullptr;
  }
  std::shared_ptr<CollisionShape> operator()(const auto& primitive) const {
    return std::make_shared<Simple>(MakePrimitive()(primitive));
  }
};

}  // namespace

std::shared_ptr<CollisionShape> MakeShape(const Shape& shape, const BodyFrame& frame) {
  return std::visit(MakeForm{frame}, shape.form);
}

std::shared_ptr<CollisionShape> MakePlane(Vec3d normal, double offset_m) {
  return std::make_shared<Simple>(
      std::make_unique<btStaticPlaneShape>(ToBullet(normal), static_cast<btScalar>(offset_m)));
}

BodyForm ShapeCache::FormOf(const BodyDef& def) {
  BodyForm form;
  Entry& entry = EntryOf(def.shape);
  if (def.motion == Motion::kDynamic) {
    form.frame.origin = entry.mass.center_of_mass;
    if (!def.inertia_kg_m2) form.frame.axes = entry.mass.axes;
    form.inertia = def.inertia_kg_m2.value_or(entry.mass.principal * def.mass_kg);
  } else if (const auto* field = std::get_if<HeightFieldShape>(&def.shape->form)) {
    // Bullet centres a height field between its lowest and its highest point.
    const auto [low, high] = std::minmax_element(field->heights_m.begin(), field->heights_m.end());
    form.frame.origin.y = (static_cast<double>(*low) + *high) / 2;
  }
  std::erase_if(entry.made, [](const auto& made) { return made.second.expired(); });
  for (const auto& [frame, geometry] : entry.made) {
    if (frame == form.frame) form.geometry = geometry.lock();
  }
  if (!form.geometry) {
    form.geometry = MakeGeometry(def.shape, form.frame);
    entry.made.emplace_back(form.frame, form.geometry);
  }
  return form;
}

ShapeCache::Entry& ShapeCache::EntryOf(const ShapePtr& shape) {
  if (entries_.size() >= drop_at_) DropExpired();
  Entry& entry = entries_[shape.get()];
  if (entry.key.lock() != shape) entry = {.key = shape, .mass = MassPropertiesOf(*shape), .made = {}};
  return entry;
}

void ShapeCache::DropExpired() {
  std::erase_if(entries_, [](const auto& entry) { return entry.second.key.expired(); });
  drop_at_ = std::max<std::size_t>(64, 2 * entries_.size());
}

}  // namespace tessera::physics
