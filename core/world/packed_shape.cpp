#include "core/world/packed_shape.h"

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
  return io.Take();
}

void ShapeTable::Add(const ShapePtr& shape) {
  if (by_place_.contains(shape.get())) return;
  if (const auto* compound = std::get_if<CompoundShape>(&shape->form)) {
    for (const CompoundChild& child : compound->children) Add(child.shape);
  }
  std::vector<std::uint8_t> bytes = BytesOf(*shape);
  const auto [at, fresh] = by_content_.emplace(std::string(AsText(bytes)), shapes_.size());
  by_place_.emplace(shape.get(), at->second);
  if (!fresh) return;
  shapes_.push_back(shape);
  bytes_.push_back(std::move(bytes));
}

void ShapeTable::Write(PackWriter& io) const {
  io.List("shapes", bytes_, 0, kMaxShapes, 2, [&](const std::vector<std::uint8_t>& bytes) { io.Raw(bytes); });
}

void ShapeTable::Read(PackReader& io) {
  shapes_.clear();
  std::vector<ShapePtr> all;
  // A body, a player and members of prefabs have one each, and a compound's parts are shapes of their own.
  io.List("shapes", all, 0, kMaxShapes, 2, [&](ShapePtr& made) {
    std::uint8_t place = 0;
    io.Choice("form", place, static_cast<std::uint8_t>(std::variant_size_v<decltype(Shape::form)> - 1));
    auto shape = std::make_shared<Shape>();
    Become(shape->form, place);
    std::visit(
        [&](auto& form) {
          if constexpr (std::is_same_v<std::decay_t<decltype(form)>, CompoundShape>) {
            io.List("children", form.children, 1, kMaxCompoundChildren, 57, [&](CompoundChild& child) {
              PoseOf(io, "pose", child.pose, kMaxExtent_m);
              Reference(io, "shape", child.shape);
              if (io.ok() && !IsConvex(*child.shape)) io.Fail("shape", "is no part of a compound");
            });
          } else {
            WriteOrRead(io, form);
          }
        },
        shape->form);
    shapes_.push_back(std::move(shape));  // so that later ones may refer to it
    made = shapes_.back();
  });
}

void ShapeTable::Reference(PackWriter& io, const char* field, const ShapePtr& shape) const {
  io.Number(field, by_place_.at(shape.get()), 0, shapes_.size());
}

void ShapeTable::Reference(PackReader& io, const char* field, ShapePtr& shape) const {
  std::size_t place = 0;
  if (shapes_.empty()) return io.Fail(field, "there are no shapes before it");
  io.Number(field, place, 0, shapes_.size() - 1);
  if (io.ok()) shape = shapes_[place];
}

}  // namespace tessera::packed
