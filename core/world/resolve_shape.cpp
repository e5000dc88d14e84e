#include "core/world/resolve_shape.h"

#include <cmath>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/proto_math.h"
#include "core/world/sha256.h"
#include "core/world/shape_checks.h"

namespace tessera {
namespace {

using ShapeKind = v1::Shape::KindCase;

bool StaticOnly(ShapeKind kind) {
  return kind == ShapeKind::kMesh || kind == ShapeKind::kHeightField || kind == ShapeKind::kPlane;
}

const char* NameOf(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::kBox:
      return "box";
    case ShapeKind::kSphere:
      return "sphere";
    case ShapeKind::kCapsule:
      return "capsule";
    case ShapeKind::kCylinder:
      return "cylinder";
    case ShapeKind::kCone:
      return "cone";
    case ShapeKind::kHull:
      return "hull";
    case ShapeKind::kCompound:
      return "compound";
    case ShapeKind::kMesh:
      return "mesh";
    case ShapeKind::kHeightField:
      return "height_field";
    case ShapeKind::kPlane:
      return "plane";
    case ShapeKind::KIND_NOT_SET:
      break;
  }
  return "nothing";
}

bool Extent(Faults& faults, const std::string& field, double value) {
  return faults.Positive(field, value, kMinExtent_m, kMaxExtent_m);
}

ConvexHullShape Hull(Faults& faults, const std::string& field, const v1::Shape::ConvexHull& hull) {
  const auto count = static_cast<std::size_t>(hull.points_size());
  if (count < 4 || count > kMaxHullPoints) {
    faults.Add(absl::StrCat(field, ".points must be 4 to ", kMaxHullPoints, ", got ", count));
    return {};
  }
  ConvexHullShape out;
  for (int i = 0; i < hull.points_size(); ++i) {
    if (!faults.Vector(absl::StrCat(field, ".points[", i, "]"), hull.points(i), kMaxExtent_m)) return {};
    out.points.emplace_back(FromProto(hull.points(i)));
  }
  const double thickness = ThicknessOf(out.points), least = LeastThicknessOf(out.points);
  if (thickness < least) {
    faults.Add(
        absl::StrCat(field, ".points lie in one plane: they must be at least ", least, " m thick, got ", thickness));
  }
  return out;
}

TriangleMeshShape Mesh(Faults& faults, const std::string& field, const v1::Shape::TriangleMesh& mesh) {
  TriangleMeshShape out;
  const auto vertices = static_cast<std::size_t>(mesh.vertices_size());
  const auto indices = static_cast<std::size_t>(mesh.indices_size());
  if (vertices < 3 || vertices > kMaxMeshVertices) {
    faults.Add(absl::StrCat(field, ".vertices must be 3 to ", kMaxMeshVertices, ", got ", vertices));
    return out;
  }
  if (indices == 0 || indices % 3 != 0 || indices / 3 > kMaxMeshTriangles) {
    faults.Add(absl::StrCat(field, ".indices must be three a triangle, for 1 to ", kMaxMeshTriangles,
                            " triangles, got ", indices));
    return out;
  }
  for (int i = 0; i < mesh.vertices_size(); ++i) {
    if (!faults.Vector(absl::StrCat(field, ".vertices[", i, "]"), mesh.vertices(i), kMaxExtent_m)) return out;
    out.vertices.emplace_back(FromProto(mesh.vertices(i)));
  }
  for (int i = 0; i < mesh.indices_size(); i += 3) {
    for (int corner = i; corner < i + 3; ++corner) {
      if (mesh.indices(corner) < vertices) continue;
      faults.Add(absl::StrCat(field, ".indices[", corner, "] must be below ", vertices,
                              ", the number of vertices, got ", mesh.indices(corner)));
      return out;
    }
    const std::array<std::uint32_t, 3> triangle{mesh.indices(i), mesh.indices(i + 1), mesh.indices(i + 2)};
    if (!HasArea(out.vertices[triangle[0]], out.vertices[triangle[1]], out.vertices[triangle[2]])) {
      faults.Add(absl::StrCat(field, ".indices[", i, "]: triangle ", i / 3, " (", triangle[0], ", ", triangle[1], ", ",
                              triangle[2], ") has no area"));
    }
    out.triangles.push_back(triangle);
  }
  return out;
}

HeightFieldShape Heights(Faults& faults, const std::string& field, const v1::Shape::HeightField& in) {
  HeightFieldShape out{.columns = in.columns(), .rows = in.rows(), .spacing_m = in.spacing(), .heights_m = {}};
  const auto samples = std::uint64_t{in.columns()} * in.rows();
  if (in.columns() < 2 || in.rows() < 2 || samples > kMaxHeightSamples) {
    faults.Add(absl::StrCat(field, ".columns and rows must be at least 2, and their product at most ",
                            kMaxHeightSamples, ", got ", in.columns(), " and ", in.rows()));
    return out;
  }
  if (samples != static_cast<std::uint64_t>(in.heights_size())) {
    faults.Add(absl::StrCat(field, ".heights must be columns * rows = ", samples, ", got ", in.heights_size()));
    return out;
  }
  if (Extent(faults, field + ".spacing", in.spacing())) {
    Extent(faults, field + ".spacing * columns", in.spacing() * in.columns());
    Extent(faults, field + ".spacing * rows", in.spacing() * in.rows());
  }
  for (int i = 0; i < in.heights_size(); ++i) {
    const double height = static_cast<double>(in.heights(i));
    if (!faults.Range(absl::StrCat(field, ".heights[", i, "]"), height, -kMaxExtent_m, kMaxExtent_m)) return out;
  }
  out.heights_m.assign(in.heights().begin(), in.heights().end());
  return out;
}

PlaneShape Plane(Faults& faults, const std::string& field, const v1::Shape::Plane& plane) {
  faults.Range(field + ".offset", plane.offset(), -kMaxCoordinate_m, kMaxCoordinate_m);
  if (!faults.Vector(field + ".normal", plane.normal(), kMaxCoordinate_m)) return {};
  const Vec3d normal = FromProto(plane.normal());
  if (std::abs(Length(normal) - 1) > kUnitTolerance) {
    faults.Add(absl::StrCat(field, ".normal must have length 1, got ", Length(normal)));
  }
  return {.normal = Normalized(normal), .offset_m = plane.offset()};
}

// `message` is a capsule or a cylinder.
template <class Out, class Message>
Out Round(Faults& faults, const std::string& field, const Message& message) {
  Extent(faults, field + ".radius", message.radius());
  Extent(faults, field + ".half_height", message.half_height());
  return {.radius_m = message.radius(), .half_height_m = message.half_height()};
}

BoxShape BoxOf(Faults& faults, const std::string& field, const v1::Vec3& half) {
  Extent(faults, field + ".half_extents.x", half.x());
  Extent(faults, field + ".half_extents.y", half.y());
  Extent(faults, field + ".half_extents.z", half.z());
  return {FromProto(half)};
}

Vec3d VisualScale(Faults& faults, const std::string& field, const v1::Visual& visual) {
  if (!visual.has_scale()) return {1, 1, 1};
  const Vec3d scale = FromProto(visual.scale());
  for (const auto& [axis, value] : {std::pair("x", scale.x), std::pair("y", scale.y), std::pair("z", scale.z)}) {
    const double size = std::abs(value);
    if (size >= kMinVisualScale && size <= kMaxVisualScale) continue;
    faults.Add(absl::StrCat(field, ".scale.", axis, " must be ", kMinVisualScale, " to ", kMaxVisualScale,
                            " or the negative of it, got ", value));
    return {1, 1, 1};
  }
  return scale;
}

std::vector<Visual> VisualsOf(Faults& faults, const std::string& field, const v1::Shape& shape) {
  std::vector<Visual> out;
  const auto count = static_cast<std::size_t>(shape.visuals_size());
  if (count > kMaxVisuals) {
    faults.Add(absl::StrCat(field, ".visuals must be at most ", kMaxVisuals, ", got ", count));
    return out;
  }
  out.reserve(count);
  for (int i = 0; i < shape.visuals_size(); ++i) {
    const v1::Visual& visual = shape.visuals(i);
    const std::string here = absl::StrCat(field, ".visuals[", i, "]");
    if (!IsSha256Hex(visual.sha256())) {
      faults.Add(absl::StrCat(here, ".sha256 must be 64 lower-case hexadecimal digits"));
      continue;
    }
    out.push_back({.sha256 = visual.sha256(),
                   .mesh = visual.mesh(),
                   .pose = faults.Normalised(here + ".pose", visual.pose(), kMaxExtent_m),
                   .scale = VisualScale(faults, here, visual)});
  }
  return out;
}

}  // namespace

