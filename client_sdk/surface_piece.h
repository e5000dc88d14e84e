// Pieces of large surfaces: the part of a mesh or of a height field about a place, as a small shape of its own, so that
// prediction need not build a million triangles to stand on ten.
//
//   MeshBlocks blocks(mesh);
//   while (!blocks.Survey(budget)) ...                       // once a mesh
//   MeshPiece piece(mesh, blocks, {.centre = local, .reach_m = 12, .least_m = 4});
//   while (!piece.Search(budget)) ...                        // once a place
//   ShapePtr shape = piece.Make(budget);                     // null: nothing of the mesh is there
//
// A piece has the mesh's triangles in the mesh's order and all that meet at a place inside it, so contacts there are
// those of the whole mesh. At its rim it has borders that the mesh has not, and a part of a closed mesh is a sheet.
// Thread rule: one thread at a time; shapes are immutable.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "client_sdk/work_budget.h"
#include "core/world/bounds.h"
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

class MeshPiece {
 public:
  // `blocks` are known whole, and both outlive it.
  MeshPiece(const TriangleMeshShape& mesh, const MeshBlocks& blocks, const Reach& where);

  // Goes on; true once all triangles are found.
  bool Search(WorkBudget& budget);
  // So far from the centre, along each axis, the piece has all that the mesh has.
  double reach_m() const { return where_.reach_m; }
  std::size_t triangles() const { return found_.size(); }
  ShapePtr Make(WorkBudget& budget) const;

 private:
  Aabb Box() const;
  bool Meets(std::uint32_t triangle, const Aabb& box) const;
  bool Narrow(WorkBudget& budget);

  const TriangleMeshShape& mesh_;
  const MeshBlocks& blocks_;
  Reach where_;
  std::size_t next_block_ = 0, next_found_ = 0, kept_ = 0;
  bool narrows_ = false;
  std::vector<std::uint32_t> found_;
};

// The samples of a height field about a place, with the place of their middle in the field's frame.
struct FieldPiece {
  ShapePtr shape;  // null: the field is elsewhere
  Vec3d offset{};
  double reach_m = std::numeric_limits<double>::infinity();  // as MeshPiece's
};
FieldPiece PieceOf(const HeightFieldShape& field, const Reach& where, WorkBudget& budget);

}  // namespace tessera::client
