// A tile of a level off the wire or out of a cache. One that is accepted packs to bytes that are accepted again and
// stay.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/world/packed_scene.h"
#include "tests/fuzz/planted_seed.h"

using namespace tessera;

namespace {

struct Level {
  Level() {
    index.edge_m = 8;
    index.shapes = {std::make_shared<const Shape>(Shape{SphereShape{1}})};
  }
  // A part of a mesh, one of a height field, and a ball whose shape is the scene's.
  Tile MakeTile() const {
    Tile tile;
    TriangleMeshShape mesh{.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}}, .triangles = {{0, 1, 2}}};
    HeightFieldShape field{.columns = 2, .rows = 2, .spacing_m = 1, .heights_m = {0, 1, 0, 1}};
    for (const ShapePtr& shape :
         {std::make_shared<const Shape>(Shape{mesh}), std::make_shared<const Shape>(Shape{field}), index.shapes[0]}) {
      TilePart& part = tile.parts.emplace_back();
      part.body.id = BodyId(tile.parts.size());
      part.body.shape = shape;
      part.body.motion = Motion::kStatic;
      part.body.mass_kg = 0;
    }
    tile.parts[0].mesh = std::make_shared<const MeshCut>(MeshCut{{3, 900, 901}, {77}});
    tile.parts[1].field = FieldCut{10, 20, 5, 6};
    return tile;
  }

  Scene scene;
  LevelIndex index;
};

const Level& TheLevel() {
  static const Level level;
  return level;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  const Level& level = TheLevel();
  const std::vector<std::uint8_t> packed = PackTile(level.MakeTile(), level.index, level.scene);
  if (!UnpackTile(packed, level.index, level.scene).ok()) std::abort();
  fuzz::PlantSeed(*argc, *argv, "tile", packed);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Level& level = TheLevel();
  const auto tile = UnpackTile({data, size}, level.index, level.scene);
  if (!tile.ok()) return 0;
  const std::vector<std::uint8_t> packed = PackTile(**tile, level.index, level.scene);
  const auto again = UnpackTile(packed, level.index, level.scene);
  if (!again.ok() || PackTile(**again, level.index, level.scene) != packed) std::abort();
  for (const TilePart& part : (*tile)->parts) (void)PoseOf(part);
  (void)BoundsOf(**tile);
  return 0;
}
