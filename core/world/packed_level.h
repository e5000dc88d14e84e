// The packed form of a level in tiles: their list, which is a chunk of the packed scene, and the parts of one.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/world/level_tiles.h"
#include "core/world/packed_body.h"
#include "core/world/packed_io.h"
#include "core/world/packed_shape.h"
#include "core/world/scene.h"

namespace tessera::packed {

// Adds the shapes of every body, the player's and those of prefabs too.
void AddShapesOf(const Scene& scene, ShapeTable& shapes);

// `tiles`: the chunk of a scene in tiles. Shapes that the table has already are packed with it.
std::vector<std::uint8_t> WriteScene(const Scene& scene, ShapeTable& shapes, std::uint16_t version,
                                     std::vector<std::uint8_t> tiles);

// Bounds may reach beyond where bodies may be.
inline constexpr double kMaxTileCoordinate_m = kMaxCoordinate_m + 2 * kMaxExtent_m;
inline constexpr double kMaxTileEdge_m = 4 * kMaxCoordinate_m;
// Bytes of an entry of the list, and of a part, at least; and of a tile: its head, a shape and a body.
inline constexpr std::size_t kMinEntryBytes = 1 + 1 + 48 + 1 + 32, kMinPartBytes = 1 + kMinBodyBytes;

template <class Io, class N>
void SignedOf(Io& io, const char* field, N& number) {
  constexpr std::int64_t kZero = std::int64_t{1} << 31;
  std::uint32_t raised = 0;
  if constexpr (!Io::kReads) raised = static_cast<std::uint32_t>(number + kZero);
  io.Number(field, raised, 0, ~std::uint32_t{0});
  if constexpr (Io::kReads) number = static_cast<N>(raised - kZero);
}

template <class Io, class E>
void EntryOf(Io& io, E& entry) {
  SignedOf(io, "row", entry.square.row);
  SignedOf(io, "column", entry.square.column);
  io.Vector("bounds", entry.bounds.min, kMaxTileCoordinate_m);
  io.Vector("bounds", entry.bounds.max, kMaxTileCoordinate_m);
  io.Number("bytes", entry.bytes, kMinPartBytes, kMaxTile_bytes);
  io.Digest("sha256", entry.sha256);
  if constexpr (Io::kReads) {
    const auto& [min, max] = entry.bounds;
    if (io.ok() && !(min.x <= max.x && min.y <= max.y && min.z <= max.z)) io.Fail("bounds", "are inside out");
  }
}

template <class Io, class I>
void IndexOf(Io& io, I& index) {
  io.Real("edge_m", index.edge_m, kLeastTileEdge_m, kMaxTileEdge_m);
  io.List("tiles", index.tiles, 1, kMaxTiles, kMinEntryBytes, [&](auto& entry) {
    EntryOf(io, entry);
    if constexpr (Io::kReads) {
      const bool first = &entry == &index.tiles.front();
      if (io.ok() && !first && !((&entry - 1)->square < entry.square)) io.Fail("square", "does not ascend");
    }
  });
}

// Numbers below `most` that ascend, as the steps between them.
template <class Io, class L>
void AscendingOf(Io& io, const char* field, L& list, std::uint64_t most) {
  std::uint64_t next = 0;
  io.List(field, list, 1, static_cast<std::size_t>(most), 1, [&](auto& number) {
    std::uint64_t step = 0;
    if constexpr (!Io::kReads) step = number - next;
    io.Number("step", step, 0, most);
    if constexpr (Io::kReads) {
      if (io.ok() && next + step >= most) io.Fail("step", "leads too far");
      number = io.ok() ? static_cast<std::uint32_t>(next + step) : 0;
    }
    next = std::uint64_t{number} + 1;
  });
}

enum class PartKind : std::uint8_t { kWhole = 0, kOfMesh = 1, kOfField = 2 };

template <class Io, class C>
void MeshCutOf(Io& io, C& cut) {
  AscendingOf(io, "vertices", cut.vertices, kMaxMeshVertices);
  AscendingOf(io, "triangles", cut.triangles, kMaxMeshTriangles);
}

template <class Io, class C>
void FieldCutOf(Io& io, C& cut) {
  io.Number("columns", cut.columns, 2, kMaxHeightSamples);
  io.Number("rows", cut.rows, 2, kMaxHeightSamples);
  io.Number("first_column", cut.first_column, 0, kMaxHeightSamples);
  io.Number("first_row", cut.first_row, 0, kMaxHeightSamples);
}

// Checks that a part is in a tile, and its place goes with its shape.
inline void CheckPart(PackReader& io, const TilePart& part) {
  if (!io.ok()) return;
  const BodyDef& body = part.body;
  if (body.motion != Motion::kStatic || body.kinematic || body.path != nullptr || body.trigger) {
    return io.Fail("body", "is not of a level");
  }
  if (std::holds_alternative<PlaneShape>(body.shape->form)) return io.Fail("shape", "is a plane");
  if (part.mesh != nullptr) {
    const auto* mesh = std::get_if<TriangleMeshShape>(&body.shape->form);
    if (mesh == nullptr) return io.Fail("shape", "is no mesh");
    if (mesh->vertices.size() != part.mesh->vertices.size()) return io.Fail("vertices", "are not those of the shape");
    if (mesh->triangles.size() != part.mesh->triangles.size()) io.Fail("triangles", "are not those of the shape");
  } else if (part.field) {
    const FieldCut& cut = *part.field;
    const auto* field = std::get_if<HeightFieldShape>(&body.shape->form);
    if (field == nullptr) return io.Fail("shape", "is no height field");
    if (std::uint64_t{cut.columns} * cut.rows > kMaxHeightSamples) return io.Fail("columns", "are too many");
    const bool within = cut.first_column + field->columns <= cut.columns && cut.first_row + field->rows <= cut.rows;
    if (!within) return io.Fail("first_column", "leads out of the field");
    if (field->spacing_m * std::max(cut.columns, cut.rows) > kMaxExtent_m) io.Fail("spacing_m", "is too wide");
  }
}

inline void CutOf(PackWriter& io, const TilePart& part) {
  if (part.mesh != nullptr) MeshCutOf(io, *part.mesh);
  if (part.field) FieldCutOf(io, *part.field);
}
inline void CutOf(PackReader& io, TilePart& part, PartKind kind) {
  if (kind == PartKind::kOfMesh) {
    auto cut = std::make_shared<MeshCut>();
    MeshCutOf(io, *cut);
    part.mesh = std::move(cut);
  } else if (kind == PartKind::kOfField) {
    FieldCutOf(io, part.field.emplace());
  }
  CheckPart(io, part);
}

inline void PartOf(PackWriter& io, const TilePart& part, const Context& context) {
  const PartKind kind = part.mesh != nullptr ? PartKind::kOfMesh : part.field ? PartKind::kOfField : PartKind::kWhole;
  io.Choice("kind", kind, PartKind::kOfField);
  BodyOf(io, part.body, context);
  CutOf(io, part);
}
inline void PartOf(PackReader& io, TilePart& part, const Context& context) {
  PartKind kind = PartKind::kWhole;
  io.Choice("kind", kind, PartKind::kOfField);
  BodyOf(io, part.body, context);
  CutOf(io, part, kind);
}

}  // namespace tessera::packed
