// Tiles of a level: the static bodies of a large scene in squares on the ground, so that a client loads those that its
// view reaches, and nobody has to have all of it.
//
// Each triangle of a large mesh, each cell of a large height field and each other static body is in exactly one tile:
// that of the square which holds the middle of its bounds. So a tile reaches over the rim of its square, and its bounds
// say how far. Parts know where they were in their surface, so that whoever has the tiles about a place has the
// surface there, in its own order and to the bit. Bodies that move, have a path or a joint, are triggers, planes or
// wider than a square are in no tile; nor is a mesh or height field that more than two bodies have, or that is drawn by
// meshes of a file, unless it fits into one square.
//
//   std::optional<LevelCut> cut = CutLevel(*scene);   // nothing: the level is small, or has no two squares
//   for (const auto& [square, tile] : cut->tiles) ...
//
// Thread rule: pure functions, any thread.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/world/bounds.h"
#include "core/world/scene.h"
#include "core/world/sha256.h"

namespace tessera {

// A level of fewer bytes is not cut: it is there within a second.
inline constexpr std::size_t kTiledFrom_bytes = std::size_t{1} << 20;
// Squares grow until tiles have so many bytes in the mean: one takes an eighth of a second to come, and a list of them
// is a two-thousandth of what they hold.
inline constexpr std::size_t kMeanTile_bytes = std::size_t{128} << 10;
// The least edge of a square, m; each further one is twice as long. Less than what prediction needs about a body.
inline constexpr double kLeastTileEdge_m = 8;
// Tiles of a level: their list has some 100 bytes for each. And bytes of one: four million triangles on one square.
inline constexpr std::size_t kMaxTiles = 65536, kMaxTile_bytes = std::size_t{128} << 20;

// The place of a part in a mesh: numbers of its vertices and triangles there, ascending.
struct MeshCut {
  std::vector<std::uint32_t> vertices, triangles;
};
// The place of a part in a height field: its first sample, and the samples of the whole.
struct FieldCut {
  std::uint32_t columns = 0, rows = 0, first_column = 0, first_row = 0;
};

struct TilePart {
  BodyDef body;                         // its shape is the part; where it stands is where the whole stands
  std::shared_ptr<const MeshCut> mesh;  // where a part of a mesh is in it
  std::optional<FieldCut> field{};      // and a part of a height field
};
struct Tile {
  std::vector<TilePart> parts;  // ascending by body
};

// The pose in which the shape of a part is to be drawn: a height field is centred, and a part of it has another middle.
Pose PoseOf(const TilePart& part);

struct TileSquare {
  std::int32_t row = 0, column = 0;  // z from row * edge on, x from column * edge on
  friend auto operator<=>(const TileSquare&, const TileSquare&) = default;
};

struct LevelCut {
  double edge_m = 0;
  std::map<TileSquare, Tile> tiles;
  std::vector<BodyId> in_tiles;  // ascending
};

// Nothing if the level is small, or would be one tile. The same scene gives the same tiles.
std::optional<LevelCut> CutLevel(const Scene& scene);

// The bounds of all that a tile holds, which has parts.
Aabb BoundsOf(const Tile& tile);

// The list of a level's tiles, for whoever loads them.
struct TileEntry {
  TileSquare square;
  Aabb bounds;
  std::uint64_t bytes = 0;  // its packed form's
  Sha256::Digest sha256{};
};
struct LevelIndex {
  double edge_m = 0;
  std::vector<TileEntry> tiles;  // ascending by square
  std::vector<ShapePtr> shapes;  // which tiles refer to
};

}  // namespace tessera
