#include "core/world/level_tiles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"
#include "core/world/testing/same_scene.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using TileBytes = std::vector<std::uint8_t>;

double GroundAt(double x, double z) { return 3 * std::sin(x * 0.07) * std::cos(z * 0.05); }

// `cells` squares of a metre each way, two triangles each, about the origin.
Shape HillMesh(int cells) {
  TriangleMeshShape mesh;
  const auto side = static_cast<std::uint32_t>(cells + 1);
  for (int z = 0; z <= cells; ++z) {
    for (int x = 0; x <= cells; ++x) {
      const double at_x = x - cells / 2.0, at_z = z - cells / 2.0;
      mesh.vertices.push_back(Vec3f(Vec3d{at_x, GroundAt(at_x, at_z), at_z}));
    }
  }
  for (std::uint32_t z = 0; z + 1 < side; ++z) {
    for (std::uint32_t x = 0; x + 1 < side; ++x) {
      const std::uint32_t i = z * side + x;
      mesh.triangles.push_back({i, i + side, i + 1});
      mesh.triangles.push_back({i + 1, i + side, i + side + 1});
    }
  }
  return Shape{std::move(mesh)};
}

Shape FieldOfHills(std::uint32_t columns, std::uint32_t rows) {
  HeightFieldShape field{.columns = columns, .rows = rows, .spacing_m = 0.5, .heights_m = {}};
  for (std::uint32_t i = 0; i < columns * rows; ++i) {
    field.heights_m.push_back(static_cast<float>(GroundAt(i % columns, i / columns)));
  }
  return Shape{std::move(field)};
}

BodyDef& AddStatic(Scene& scene, const ShapePtr& shape, Vec3d place = {}) {
  BodyDef& def = scene.bodies.emplace_back();
  def.id = BodyId(scene.bodies.size());
  def.shape = shape;
  def.motion = Motion::kStatic;
  def.mass_kg = 0;
  def.initial.position = place;
  return def;
}
BodyDef& AddStatic(Scene& scene, Shape shape, Vec3d place = {}) {
  return AddStatic(scene, std::make_shared<const Shape>(std::move(shape)), place);
}

Scene EmptyScene() {
  Scene scene;
  scene.name = "level";
  scene.bounds = {{-600, -50, -600}, {600, 50, 600}};
  return scene;
}

// A turned mesh, a turned height field, a thousand rocks of one form, and all that stays out of tiles.
Scene LargeLevel() {
  Scene scene = EmptyScene();
  AddStatic(scene, HillMesh(200), {30, 1, -20}).initial.orientation = Normalized(Quatd{0.1, 0.7, -0.2, 0.6});
  AddStatic(scene, FieldOfHills(401, 301), {-50, -3, 60}).initial.orientation = Normalized(Quatd{0, 0.3, 0, 0.9});
  const auto rock = std::make_shared<const Shape>(HillMesh(5));
  for (int i = 0; i < 1000; ++i) AddStatic(scene, rock, {(i % 40) * 10.0 - 200, 4, (i / 40) * 10.0 - 120});
  AddStatic(scene, Shape{BoxShape{{1, 2, 3}}}, {7, 7, 7}).name = "chest";
  AddStatic(scene, Shape{PlaneShape{}});
  AddStatic(scene, Shape{SphereShape{2}}).trigger = true;
  AddStatic(scene, Shape{BoxShape{{400, 1, 400}}}, {0, -40, 0}).name = "floor";
  AddStatic(scene, Shape{SphereShape{1}}, {3, 20, 3}).name = "hook";
  const BodyId hook = scene.bodies.back().id;
  BodyDef& ball = AddStatic(scene, Shape{SphereShape{0.5}}, {3, 15, 3});
  ball.motion = Motion::kDynamic;
  ball.mass_kg = 2;
  JointDef& joint = scene.joints.emplace_back();
  joint.id = JointId(1);
  joint.body_a = hook;
  joint.body_b = ball.id;
  return scene;
}

struct Unpacked {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const LevelIndex> index;
};
Unpacked UnpackBase(const TileBytes& bytes) {
  SceneUnpacker unpacker(bytes);
  while (!unpacker.Go(1000)) {
  }
  auto scene = unpacker.Take();
  EXPECT_TRUE(scene.ok()) << scene.status();
  return {scene.ok() ? *scene : nullptr, unpacker.index()};
}

