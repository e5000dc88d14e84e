#include "client_sdk/ground.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/world/packed_scene.h"

namespace tessera::client {
namespace {

constexpr std::int64_t kBudget = 50'000;
// A call may go beyond its budget by the piece that it builds, which it then does first.
constexpr std::int64_t kLastPiece = 3 * std::int64_t{kMostPieceTriangles} * kUnitsToBuildATriangle / 2;
constexpr double kReach_m = 3;

double HillAt(double x, double z) { return std::sin(x * 0.7) * std::cos(z * 0.5) * 0.4; }

BodyDef StaticBody(std::uint64_t id, Shape shape, Vec3d place = {}) {
  BodyDef def;
  def.id = BodyId(id);
  def.shape = std::make_shared<const Shape>(std::move(shape));
  def.motion = Motion::kStatic;
  def.mass_kg = 0;
  def.initial.position = place;
  return def;
}

// `cells` squares of a metre each way, two triangles each, about the origin.
Shape Hills(int cells) {
  TriangleMeshShape mesh;
  const auto side = static_cast<std::uint32_t>(cells + 1);
  for (int z = 0; z <= cells; ++z) {
    for (int x = 0; x <= cells; ++x) {
      const double at_x = x - cells / 2.0, at_z = z - cells / 2.0;
      mesh.vertices.push_back(Vec3f(Vec3d{at_x, HillAt(at_x, at_z), at_z}));
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

Shape HillField(std::uint32_t samples) {
  HeightFieldShape field{.columns = samples, .rows = samples, .spacing_m = 1, .heights_m = {}};
  for (std::uint32_t z = 0; z < samples; ++z) {
    for (std::uint32_t x = 0; x < samples; ++x) {
      field.heights_m.push_back(static_cast<float>(HillAt(x - (samples - 1) / 2.0, z - (samples - 1) / 2.0)));
    }
  }
  return Shape{std::move(field)};
}

struct Stage {
  explicit Stage(std::vector<BodyDef> bodies) : scene(std::make_shared<Scene>()) {
    scene->bodies = std::move(bodies);
    ground.emplace(scene);
    ground->Begin();
  }
  // One poll; the units that it took.
  std::int64_t Poll(Vec3d at) {
    WorkBudget budget(kBudget);
    ground->Work(world, at, kReach_m, budget);
    dearest = std::max(dearest, budget.spent());
    return budget.spent();
  }
  int PollsUntilCovered(Vec3d at) {
    int polls = 0;
    for (; !ground->Covers(at, kReach_m) && polls < 10'000; ++polls) Poll(at);
    return polls;
  }

  std::shared_ptr<Scene> scene;
  physics::World world{physics::WorldSettings{}};
  std::optional<Ground> ground;
  std::int64_t dearest = 0;
};

// 980 000 triangles, which take three seconds to build whole.
TEST(GroundTest, OfALargeMeshOnlyWhatIsNearIsBuiltAndNoPollIsDear) {
  Stage stage({StaticBody(1, Hills(700))});
  const int polls = stage.PollsUntilCovered({3, 1, -4});
  EXPECT_LE(polls, 60) << "a second at 60 polls a second";
  EXPECT_GT(polls, 1) << "it is looked at in goes";
  EXPECT_LE(stage.dearest, std::max(kBudget + kBudget / 2, kLastPiece));
  EXPECT_LE(stage.ground->piece_triangles(), kMostPieceTriangles);
  EXPECT_GT(stage.ground->piece_triangles(), 2u * 8 * 8);
  EXPECT_EQ(stage.Poll({3, 1, -4}), 0) << "it is there, and costs nothing more";
}

TEST(GroundTest, AMillionBodiesAreLookedAtInGoes) {
  std::vector<BodyDef> bodies;
  const BodyDef one = StaticBody(1, Shape{SphereShape{0.5}});
  for (std::uint64_t i = 0; i < 200'000; ++i) {
    bodies.push_back(one);
    bodies.back().id = BodyId(i + 1);
    bodies.back().initial.position = {static_cast<double>(i % 500) * 4, 0, static_cast<double>(i / 500) * 4};
  }
  Stage stage(std::move(bodies));
  const int polls = stage.PollsUntilCovered({800, 0, 800});
  EXPECT_GT(polls, 10);
  EXPECT_LE(stage.dearest, std::max(kBudget + kBudget / 2, kLastPiece));
  EXPECT_LT(stage.ground->bodies(), 40u);
  EXPECT_GE(stage.ground->bodies(), 9u);
}

// Whoever walks always has ground, at the same bounded cost.
TEST(GroundTest, GoesAlongWithWhoeverWalks) {
  Stage stage(
      {StaticBody(1, Hills(400)), StaticBody(2, Shape{PlaneShape{}}), StaticBody(3, HillField(301), {0, -5, 0})});
  Vec3d at{-100, 1, 20};
  stage.PollsUntilCovered(at);
  stage.dearest = 0;
  int rebuilt = 0;
  for (int i = 0; i < 60 * 20; ++i) {
    at.x += 8.0 / 60;
    rebuilt += stage.Poll(at) > kBudget / 2 ? 1 : 0;
    ASSERT_TRUE(stage.ground->Covers(at, kReach_m)) << "at " << at.x;
  }
  EXPECT_LE(stage.dearest, std::max(kBudget + kBudget / 2, kLastPiece));
  EXPECT_GT(rebuilt, 10);
  EXPECT_EQ(stage.ground->bodies(), 3u);
}

TEST(GroundTest, WhoeverIsPutElsewhereHasGroundAgainSoon) {
  Stage stage({StaticBody(1, Hills(400))});
  stage.PollsUntilCovered({0, 1, 0});
  EXPECT_FALSE(stage.ground->Covers({150, 1, 150}, kReach_m));
  EXPECT_LE(stage.PollsUntilCovered({150, 1, 150}), 5);
  EXPECT_FALSE(stage.ground->Covers({0, 1, 0}, kReach_m));
}

TEST(GroundTest, BodiesThatAreLeftBehindLeaveTheWorld) {
  std::vector<BodyDef> bodies;
  for (std::uint64_t i = 0; i < 100; ++i) {
    bodies.push_back(StaticBody(i + 1, Shape{SphereShape{1}}, {static_cast<double>(i) * 10, 0, 0}));
  }
  Stage stage(std::move(bodies));
  stage.PollsUntilCovered({0, 0, 0});
  EXPECT_TRUE(stage.world.Has(BodyId(1)));
  EXPECT_FALSE(stage.world.Has(BodyId(51)));
  stage.PollsUntilCovered({500, 0, 0});
  EXPECT_FALSE(stage.world.Has(BodyId(1)));
  EXPECT_TRUE(stage.world.Has(BodyId(51)));
  EXPECT_EQ(stage.world.size(), stage.ground->bodies());
}

TEST(GroundTest, ASurfaceElsewhereIsNotInTheWorldAndDoesNotHinder) {
  Stage stage({StaticBody(1, Hills(40), {500, 0, 0}), StaticBody(2, HillField(41), {0, 0, 900})});
  stage.PollsUntilCovered({0, 0, 0});
  EXPECT_TRUE(stage.ground->Covers({0, 0, 0}, kReach_m));
  EXPECT_EQ(stage.ground->bodies(), 0u);
}

// A surface whose triangles are so small that the area has more than may be is cut closer, but never too close.
TEST(GroundTest, FineGroundIsCutCloser) {
  Shape fine = Hills(300);
  for (Vec3f& vertex : std::get<TriangleMeshShape>(fine.form).vertices) {
    vertex.x *= 0.1f;
    vertex.z *= 0.1f;
  }
  Stage stage({StaticBody(1, std::move(fine))});
  EXPECT_LE(stage.PollsUntilCovered({0, 1, 0}), 60);
  EXPECT_TRUE(stage.ground->Covers({0.4, 1, 0.4}, kReach_m));
}

// A ball on the piece does what it does on the whole.
void ExpectSameOn(const Shape& shape, Quatd turn) {
  BodyDef hills = StaticBody(1, shape, {7, -2, 11});
  hills.initial.orientation = turn;
  Stage stage({hills});
  physics::World whole{physics::WorldSettings{}};
  whole.Add(hills, hills.initial);
  BodyDef ball;
  ball.id = BodyId(2);
  ball.shape = std::make_shared<const Shape>(Shape{SphereShape{0.4}});
  ball.mass_kg = 2;
  ball.initial.position = {9.3, 0.5, 8.1};
  ball.initial.linear_velocity = {1.5, 0, 1};
  stage.PollsUntilCovered(ball.initial.position);
  for (physics::World* world : {&stage.world, &whole}) world->Add(ball, ball.initial);
  bool touched = false;
  for (int i = 0; i < 180; ++i) {
    for (physics::World* world : {&stage.world, &whole}) world->Step(1.0 / 60);
    touched = touched || !whole.contacts().empty();
    stage.Poll(stage.world.StateOf(BodyId(2)).position);
  }
  EXPECT_TRUE(touched);
  const Vec3d apart = stage.world.StateOf(BodyId(2)).position - whole.StateOf(BodyId(2)).position;
  EXPECT_LT(Length(apart), 1e-3);
}

TEST(GroundTest, ABallOnAPieceOfAMeshDoesWhatItDoesOnTheWhole) { ExpectSameOn(Hills(80), Quatd()); }
TEST(GroundTest, ABallOnAPieceOfATurnedMeshToo) {
  ExpectSameOn(Hills(80), Normalized(Quatd{0, std::sin(0.4), 0, std::cos(0.4)}));
}
TEST(GroundTest, ABallOnAPieceOfAHeightFieldToo) { ExpectSameOn(HillField(81), Quatd()); }

// The same level whole, and in tiles.
struct TiledStage {
  explicit TiledStage(std::vector<BodyDef> bodies) : whole(std::move(bodies)) {
    whole.scene->bounds = {{-500, -50, -500}, {500, 50, 500}};
    const PackedLevel level = PackLevel(*whole.scene);
    SceneUnpacker unpacker(level.scene);
    while (!unpacker.Go(level.scene.size())) {
    }
    base = *unpacker.Take();
    index = unpacker.index();
    for (const std::vector<std::uint8_t>& bytes : level.tiles) tiles.push_back(*UnpackTile(bytes, *index, *base));
    ground.emplace(base, index);
    ground->Begin();
  }
  void AddAllBut(std::uint32_t missing) {
    for (std::uint32_t i = 0; i < tiles.size(); ++i) {
      if (i != missing) ground->AddTile(i, tiles[i]);
    }
  }
  void PollBoth(Vec3d at) {
    for (int i = 0; i < 10'000 && !(whole.ground->Covers(at, kReach_m) && ground->Covers(at, kReach_m)); ++i) Poll(at);
    Poll(at);
  }
  void Poll(Vec3d at) {
    whole.Poll(at);
    WorkBudget budget(kBudget);
    ground->Work(world, at, kReach_m, budget);
  }

  Stage whole;
  std::shared_ptr<const Scene> base;
  std::shared_ptr<const LevelIndex> index;
  std::vector<std::shared_ptr<const Tile>> tiles;
  physics::World world{physics::WorldSettings{}};
  std::optional<Ground> ground;
};

std::vector<BodyDef> LargeGround() {
  std::vector<BodyDef> bodies{StaticBody(1, Hills(300)), StaticBody(2, HillField(601), {0, 0.5, 0})};
  bodies[1].initial.orientation = Normalized(Quatd{0, 0.3, 0, 0.95});
  for (std::uint64_t i = 0; i < 400; ++i) {
    const double x = static_cast<double>(i % 20) * 9 - 85, z = static_cast<double>(i / 20) * 9 - 85;
    bodies.push_back(StaticBody(10 + i, Shape{BoxShape{{0.6, 0.5, 0.4}}}, {x, 0.6, z}));
  }
  return bodies;
}

// Where tiles meet as well as elsewhere: balls and boxes that fall come to the same places to the bit.
TEST(GroundTest, OnTilesEverythingFallsAsOnTheWholeLevel) {
  TiledStage stage(LargeGround());
  ASSERT_NE(stage.index, nullptr);
  ASSERT_GT(stage.tiles.size(), 8u);
  stage.AddAllBut(~0u);
  const double edge = stage.index->edge_m;
  int fell = 0;
  for (const Vec3d at : {Vec3d{0, 0, 0}, Vec3d{edge, 0, 0.3}, Vec3d{-edge, 0, edge}, Vec3d{3.4, 0, -edge},
                         Vec3d{0.5 * edge, 0, 0.25 * edge}}) {
    stage.PollBoth(at);
    ASSERT_TRUE(stage.ground->Covers(at, kReach_m)) << at;
    EXPECT_EQ(stage.ground->piece_triangles(), stage.whole.ground->piece_triangles()) << at;
    for (std::uint64_t i = 0; i < 9; ++i) {
      BodyDef def = StaticBody(5000 + i, i % 2 == 0 ? Shape{SphereShape{0.3}} : Shape{BoxShape{{0.3, 0.2, 0.25}}});
      def.motion = Motion::kDynamic;
      def.mass_kg = 2;
      def.initial.position = at + Vec3d{static_cast<double>(i % 3) - 1, 2.5, static_cast<double>(i / 3) - 1};
      stage.world.Add(def, def.initial);
      stage.whole.world.Add(def, def.initial);
    }
    for (int tick = 0; tick < 120; ++tick) {
      stage.world.Step(1.0 / 60);
      stage.whole.world.Step(1.0 / 60);
    }
    for (std::uint64_t i = 0; i < 9; ++i) {
      const BodyState a = stage.world.StateOf(BodyId(5000 + i)), b = stage.whole.world.StateOf(BodyId(5000 + i));
      EXPECT_EQ(a, b) << "at " << at << " body " << i;
      fell += a.position.y < 2.4 ? 1 : 0;
      stage.world.Remove(BodyId(5000 + i));
      stage.whole.world.Remove(BodyId(5000 + i));
    }
  }
  EXPECT_EQ(fell, 45);
}

TEST(GroundTest, ThereIsNoneWhileATileThatReachesThereIsMissing) {
  TiledStage stage(LargeGround());
  const double edge = stage.index->edge_m;
  const Vec3d at{edge / 2, 0, edge / 2};
  std::uint32_t there = 0;
  while (!stage.index->tiles[there].bounds.Contains(at)) ++there;
  stage.AddAllBut(there);
  stage.PollBoth(at);
  EXPECT_FALSE(stage.ground->Covers(at, kReach_m));
  stage.ground->AddTile(there, stage.tiles[there]);
  stage.PollBoth(at);
  EXPECT_TRUE(stage.ground->Covers(at, kReach_m));
  const std::size_t triangles = stage.ground->piece_triangles();
  EXPECT_EQ(triangles, stage.whole.ground->piece_triangles());
  stage.ground->DropTile(there);  // the built piece stays until it is left
  EXPECT_TRUE(stage.ground->Covers(at, kReach_m));
  EXPECT_EQ(stage.ground->piece_triangles(), triangles);
}

}  // namespace
}  // namespace tessera::client