ShapePtr ShapeResolver::Resolve(const std::string& field, const v1::Shape& shape, Motion motion) {
  const ShapeKind kind = shape.kind_case();
  if (kind == ShapeKind::KIND_NOT_SET) {
    faults_.Add(absl::StrCat(field,
                             " is missing: give one of box, sphere, capsule, cylinder, cone, hull, compound, mesh, "
                             "height_field, plane"));
    return nullptr;
  }
  if (StaticOnly(kind) && motion != Motion::kStatic) {
    faults_.Add(absl::StrCat(field, ".", NameOf(kind), " is for static bodies only"));
    return nullptr;
  }
  // A serialised terrain would only cost memory: no scene has it twice.
  const std::string key = StaticOnly(kind) ? std::string() : shape.SerializeAsString();
  if (const auto it = known_.find(key); it != known_.end()) return it->second;
  const std::size_t before = faults_.count();
  std::vector<Visual> visuals = VisualsOf(faults_, field, shape);
  ShapePtr built = Build(absl::StrCat(field, ".", NameOf(kind)), shape, std::move(visuals));
  if (faults_.count() != before) return nullptr;
  if (!key.empty()) known_.emplace(key, built);
  return built;
}

ShapePtr ShapeResolver::Build(const std::string& field, const v1::Shape& shape, std::vector<Visual> visuals) {
  auto out = std::make_shared<Shape>();
  out->visuals = std::move(visuals);
  switch (shape.kind_case()) {
    case ShapeKind::kBox:
      out->form = BoxOf(faults_, field, shape.box().half_extents());
      break;
    case ShapeKind::kSphere:
      Extent(faults_, field + ".radius", shape.sphere().radius());
      out->form = SphereShape{shape.sphere().radius()};
      break;
    case ShapeKind::kCapsule:
      out->form = Round<CapsuleShape>(faults_, field, shape.capsule());
      break;
    case ShapeKind::kCylinder:
      out->form = Round<CylinderShape>(faults_, field, shape.cylinder());
      break;
    case ShapeKind::kCone:
      Extent(faults_, field + ".radius", shape.cone().radius());
      Extent(faults_, field + ".height", shape.cone().height());
      out->form = ConeShape{.radius_m = shape.cone().radius(), .height_m = shape.cone().height()};
      break;
    case ShapeKind::kHull:
      out->form = Hull(faults_, field, shape.hull());
      break;
    case ShapeKind::kCompound: {
      CompoundShape compound;
      const auto& children = shape.compound().children();
      if (children.empty() || static_cast<std::size_t>(children.size()) > kMaxCompoundChildren) {
        faults_.Add(absl::StrCat(field, ".children must be 1 to ", kMaxCompoundChildren, ", got ", children.size()));
        break;
      }
      for (int i = 0; i < children.size(); ++i) {
        const std::string child = absl::StrCat(field, ".children[", i, "]");
        const ShapeKind kind = children[i].shape().kind_case();
        if (kind == ShapeKind::kCompound || StaticOnly(kind)) {
          faults_.Add(
              absl::StrCat(child, ".shape must be a box, sphere, capsule, cylinder, cone or hull, got ", NameOf(kind)));
          continue;
        }
        if (!children[i].shape().visuals().empty()) {
          faults_.Add(absl::StrCat(child, ".shape.visuals: give them to the compound"));
          continue;
        }
        const Pose pose = faults_.Normalised(child + ".pose", children[i].pose(), kMaxExtent_m);
        compound.children.push_back({pose, Resolve(child + ".shape", children[i].shape(), Motion::kDynamic)});
      }
      out->form = std::move(compound);
      break;
    }
    case ShapeKind::kMesh:
      out->form = Mesh(faults_, field, shape.mesh());
      break;
    case ShapeKind::kHeightField:
      out->form = Heights(faults_, field, shape.height_field());
      break;
    case ShapeKind::kPlane:
      out->form = Plane(faults_, field, shape.plane());
      break;
    case ShapeKind::KIND_NOT_SET:
      break;
  }
  return out;
}

}  // namespace tessera