TEST(LevelTilesTest, ASmallLevelIsPackedAsBeforeThereWereTiles) {
  Scene scene = EmptyScene();
  AddStatic(scene, HillMesh(100));
  ASSERT_FALSE(CutLevel(scene).has_value());
  const PackedLevel level = PackLevel(scene);
  EXPECT_TRUE(level.tiles.empty());
  EXPECT_EQ(level.scene, PackScene(scene));
  EXPECT_EQ(UnpackBase(level.scene).index, nullptr);
}

// Two million triangles.
TEST(LevelTilesTest, EachTriangleOfAMeshIsInExactlyOneTileAndAllMakeTheMesh) {
  Scene scene = EmptyScene();
  AddStatic(scene, HillMesh(1000));
  const auto& whole = std::get<TriangleMeshShape>(scene.bodies[0].shape->form);
  const auto cut = CutLevel(scene);
  ASSERT_TRUE(cut.has_value());
  EXPECT_GT(cut->tiles.size(), 50u);
  TriangleMeshShape again;
  again.vertices.resize(whole.vertices.size());
  again.triangles.resize(whole.triangles.size());
  std::vector<int> times(whole.triangles.size(), 0);
  for (const auto& [square, tile] : cut->tiles) {
    ASSERT_EQ(tile.parts.size(), 1u);
    const TilePart& part = tile.parts[0];
    ASSERT_NE(part.mesh, nullptr);
    const auto& mesh = std::get<TriangleMeshShape>(part.body.shape->form);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) again.vertices[part.mesh->vertices[i]] = mesh.vertices[i];
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      ++times[part.mesh->triangles[i]];
      for (std::size_t corner = 0; corner < 3; ++corner) {
        again.triangles[part.mesh->triangles[i]][corner] = part.mesh->vertices[mesh.triangles[i][corner]];
      }
    }
  }
  EXPECT_THAT(times, ::testing::Each(1));
  EXPECT_EQ(again.vertices, whole.vertices);
  EXPECT_EQ(again.triangles, whole.triangles);
}

TEST(LevelTilesTest, EachCellOfAHeightFieldIsInExactlyOneTile) {
  Scene scene = EmptyScene();
  AddStatic(scene, FieldOfHills(900, 700)).initial.orientation = Normalized(Quatd{0.2, 0.4, 0.1, 0.8});
  const auto& whole = std::get<HeightFieldShape>(scene.bodies[0].shape->form);
  const auto cut = CutLevel(scene);
  ASSERT_TRUE(cut.has_value());
  std::vector<int> times(std::size_t{whole.columns} * whole.rows, 0);
  for (const auto& [square, tile] : cut->tiles) {
    for (const TilePart& part : tile.parts) {
      ASSERT_TRUE(part.field.has_value());
      const auto& field = std::get<HeightFieldShape>(part.body.shape->form);
      for (std::uint32_t row = 0; row < field.rows; ++row) {
        for (std::uint32_t column = 0; column < field.columns; ++column) {
          const std::size_t at =
              std::size_t{part.field->first_row + row} * whole.columns + part.field->first_column + column;
          ASSERT_EQ(field.heights_m[std::size_t{row} * field.columns + column], whole.heights_m[at]);
          if (row + 1 < field.rows && column + 1 < field.columns) ++times[at];
        }
      }
      // A part is drawn where it was in the whole.
      const Pose pose = PoseOf(part), all{scene.bodies[0].initial.position, scene.bodies[0].initial.orientation};
      const Vec3d corner{(field.columns - 1) / -2.0 * field.spacing_m, 0, (field.rows - 1) / -2.0 * field.spacing_m};
      const Vec3d there{(part.field->first_column - (whole.columns - 1) / 2.0) * whole.spacing_m, 0,
                        (part.field->first_row - (whole.rows - 1) / 2.0) * whole.spacing_m};
      EXPECT_LT(
          Length(pose.position + Rotate(pose.orientation, corner) - all.position - Rotate(all.orientation, there)),
          1e-9);
    }
  }
  for (std::uint32_t row = 0; row + 1 < whole.rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < whole.columns; ++column) {
      ASSERT_EQ(times[std::size_t{row} * whole.columns + column], 1) << row << ", " << column;
    }
  }
}

