// The packed form of shapes: a table, in which those that are alike stand once and a compound comes after its parts.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/world/byte_view.h"
#include "core/world/packed_io.h"
#include "core/world/scene.h"
#include "core/world/sha256.h"
#include "core/world/shape_checks.h"

namespace tessera::packed {

template <class Io>
void Extent(Io& io, const char* field, auto& v) {
  io.Real(field, v, kMinExtent_m, kMaxExtent_m);
}

struct FormVisitor {
  template <class Io, class S>
  static void Box(Io& io, S& s) {
    Extent(io, "half_extents_m", s.half_extents_m.x);
    Extent(io, "half_extents_m", s.half_extents_m.y);
    Extent(io, "half_extents_m", s.half_extents_m.z);
  }
  template <class Io, class S>
  static void Round(Io& io, S& s) {
    Extent(io, "radius_m", s.radius_m);
    Extent(io, "half_height_m", s.half_height_m);
  }
  template <class Io, class S>
  static void Cone(Io& io, S& s) {
    Extent(io, "radius_m", s.radius_m);
    Extent(io, "height_m", s.height_m);
  }
  template <class Io, class S>
  static void Hull(Io& io, S& s) {
    io.List("points", s.points, 4, kMaxHullPoints, 12, [&](auto& p) { io.Vector("point", p, kMaxExtent_m); });
    if constexpr (Io::kReads) {
      if (io.ok() && ThicknessOf(s.points) < LeastThicknessOf(s.points)) io.Fail("points", "lie in one plane");
    }
  }
  template <class Io, class S>
  static void Mesh(Io& io, S& s) {
    io.List("vertices", s.vertices, 3, kMaxMeshVertices, 12, [&](auto& v) { Vertex(io, v); });
    io.List("triangles", s.triangles, 1, kMaxMeshTriangles, 3, [&](auto& triangle) { Triangle(io, triangle, s); });
  }
  template <class Io, class V>
  static void Vertex(Io& io, V& v) {
    io.Vector("vertex", v, kMaxExtent_m);
  }
  template <class Io, class T, class S>
  static void Triangle(Io& io, T& triangle, const S& s) {
    const std::uint64_t last = s.vertices.empty() ? 0 : s.vertices.size() - 1;
    bool read = false;
    if constexpr (Io::kReads) read = io.Numbers(triangle, last);
    for (auto& corner : triangle) {
      if (!read) io.Number("corner", corner, 0, last);
    }
    if constexpr (Io::kReads) {
      const auto& v = s.vertices;
      if (io.ok() && !HasArea(v[triangle[0]], v[triangle[1]], v[triangle[2]])) io.Fail("area", "there is none");
    }
  }
  template <class Io, class S>
  static void Heights(Io& io, S& s) {
    Grid(io, s);
    io.List("heights_m", s.heights_m, 4, kMaxHeightSamples, 4, [&](auto& h) { Height(io, h); });
    if constexpr (Io::kReads) CheckHeights(io, s);
  }
  template <class Io, class S>
  static void Grid(Io& io, S& s) {
    io.Number("columns", s.columns, 2, kMaxHeightSamples);
    io.Number("rows", s.rows, 2, kMaxHeightSamples);
    Extent(io, "spacing_m", s.spacing_m);
    if constexpr (Io::kReads) {
      if (io.ok() && s.spacing_m * std::max(s.columns, s.rows) > kMaxExtent_m) io.Fail("spacing_m", "is too wide");
    }
  }
  template <class Io, class H>
  static void Height(Io& io, H& h) {
    io.Real("height", h, -kMaxExtent_m, kMaxExtent_m);
  }
  static void CheckHeights(PackReader& io, const HeightFieldShape& s) {
    if (io.ok() && std::uint64_t{s.columns} * s.rows != s.heights_m.size()) io.Fail("heights_m", "are not all");
  }
  template <class Io, class S>
  static void Plane(Io& io, S& s) {
    io.Vector("normal", s.normal, 1 + kUnitTolerance);
    io.Real("offset_m", s.offset_m, -kMaxCoordinate_m, kMaxCoordinate_m);
    if constexpr (Io::kReads) {
      if (io.ok() && std::abs(Length(s.normal) - 1) > kUnitTolerance) io.Fail("normal", "its length is not 1");
    }
  }
};

template <class Io, class V>
void VisualOf(Io& io, V& visual) {
  io.Text("sha256", visual.sha256, kSha256Digits);
  io.Number("mesh", visual.mesh, 0, ~std::uint32_t{0});
  PoseOf(io, "pose", visual.pose, kMaxExtent_m);
  for (auto* part : {&visual.scale.x, &visual.scale.y, &visual.scale.z}) {
    io.Real("scale", *part, -kMaxVisualScale, kMaxVisualScale);
    if constexpr (Io::kReads) {
      if (io.ok() && std::abs(*part) < kMinVisualScale) io.Fail("scale", "is too small");
    }
  }
  if constexpr (Io::kReads) {
    if (io.ok() && !IsSha256Hex(visual.sha256)) io.Fail("sha256", "is no hash");
  }
}

// Shapes of one scene, parts of compounds included.
inline constexpr std::size_t kMaxShapes = 2 * kMaxBodies;

// Bytes of a visual: its hash with the length, number, pose and scale.
inline constexpr std::size_t kMinVisualBytes = 65 + 1 + 56 + 24;

// Whether a part of a compound may have this form.
inline bool IsConvex(const Shape& shape) { return shape.form.index() <= 5; }
inline bool IsForStaticBodies(const Shape& shape) { return shape.form.index() >= 7; }

// Writes and reads shapes as their places in the table.
class ShapeTable {
 public:
  // Without visuals it writes none, and reads none: a scene that has none is packed as before there were any.
  explicit ShapeTable(bool with_visuals) : with_visuals_(with_visuals) {}
  // On top of another table, whose shapes have the first places: a writer's, or what a reader has read. They outlive
  // it. With visuals.
  explicit ShapeTable(const ShapeTable* below) : with_visuals_(true), below_(below->shapes_), below_table_(below) {}
  explicit ShapeTable(std::span<const ShapePtr> below) : with_visuals_(true), below_(below) {}

