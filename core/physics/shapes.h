// Shapes: from a scene's shape to the collision shape that Bullet works on.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <memory>
#include <unordered_map>
#include <vector>

#include "core/physics/mass_properties.h"
#include "core/world/scene.h"

namespace tessera::physics {

// Where a body's Bullet frame lies in its shape's coordinates: Bullet wants the centre of mass as origin and the
// principal axes as axes.
struct BodyFrame {
  Vec3d origin;
  Quatd axes;
  friend bool operator==(const BodyFrame&, const BodyFrame&) = default;
  bool turned() const { return !(axes == Quatd()); }
};

// A Bullet shape with all that it points into.
class CollisionShape {
 public:
  virtual ~CollisionShape() = default;
  virtual btCollisionShape* bullet() = 0;
};

// `shape`, which is no plane, as seen from `frame`. Keeps `shape` alive if it is held by a ShapePtr.
std::shared_ptr<CollisionShape> MakeShape(const Shape& shape, const BodyFrame& frame);
// The half space below dot(normal, p) = offset; `normal` is a unit vector.
std::shared_ptr<CollisionShape> MakePlane(Vec3d normal, double offset_m);

struct Geometry;

// What a body is made of.
struct BodyForm {
  BodyFrame frame;
  Vec3d inertia;  // principal, kg m^2; 0 when static
  std::shared_ptr<const Geometry> geometry;
};

// Gives bodies that share a scene shape one Bullet shape. Thread rule: one thread at a time.
class ShapeCache {
 public:
  BodyForm FormOf(const BodyDef& def);

 private:
  struct Entry {
    std::weak_ptr<const Shape> key;  // expired: the address may belong to another shape by now
    MassProperties mass;
    std::vector<std::pair<BodyFrame, std::weak_ptr<const Geometry>>> made;
  };
  Entry& EntryOf(const ShapePtr& shape);
  void DropExpired();

  std::unordered_map<const Shape*, Entry> entries_;
  std::size_t drop_at_ = 64;
};

}  // namespace tessera::physics