TEST(LevelTilesTest, WhatMovesIsJointedEndlessOrWideStaysWithTheScene) {
  const Scene scene = LargeLevel();
  const PackedLevel level = PackLevel(scene);
  ASSERT_GT(level.tiles.size(), 4u);
  const Unpacked base = UnpackBase(level.scene);
  ASSERT_NE(base.index, nullptr);
  std::set<BodyId> stays, tiled;
  for (const BodyDef& def : base.scene->bodies) stays.insert(def.id);
  std::size_t rocks = 0, chests = 0;
  for (std::size_t i = 0; i < level.tiles.size(); ++i) {
    const auto tile = UnpackTile(level.tiles[i], *base.index, *base.scene);
    ASSERT_TRUE(tile.ok()) << tile.status();
    for (const TilePart& part : (*tile)->parts) {
      EXPECT_FALSE(stays.contains(part.body.id));
      tiled.insert(part.body.id);
      rocks += part.mesh == nullptr && !part.field && part.body.name.empty() ? 1 : 0;
      chests += part.body.name == "chest" ? 1 : 0;
    }
  }
  EXPECT_EQ(rocks, 1000u);
  EXPECT_EQ(chests, 1u);
  EXPECT_EQ(tiled.size(), 1003u);
  EXPECT_EQ(stays.size(), 5u);
  EXPECT_EQ(stays.size() + tiled.size(), scene.bodies.size());
  EXPECT_EQ(base.scene->joints.size(), 1u);
}

// The bytes that tiles and their list have together, against those of the scene as one.
TEST(LevelTilesTest, AShapeThatManyTilesHaveIsSentOnce) {
  const Scene scene = LargeLevel();
  const PackedLevel level = PackLevel(scene);
  std::size_t bytes = level.scene.size();
  for (const TileBytes& tile : level.tiles) bytes += tile.size();
  EXPECT_LT(static_cast<double>(bytes), 1.2 * static_cast<double>(PackScene(scene).size()));
}

TEST(LevelTilesTest, TilesComeBackFieldByFieldAndAreThoseOfTheList) {
  const Scene scene = LargeLevel();
  const PackedLevel level = PackLevel(scene);
  EXPECT_EQ(PackLevel(scene).scene, level.scene);
  EXPECT_EQ(PackLevel(scene).tiles, level.tiles);
  const Unpacked base = UnpackBase(level.scene);
  const auto cut = CutLevel(scene);
  ASSERT_TRUE(cut.has_value());
  ASSERT_EQ(base.index->tiles.size(), cut->tiles.size());
  ASSERT_EQ(level.tiles.size(), cut->tiles.size());
  EXPECT_EQ(base.index->edge_m, cut->edge_m);
  std::size_t number = 0;
  for (const auto& [square, tile] : cut->tiles) {
    const TileEntry& entry = base.index->tiles[number];
    EXPECT_EQ(entry.square, square);
    EXPECT_EQ(entry.bytes, level.tiles[number].size());
    Sha256 sum;
    sum.Add(level.tiles[number]);
    EXPECT_EQ(entry.sha256, sum.Finish());
    EXPECT_EQ(entry.bounds, BoundsOf(tile));
    const auto same = UnpackTile(level.tiles[number++], *base.index, *base.scene);
    ASSERT_TRUE(same.ok()) << same.status();
    ASSERT_EQ((*same)->parts.size(), tile.parts.size());
    Scene before = EmptyScene(), after = EmptyScene();
    for (std::size_t i = 0; i < tile.parts.size(); ++i) {
      const TilePart &a = tile.parts[i], &b = (*same)->parts[i];
      before.bodies.push_back(a.body);
      after.bodies.push_back(b.body);
      ASSERT_EQ(a.mesh != nullptr, b.mesh != nullptr);
      if (a.mesh != nullptr) {
        EXPECT_EQ(a.mesh->vertices, b.mesh->vertices);
        EXPECT_EQ(a.mesh->triangles, b.mesh->triangles);
      }
      ASSERT_EQ(a.field.has_value(), b.field.has_value());
      if (a.field) {
        EXPECT_EQ(a.field->first_column, b.field->first_column);
        EXPECT_EQ(a.field->first_row, b.field->first_row);
        EXPECT_EQ(a.field->columns, b.field->columns);
        EXPECT_EQ(a.field->rows, b.field->rows);
      }
    }
    EXPECT_EQ(SceneDifference::Between(before, after), "");
  }
}