  // For a writer: adds the shape, and what it is made of, if it is not there yet; its place.
  std::size_t Add(const ShapePtr& shape);
  std::size_t size() const { return below_.size() + shapes_.size(); }
  std::vector<ShapePtr> TakeShapes() { return std::move(shapes_); }

  void Write(PackWriter& io) const;
  // Reads about `bytes`; true once it has come to the end, or failed.
  bool ReadOn(PackReader& io, std::size_t bytes);

  void Reference(PackWriter& io, const char* field, const ShapePtr& shape) const;
  void Reference(PackReader& io, const char* field, ShapePtr& shape) const;

 private:
  std::vector<std::uint8_t> BytesOf(const Shape& shape) const;
  const ShapePtr& At(std::size_t place) const {
    return place < below_.size() ? below_[place] : shapes_[place - below_.size()];
  }
  void BeginShape(PackReader& io);
  bool LargeOn(PackReader& io, std::size_t bytes);
  bool MeshOn(PackReader& io, TriangleMeshShape& mesh, std::size_t bytes);
  bool HeightsOn(PackReader& io, HeightFieldShape& field, std::size_t bytes);

  // A reader's place. `stage` and `left` belong to a large shape under way.
  struct Progress {
    std::optional<std::size_t> shapes{};
    std::shared_ptr<Shape> shape{};
    int stage = 0;
    std::size_t left = 0;
  };

  bool with_visuals_;
  std::span<const ShapePtr> below_;
  const ShapeTable* below_table_ = nullptr;  // for a writer
  std::vector<ShapePtr> shapes_;
  Progress progress_;
  std::vector<std::vector<std::uint8_t>> bytes_;             // for a writer
  std::unordered_map<const Shape*, std::size_t> by_place_;   // for a writer
  std::unordered_map<std::string, std::size_t> by_content_;  // for a writer
};

}  // namespace tessera::packed
