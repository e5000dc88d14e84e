#include "core/world/packed_shape.h"

#include <algorithm>
#include <utility>

namespace tessera::packed {
namespace {

constexpr std::uint8_t kCompound = 6;  // place of CompoundShape among the forms
static_assert(std::is_same_v<std::variant_alternative_t<kCompound, decltype(Shape::form)>, CompoundShape>);
static_assert(std::is_same_v<std::variant_alternative_t<5, decltype(Shape::form)>, ConvexHullShape>);
static_assert(std::is_same_v<std::variant_alternative_t<7, decltype(Shape::form)>, TriangleMeshShape>);

template <class Io, class S>
void WriteOrRead(Io& io, S& form) {
  using T = std::remove_const_t<S>;
  if constexpr (std::is_same_v<T, BoxShape>) {
    FormVisitor::Box(io, form);
  } else if constexpr (std::is_same_v<T, SphereShape>) {
    Extent(io, "radius_m", form.radius_m);
  } else if constexpr (std::is_same_v<T, CapsuleShape> || std::is_same_v<T, CylinderShape>) {
    FormVisitor::Round(io, form);
  } else if constexpr (std::is_same_v<T, ConeShape>) {
    FormVisitor::Cone(io, form);
  } else if constexpr (std::is_same_v<T, ConvexHullShape>) {
    FormVisitor::Hull(io, form);
  } else if constexpr (std::is_same_v<T, TriangleMeshShape>) {
    FormVisitor::Mesh(io, form);
  } else if constexpr (std::is_same_v<T, HeightFieldShape>) {
    FormVisitor::Heights(io, form);
  } else {
    FormVisitor::Plane(io, form);
  }
}

// Makes `form` the alternative of this place.
template <std::size_t kPlace = 0>
void Become(decltype(Shape::form)& form, std::size_t place) {
  if constexpr (kPlace < std::variant_size_v<decltype(Shape::form)>) {
    if (place != kPlace) return Become<kPlace + 1>(form, place);
    form.emplace<kPlace>();
  }
}

}  // namespace

std::vector<std::uint8_t> ShapeTable::BytesOf(const Shape& shape) const {
  PackWriter io;
  io.Choice("form", static_cast<std::uint8_t>(shape.form.index()), std::uint8_t{0});
  std::visit(
      [&](const auto& form) {
        if constexpr (std::is_same_v<std::decay_t<decltype(form)>, CompoundShape>) {
          io.List("children", form.children, 1, kMaxCompoundChildren, 1, [&](const CompoundChild& child) {
            PoseOf(io, "pose", child.pose, kMaxExtent_m);
            Reference(io, "shape", child.shape);
          });
        } else {
          WriteOrRead(io, form);
        }
      },
      shape.form);
  if (with_visuals_) {
    io.List("visuals", shape.visuals, 0, kMaxVisuals, kMinVisualBytes,
            [&](const Visual& visual) { VisualOf(io, visual); });
  }
  return io.Take();
}

std::size_t ShapeTable::Add(const ShapePtr& shape) {
  if (const auto known = by_place_.find(shape.get()); known != by_place_.end()) return known->second;
  if (const auto* compound = std::get_if<CompoundShape>(&shape->form)) {
    for (const CompoundChild& child : compound->children) Add(child.shape);
  }
  std::vector<std::uint8_t> bytes = BytesOf(*shape);
  std::string content(AsText(bytes));
  if (below_table_ != nullptr) {
    const auto below = below_table_->by_content_.find(content);
    if (below != below_table_->by_content_.end()) return by_place_[shape.get()] = below->second;
  }
  const auto [at, fresh] = by_content_.emplace(std::move(content), size());
  by_place_.emplace(shape.get(), at->second);
  if (fresh) {
    shapes_.push_back(shape);
    bytes_.push_back(std::move(bytes));
  }
  return at->second;
}

void ShapeTable::Write(PackWriter& io) const {
  io.List("shapes", bytes_, 0, kMaxShapes, 2, [&](const std::vector<std::uint8_t>& bytes) { io.Raw(bytes); });
}

// A body, a player and members of prefabs have one each, and a compound's parts are shapes of their own.
bool ShapeTable::ReadOn(PackReader& io, std::size_t bytes) {
  if (!progress_.shapes) progress_.shapes = io.BeginList("shapes", 0, kMaxShapes, 2);
  const std::size_t begin = io.remaining();
  const auto spent = [&] { return begin - io.remaining(); };
  for (; *progress_.shapes > 0 && io.ok(); --*progress_.shapes) {
    if (spent() >= bytes) return false;
    if (progress_.shape == nullptr) BeginShape(io);
    if (!LargeOn(io, bytes - std::min(bytes, spent()))) return false;
    if (with_visuals_) {
      io.List("visuals", progress_.shape->visuals, 0, kMaxVisuals, kMinVisualBytes,
              [&](Visual& visual) { VisualOf(io, visual); });
    }
    shapes_.push_back(std::exchange(progress_.shape, nullptr));  // so that later ones may refer to it
    io.NextOfList();
  }
  io.EndList();
  return true;
}

void ShapeTable::BeginShape(PackReader& io) {
  std::uint8_t place = 0;
  io.Choice("form", place, static_cast<std::uint8_t>(std::variant_size_v<decltype(Shape::form)> - 1));
  progress_.shape = std::make_shared<Shape>();
  progress_.stage = 0;
  Become(progress_.shape->form, place);
  std::visit(
      [&](auto& form) {
        using T = std::decay_t<decltype(form)>;
        if constexpr (std::is_same_v<T, CompoundShape>) {
          io.List("children", form.children, 1, kMaxCompoundChildren, 57, [&](CompoundChild& child) {
            PoseOf(io, "pose", child.pose, kMaxExtent_m);
            Reference(io, "shape", child.shape);
            if (io.ok() && !IsConvex(*child.shape)) io.Fail("shape", "is no part of a compound");
            if (io.ok() && !child.shape->visuals.empty()) io.Fail("shape", "has visuals");
          });
        } else if constexpr (!std::is_same_v<T, TriangleMeshShape> && !std::is_same_v<T, HeightFieldShape>) {
          WriteOrRead(io, form);
        }
      },
      progress_.shape->form);
}

// Whether the shape under way is whole.
bool ShapeTable::LargeOn(PackReader& io, std::size_t bytes) {
  if (auto* mesh = std::get_if<TriangleMeshShape>(&progress_.shape->form)) return MeshOn(io, *mesh, bytes);
  if (auto* field = std::get_if<HeightFieldShape>(&progress_.shape->form)) return HeightsOn(io, *field, bytes);
  return true;
}

bool ShapeTable::MeshOn(PackReader& io, TriangleMeshShape& mesh, std::size_t bytes) {
  const std::size_t begin = io.remaining();
  if (progress_.stage == 0) {
    progress_.left = io.BeginList("vertices", 3, kMaxMeshVertices, 12);
    mesh.vertices.reserve(progress_.left);
    progress_.stage = 1;
  }
  if (progress_.stage == 1) {
    if (!io.ListOn(mesh.vertices, progress_.left, bytes, [&](Vec3f& v) { FormVisitor::Vertex(io, v); })) return false;
    progress_.left = io.BeginList("triangles", 1, kMaxMeshTriangles, 3);
    mesh.triangles.reserve(progress_.left);
    progress_.stage = 2;
  }
  return io.ListOn(mesh.triangles, progress_.left, bytes - std::min(bytes, begin - io.remaining()),
                   [&](auto& triangle) { FormVisitor::Triangle(io, triangle, mesh); });
}

bool ShapeTable::HeightsOn(PackReader& io, HeightFieldShape& field, std::size_t bytes) {
  if (progress_.stage == 0) {
    FormVisitor::Grid(io, field);
    progress_.left = io.BeginList("heights_m", 4, kMaxHeightSamples, 4);
    field.heights_m.reserve(progress_.left);
    progress_.stage = 1;
  }
  if (!io.ListOn(field.heights_m, progress_.left, bytes, [&](float& h) { FormVisitor::Height(io, h); })) return false;
  FormVisitor::CheckHeights(io, field);
  return true;
}

void ShapeTable::Reference(PackWriter& io, const char* field, const ShapePtr& shape) const {
  io.Number(field, by_place_.at(shape.get()), 0, size());
}

void ShapeTable::Reference(PackReader& io, const char* field, ShapePtr& shape) const {
  std::size_t place = 0;
  if (size() == 0) return io.Fail(field, "there are no shapes before it");
  io.Number(field, place, 0, size() - 1);
  if (io.ok()) shape = At(place);
}

}  // namespace tessera::packed
