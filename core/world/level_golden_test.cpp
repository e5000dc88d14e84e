// The packed form of a level in tiles, as files hold it: a program that packs otherwise, or reads these no more, does
// not understand clients and regions of the same version of the form.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/world/byte_view.h"
#include "core/world/level_tiles.h"
#include "core/world/packed_scene.h"
#include "core/world/sha256.h"
#include "core/world/testing/same_scene.h"
#include "core/world/testing/tiled_level.h"

namespace tessera {
namespace {

constexpr char kSceneFile[] = "tiled_level.tsrs", kTileFile[] = "tiled_level_3.tsrt";

std::string GoldenFile(const std::string& name) { return TESSERA_SOURCE_DIR "/core/world/testing/golden/" + name; }

std::vector<std::uint8_t> ReadGolden(const std::string& name) {
  std::ifstream in(GoldenFile(name), std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// With TESSERA_WRITE_GOLDEN the file is written instead: only when the version of the form changes.
void ExpectGolden(const std::string& name, std::span<const std::uint8_t> bytes) {
  if (std::getenv("TESSERA_WRITE_GOLDEN") != nullptr) {
    std::ofstream(GoldenFile(name), std::ios::binary) << std::string(AsText(bytes));
  }
  EXPECT_TRUE(std::ranges::equal(ReadGolden(name), bytes)) << name << " differs";
}

// The scene has the list of all tiles, with their sizes and hashes: so the bytes of all are held.
TEST(LevelGoldenTest, ALevelInTilesIsPackedAsEver) {
  const PackedLevel level = PackLevel(TiledLevel());
  ASSERT_EQ(level.tiles.size(), kTiledLevelTiles);
  ExpectGolden(kSceneFile, level.scene);
  ExpectGolden(kTileFile, level.tiles[kGoldenTile]);
}

TEST(LevelGoldenTest, FilesOfThisVersionAreReadFieldByField) {
  const std::vector<std::uint8_t> scene_bytes = ReadGolden(kSceneFile), tile_bytes = ReadGolden(kTileFile);
  SceneUnpacker unpacker(scene_bytes);
  while (!unpacker.Go(1 << 20)) {
  }
  const auto base = unpacker.Take();
  ASSERT_TRUE(base.ok()) << base.status();
  const auto index = unpacker.index();
  ASSERT_NE(index, nullptr);
  ASSERT_EQ(index->tiles.size(), kTiledLevelTiles);
  Sha256 sum;
  sum.Add(tile_bytes);
  EXPECT_EQ(index->tiles[kGoldenTile].sha256, sum.Finish());
  EXPECT_EQ(index->tiles[kGoldenTile].square, kGoldenSquare);
  const auto tile = UnpackTile(tile_bytes, *index, **base);
  ASSERT_TRUE(tile.ok()) << tile.status();

  const Scene scene = TiledLevel();
  const auto cut = CutLevel(scene);
  ASSERT_TRUE(cut.has_value());
  EXPECT_EQ(index->edge_m, cut->edge_m);
  const Tile& same = cut->tiles.at(kGoldenSquare);
  ASSERT_EQ((*tile)->parts.size(), same.parts.size());
  Scene read, made;
  int of_mesh = 0, of_field = 0, drawn = 0;
  for (std::size_t i = 0; i < same.parts.size(); ++i) {
    const TilePart &a = (*tile)->parts[i], &b = same.parts[i];
    read.bodies.push_back(a.body);
    made.bodies.push_back(b.body);
    ASSERT_EQ(a.mesh != nullptr, b.mesh != nullptr);
    ASSERT_EQ(a.field.has_value(), b.field.has_value());
    if (a.mesh != nullptr) {
      ++of_mesh;
      EXPECT_EQ(a.mesh->vertices, b.mesh->vertices);
      EXPECT_EQ(a.mesh->triangles, b.mesh->triangles);
    }
    if (a.field) {
      ++of_field;
      EXPECT_EQ(a.field->columns, b.field->columns);
      EXPECT_EQ(a.field->rows, b.field->rows);
      EXPECT_EQ(a.field->first_column, b.field->first_column);
      EXPECT_EQ(a.field->first_row, b.field->first_row);
    }
    drawn += a.body.shape->visuals.empty() ? 0 : 1;
  }
  EXPECT_EQ(SceneDifference::Between(read, made), "");
  EXPECT_EQ(of_mesh, 1);
  EXPECT_EQ(of_field, 1);
  EXPECT_EQ(drawn, 1);
  EXPECT_EQ(same.parts.size(), 4u) << "and a rock whose form is the scene's";
}

}  // namespace
}  // namespace tessera
