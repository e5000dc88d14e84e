// Pieces of large surfaces: the part of a mesh or of a height field about a place, as a small shape of its own, so that
// prediction need not build a million triangles to stand on ten.
//
//   MeshBlocks blocks(mesh);
//   while (!blocks.Survey(budget)) ...                       // once a mesh
//   MeshPiece piece(mesh, blocks, {.centre = local, .reach_m = 12, .least_m = 4});
//   while (!piece.Search(budget)) ...                        // once a place
//   ShapePtr shape = piece.Make(budget);                     // null: nothing of the mesh is there
//
// A surface may come in parts, of tiles of a level: a piece is made of those that are here, as if they were the whole.
//
// A piece has the mesh's triangles in the mesh's order and all that meet at a place inside it, so contacts there are
// those of the whole mesh. At its rim it has borders that the mesh has not, and a part of a closed mesh is a sheet.
// Thread rule: one thread at a time; shapes are immutable.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "client_sdk/work_budget.h"
#include "core/world/bounds.h"
#include "core/world/level_tiles.h"
#include "core/world/scene.h"

namespace tessera::client {

// Triangles of a piece at most, as far as its least reach allows: about a millisecond to build.
inline constexpr std::size_t kMostPieceTriangles = 1024;
// Units for building one triangle of a shape for collision: topology and tree take a microsecond.
inline constexpr std::int64_t kUnitsToBuildATriangle = 100;

// A cube about a place, in the surface's own frame.
struct Reach {
  Vec3d centre{};
  double reach_m = 0;  // half an edge
  double least_m = 0;  // it is never made smaller than this
};

// The bounds of each run of triangles, in the mesh's order: most meshes have neighbours near each other there.
class MeshBlocks {
 public:
  static constexpr std::size_t kTriangles = 128;

  explicit MeshBlocks(const TriangleMeshShape& mesh) : mesh_(&mesh) {}
  // Goes on; true once all blocks are known.
  bool Survey(WorkBudget& budget);
  const std::vector<Aabb>& blocks() const { return blocks_; }

 private:
  const TriangleMeshShape* mesh_;
  std::vector<Aabb> blocks_;
};

// A mesh, or a part of one: all of it outlives who is given it.
struct MeshSource {
  const TriangleMeshShape* mesh = nullptr;
  const MeshBlocks* blocks = nullptr;  // known whole
  const MeshCut* cut = nullptr;        // null: it is the whole
};

class MeshPiece {
 public:
  // `parts`: of one mesh.
  MeshPiece(std::vector<MeshSource> parts, const Reach& where) : parts_(std::move(parts)), where_(where) {}
  MeshPiece(const TriangleMeshShape& mesh, const MeshBlocks& blocks, const Reach& where)
      : MeshPiece({{&mesh, &blocks}}, where) {}

  // Goes on; true once all triangles are found.
  bool Search(WorkBudget& budget);
  // So far from the centre, along each axis, the piece has all that the mesh has.
  double reach_m() const { return where_.reach_m; }
  std::size_t triangles() const { return found_.size(); }
  ShapePtr Make(WorkBudget& budget) const;

 private:
  struct Found {
    std::uint32_t part = 0, triangle = 0;
  };
  Aabb Box() const;
  bool Meets(Found found, const Aabb& box) const;
  bool SearchPart(const MeshSource& part, const Aabb& box, WorkBudget& budget);
  bool Narrow(WorkBudget& budget);

  std::vector<MeshSource> parts_;
  Reach where_;
  std::size_t next_part_ = 0, next_block_ = 0, next_found_ = 0, kept_ = 0;
  bool narrows_ = false;
  std::vector<Found> found_;
};

// The samples of a height field about a place, with the place of their middle in the field's frame.
struct FieldPiece {
  ShapePtr shape;  // null: the field is elsewhere
  Vec3d offset{};
  double reach_m = std::numeric_limits<double>::infinity();  // as MeshPiece's
};
// A height field, or a part of one.
struct FieldSource {
  const HeightFieldShape* field = nullptr;
  const FieldCut* cut = nullptr;  // null: it is the whole
};
// `parts`: of one field, at least one, which have all that is within reach on the ground. Those that do not fit the
// first one are passed over.
FieldPiece PieceOf(const std::vector<FieldSource>& parts, const Reach& where, WorkBudget& budget);
inline FieldPiece PieceOf(const HeightFieldShape& field, const Reach& where, WorkBudget& budget) {
  return PieceOf({{&field}}, where, budget);
}

}  // namespace tessera::client
