#include "cli/gltf/gltf_shapes.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "absl/strings/str_cat.h"
#include "cli/gltf/gltf_geometry.h"
#include "cli/gltf/gltf_values.h"
#include "core/physics/mass_properties.h"
#include "core/world/limits.h"
#include "core/world/proto_math.h"
#include "core/world/scene_load.h"

namespace tessera::cli {
namespace {

constexpr char kShapeExtension[] = "OMI_physics_shape";
// Scales of round shapes that differ by less than this are one; exporters write floats.
constexpr double kUneven = 1e-3;

absl::Status Wrong(const std::string& where, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat(where, ": ", what));
}

// Capsules and cylinders have one radius here, and two there.
absl::StatusOr<double> RadiusIn(const tinygltf::Value& values, const std::string& where) {
  const double radius = NumberIn(values, "radius", 0.5);
  const double bottom = NumberIn(values, "radiusBottom", radius), top = NumberIn(values, "radiusTop", radius);
  if (bottom != top) return Wrong(where, "its ends have different radii, which is not supported; use a convex shape");
  return bottom;
}

absl::StatusOr<ShapePart> ReadRound(const std::string& type, const tinygltf::Value& values, const Placed& placed,
                                    const std::string& where) {
  ShapePart part{placed.pose, {}, {}, {}};
  const Vec3d& scale = placed.scale;
  const double most = std::max({scale.x, scale.y, scale.z}), least = std::min({scale.x, scale.y, scale.z});
  const bool even = most - least <= kUneven * most;
  const bool round = std::max(scale.x, scale.z) - std::min(scale.x, scale.z) <= kUneven * most;
  if (type == "sphere") {
    if (!even) return Wrong(where, "a sphere needs the same scale along all axes");
    part.shape.mutable_sphere()->set_radius(NumberIn(values, "radius", 0.5) * most);
    return part;
  }
  const auto radius = RadiusIn(values, where);
  if (!radius.ok()) return radius.status();
  if (type == "capsule") {
    if (!even) return Wrong(where, "a capsule needs the same scale along all axes");
    part.shape.mutable_capsule()->set_radius(*radius * most);
    part.shape.mutable_capsule()->set_half_height(NumberIn(values, "height", 1) / 2 * most);
    return part;
  }
  if (!round) return Wrong(where, "a cylinder needs the same scale along x and z");
  part.shape.mutable_cylinder()->set_radius(*radius * scale.x);
  part.shape.mutable_cylinder()->set_half_height(NumberIn(values, "height", 2) / 2 * scale.y);
  return part;
}

// At most kMaxHullPoints of the points: those that lie furthest in directions spread evenly over the sphere, by the
// golden angle.
std::vector<Vec3d> Thinned(const std::vector<Vec3d>& points) {
  std::set<std::size_t> chosen;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (std::size_t i = 0; i < kMaxHullPoints; ++i) {
    const double y = 1 - 2 * (static_cast<double>(i) + 0.5) / static_cast<double>(kMaxHullPoints);
    const double r = std::sqrt(1 - y * y), angle = golden * static_cast<double>(i);
    const Vec3d direction{r * std::cos(angle), y, r * std::sin(angle)};
    const auto furthest = std::max_element(points.begin(), points.end(),
                                           [&](Vec3d a, Vec3d b) { return Dot(a, direction) < Dot(b, direction); });
    chosen.insert(static_cast<std::size_t>(furthest - points.begin()));
  }
  std::vector<Vec3d> kept;
  kept.reserve(chosen.size());
  for (const std::size_t index : chosen) kept.push_back(points[index]);
  return kept;
}

Vec3d Into(const Pose& pose, Vec3d world) { return Rotate(Conjugate(pose.orientation), world - pose.position); }

void Grow(std::optional<Aabb>& box, Vec3d at, double radius) {
  const Vec3d r{radius, radius, radius}, low = at - r, high = at + r;
  if (!box) box = Aabb{low, high};
  box->min = {std::min(box->min.x, low.x), std::min(box->min.y, low.y), std::min(box->min.z, low.z)};
  box->max = {std::max(box->max.x, high.x), std::max(box->max.y, high.y), std::max(box->max.z, high.z)};
}

// How far a shape that is no hull and no mesh reaches from its origin.
double ReachOf(const v1::Shape& shape) {
  switch (shape.kind_case()) {
    case v1::Shape::kBox:
      return Length(FromProto(shape.box().half_extents()));
    case v1::Shape::kSphere:
      return shape.sphere().radius();
    case v1::Shape::kCapsule:
      return shape.capsule().radius() + shape.capsule().half_height();
    default:
      return std::hypot(shape.cylinder().radius(), shape.cylinder().half_height());
  }
}

// A part as a shape in the coordinates of `pose`, which for all but hulls is the part's own.
v1::Shape HullIn(const Pose& pose, const ShapePart& part, bool& thinned) {
  v1::Shape shape;
  const bool many = part.points.size() > kMaxHullPoints;
  thinned = thinned || many;
  for (const Vec3d& point : many ? Thinned(part.points) : part.points) {
    *shape.mutable_hull()->add_points() = ToProto(Into(pose, point));
  }
  return shape;
}

v1::Shape MeshIn(const Pose& pose, const ShapePart& part) {
  v1::Shape shape;
  for (const Vec3d& point : part.points) *shape.mutable_mesh()->add_vertices() = ToProto(Into(pose, point));
  shape.mutable_mesh()->mutable_indices()->Assign(part.indices.begin(), part.indices.end());
  return shape;
}

// Where the centre of mass is, which the engine says of a body of that shape in a scene of its own.
absl::StatusOr<Vec3d> CenterOf(const v1::Shape& shape, const std::string& where) {
  v1::Scene scene;
  scene.set_name("shape");
  *scene.mutable_bounds()->mutable_min() = ToProto(Vec3d{-1, -1, -1} * kMaxExtent_m);
  *scene.mutable_bounds()->mutable_max() = ToProto(Vec3d{1, 1, 1} * kMaxExtent_m);
  v1::Body& body = *scene.add_bodies();
  body.set_id(1);
  body.set_mass(1);
  *body.mutable_shape() = shape;
  const auto loaded = LoadScene(std::move(scene), "shape");
  if (!loaded.ok()) return Wrong(where, std::string(loaded.status().message()));
  return physics::MassPropertiesOf(*loaded->scene->bodies.front().shape).center_of_mass;
}

}  // namespace