TEST(LevelTilesTest, AMeshThatIsDrawnByAFileIsNotCut) {
  Scene scene = LargeLevel();
  Shape drawn = *scene.bodies[0].shape;
  drawn.visuals = {{.sha256 = std::string(64, 'a'), .mesh = 0, .pose = {}}};
  scene.bodies[0].shape = std::make_shared<const Shape>(drawn);
  const auto cut = CutLevel(scene);
  ASSERT_TRUE(cut.has_value());
  EXPECT_FALSE(std::ranges::binary_search(cut->in_tiles, scene.bodies[0].id));
}

struct DamagedTile : testing::Test {
  std::string Fault(const TileBytes& bytes) const {
    return std::string(UnpackTile(bytes, *base.index, *base.scene).status().message());
  }
  // A tile of one part, which `change` spoils, as PackLevel would write it.
  template <class Change>
  std::string FaultOf(Change change) {
    Scene scene = LargeLevel();
    change(scene);
    std::string fault;
    for (const TileBytes& tile : PackLevel(scene).tiles) {
      if (fault.empty()) fault = Fault(tile);
    }
    return fault;
  }

  const PackedLevel level = PackLevel(LargeLevel());
  const Unpacked base = UnpackBase(level.scene);
};

TEST_F(DamagedTile, ATruncatedOneOrOneOfAnotherVersionIsRefused) {
  const TileBytes& whole = level.tiles[1];
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 300) {
    EXPECT_NE(Fault(TileBytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size))), "") << size;
  }
  TileBytes other = whole;
  other[4] = 9;
  EXPECT_EQ(Fault(other), "packed tile: of version 9; this program reads 1");
  other = whole;
  other[0] = 'X';
  EXPECT_EQ(Fault(other), "packed tile: this is none");
  other = whole;
  other.push_back(0);
  EXPECT_EQ(Fault(other), "packed tile: more bytes follow");
}

TEST_F(DamagedTile, TheFieldThatIsWrongIsNamed) {
  EXPECT_THAT(FaultOf([](Scene& scene) {
                auto mesh = std::get<TriangleMeshShape>(scene.bodies[0].shape->form);
                mesh.vertices[5].y = 1e9F;
                scene.bodies[0].shape = std::make_shared<const Shape>(Shape{std::move(mesh)});
              }),
              HasSubstr("].vertex: "));
  EXPECT_THAT(FaultOf([](Scene& scene) { scene.bodies[0].material.friction = 99; }),
              HasSubstr("parts[0].friction: 99"));
  EXPECT_THAT(FaultOf([](Scene& scene) { scene.bodies[500].initial.position.y = 1e9; }), HasSubstr("].position: "));
}

TEST_F(DamagedTile, AListThatIsWrongIsRefused) {
  TileBytes scene = level.scene;
  // The last entry's hash ends the scene, and its size stands before it.
  const auto fault = [](const TileBytes& bytes) { return std::string(UnpackScene(bytes).status().message()); };
  scene.pop_back();
  EXPECT_THAT(fault(scene), HasSubstr("TILE: truncated"));
  // The bounds of the first entry: after the chunk's head, the edge, the count and the square.
  const std::string_view text = AsText(level.scene);
  const std::size_t chunk = text.rfind("TILE") + 4 + 8;
  const std::size_t count_bytes = base.index->tiles.size() < 128 ? 1 : 2;
  const std::size_t bounds = chunk + 8 + count_bytes + 5 + 5;
  TileBytes inside_out = level.scene;
  for (std::size_t i = 0; i < 8; ++i) std::swap(inside_out[bounds + i], inside_out[bounds + 24 + i]);
  EXPECT_THAT(fault(inside_out), HasSubstr("tiles[0].bounds: are inside out"));
  TileBytes no_edge = level.scene;
  for (std::size_t i = 0; i < 8; ++i) no_edge[chunk + i] = 0;
  EXPECT_THAT(fault(no_edge), HasSubstr("edge_m: 0 is not within"));
}

}  // namespace
}  // namespace tessera