std::optional<Vec3d> VectorOf(const tinygltf::Value& list) {
  if (!list.IsArray() || list.ArrayLen() != 3) return std::nullopt;
  Vec3d v;
  int at = 0;
  for (double* part : {&v.x, &v.y, &v.z}) {
    const tinygltf::Value& number = list.Get(at++);
    if (!number.IsNumber()) return std::nullopt;
    *part = number.GetNumberAsDouble();
  }
  return IsFinite(v) ? std::optional(v) : std::nullopt;
}

absl::StatusOr<ShapePart> ReadShape(const tinygltf::Model& model, int shape, const Affine& map,
                                    const std::string& where) {
  const auto found = model.extensions.find(kShapeExtension);
  const tinygltf::Value none;
  const tinygltf::Value& shapes = found == model.extensions.end() ? none : MemberOf(found->second, "shapes");
  if (shape < 0 || !shapes.IsArray() || static_cast<std::size_t>(shape) >= shapes.ArrayLen()) {
    return Wrong(where, absl::StrCat("there is no shape ", shape, " in ", kShapeExtension));
  }
  const tinygltf::Value& entry = shapes.Get(shape);
  const std::string type = StringIn(entry, "type", "");
  const tinygltf::Value& values = MemberOf(entry, type);
  const std::string here = absl::StrCat(where, ": shape ", shape);
  if (type == "convex" || type == "hull" || type == "trimesh") {
    const auto mesh = ReadMesh(model, IndexIn(values, "mesh"));
    if (!mesh.ok()) return Wrong(here, std::string(mesh.status().message()));
    Triangles triangles = *mesh;
    for (Vec3d& vertex : triangles.vertices) vertex = map(vertex);
    if (map.Determinant() < 0) {
      for (std::size_t i = 0; i + 2 < triangles.indices.size(); i += 3) {
        std::swap(triangles.indices[i + 1], triangles.indices[i + 2]);
      }
    }
    DropDegenerate(triangles);
    if (triangles.indices.empty()) return Wrong(here, "its mesh has no triangle");
    ShapePart part{{map.origin, {}}, {}, std::move(triangles.vertices), {}};
    if (type == "trimesh") part.indices = std::move(triangles.indices);
    return part;
  }
  const auto placed = Parts(map);
  if (!placed) return Wrong(here, "cannot be sheared or flat");
  if (type == "sphere" || type == "capsule" || type == "cylinder") return ReadRound(type, values, *placed, here);
  if (type != "box") {
    return Wrong(here, absl::StrCat("type \"", type, "\" is not box, sphere, capsule, cylinder, convex or trimesh"));
  }
  const Vec3d size = VectorOf(MemberOf(values, "size")).value_or(Vec3d{1, 1, 1});
  ShapePart part{placed->pose, {}, {}, {}};
  *part.shape.mutable_box()->mutable_half_extents() =
      ToProto(Vec3d{size.x * placed->scale.x, size.y * placed->scale.y, size.z * placed->scale.z} * 0.5);
  return part;
}

absl::StatusOr<JoinedShape> JoinParts(const std::vector<ShapePart>& parts, const Pose& pose, bool moves,
                                      const std::string& where) {
  JoinedShape joined;
  std::optional<Aabb> box;
  for (const ShapePart& part : parts) {
    const bool mesh = !part.indices.empty();
    if (mesh && moves) return Wrong(where, "a trimesh cannot move; use a convex shape");
    if (mesh && parts.size() > 1) {
      return Wrong(where, "a trimesh cannot be one of several shapes of a body; give it a node of its own");
    }
    for (const Vec3d& point : part.points) Grow(box, point, 0);
    if (part.points.empty()) Grow(box, part.pose.position, ReachOf(part.shape));
    if (mesh) {
      joined.shape = MeshIn(pose, part);
      continue;
    }
    const Pose local{Into(pose, part.pose.position), Normalized(Conjugate(pose.orientation) * part.pose.orientation)};
    const bool at_home = !part.points.empty() || local == Pose();
    if (parts.size() == 1 && at_home) {
      joined.shape = part.points.empty() ? part.shape : HullIn(pose, part, joined.thinned);
      continue;
    }
    auto& child = *joined.shape.mutable_compound()->add_children();
    if (part.points.empty()) *child.mutable_pose() = ToProto(local);
    *child.mutable_shape() = part.points.empty() ? part.shape : HullIn(pose, part, joined.thinned);
  }
  joined.box = *box;
  if (moves) {
    const auto center = CenterOf(joined.shape, where);
    if (!center.ok()) return center.status();
    joined.center = *center;
  }
  return joined;
}

}  // namespace tessera::cli
