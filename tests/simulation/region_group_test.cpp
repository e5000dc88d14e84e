// Whole instances: nothing is lost or doubled, and the network's whims do not matter.
#include "tests/simulation/region_group.h"
#include "core/region/testing/kept_bodies.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>

#include "core/world/scene_load.h"
#include "tests/simulation/scene_builder.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 20;

// Mixed bodies on a floor with walls, stirred through all borders.
SceneBuilder Vortex(int bodies) {
  SceneBuilder builder(kHalf);
  builder.Gravity().Floor(0.3);
  const auto wall = [&](Vec3d half, Vec3d place) {
    BodyDef& def = builder.Add(MakeShape(BoxShape{half}), place);
    def.motion = Motion::kStatic;
    def.mass_kg = 0;
  };
  for (const double side : {-1.0, 1.0}) {
    wall({0.5, 5, kHalf}, {side * kHalf, 5, 0});
    wall({kHalf, 5, 0.5}, {0, 5, side * kHalf});
  }
  const ShapePtr shapes[] = {Ball(0.4),
                             Box(0.35),
                             MakeShape(CapsuleShape{0.3, 0.3}),
                             MakeShape(CylinderShape{0.35, 0.3}),
                             MakeShape(ConeShape{0.4, 0.8}),
                             Box(0.5)};
  for (int i = 0; i < bodies; ++i) {
    const Vec3d place{-17.0 + i % 18 * 2, 1.0 + i / 324 * 1.5, -17.0 + i / 18 % 18 * 2};
    builder.Add(shapes[i % 6], place, {}, 0.5 + i % 5);
  }
  for (std::uint64_t i = 0; i + 20 <= static_cast<std::uint64_t>(bodies); i += 20) {
    builder.Tie(BodyId(6 + i), BodyId(7 + i), {1, 0, 0}, {-1, 0, 0});  // 2 m apart, in one row
  }
  builder.scene().fields.push_back(VortexField{{0, 0, 0}, 30, 0.8, 4});
  return builder;
}

RegionGroup Make(const SceneBuilder& builder, std::uint32_t regions, std::uint64_t seed, bool shared = false) {
  RegionGroupOptions options;
  options.seed = seed;
  options.settings.shared_origin = shared;
  const std::shared_ptr<const Scene> scene = builder.Build();
  return RegionGroup(scene, *MakeGridMap(scene->ground(), regions), options);
}

TEST(RegionGroupTest, AVortexThroughFourRegionsLosesAndDoublesNothing) {
  RegionGroup group = Make(Vortex(300), 4, 1);
  group.RunTo(Tick(1200));
  EXPECT_THAT(group.problems(), IsEmpty());
  EXPECT_THAT(group.totals().nonfinite, IsEmpty());
  EXPECT_EQ(group.States().size(), 300U);
  EXPECT_GT(group.totals().handovers, 300U);
  std::size_t unacknowledged = 0;
  for (std::uint32_t id = 1; id <= 4; ++id) unacknowledged += region::KeptBodies(group.region(id)).size();
  EXPECT_LE(unacknowledged, 8U) << "of " << group.totals().handovers;
  const double per_tick = static_cast<double>(group.totals().frame_bytes) / 1200;
  std::printf(
      "vortex, 4 regions, 300 bodies, 1200 ticks: %lu handovers, %lu ghosts at most in a region, %.0f bytes a tick\n",
      static_cast<unsigned long>(group.totals().handovers), static_cast<unsigned long>(group.totals().max_ghosts),
      per_tick);
}

class RegionsTest : public ::testing::TestWithParam<std::uint32_t> {};

TEST_P(RegionsTest, AnyNumberOfRegionsKeepsEveryBody) {
  RegionGroup group = Make(Vortex(200), GetParam(), 3);
  group.RunTo(Tick(300));
  EXPECT_THAT(group.problems(), IsEmpty());
  EXPECT_THAT(group.totals().nonfinite, IsEmpty());
  EXPECT_EQ(group.States().size(), 200U);
  if (GetParam() > 1) {
    EXPECT_GT(group.totals().handovers, 20U);
  }
}

INSTANTIATE_TEST_SUITE_P(Counts, RegionsTest, ::testing::Values(1, 2, 3, 5, 9));

TEST(RegionGroupTest, TheNetworkDoesNotChangeTheWorld) {
  RegionGroup first = Make(Vortex(120), 4, 1);
  first.RunTo(Tick(300));
  for (const std::uint64_t seed : {1, 2, 99}) {
    RegionGroup again = Make(Vortex(120), 4, seed);
    again.RunTo(Tick(300));
    EXPECT_EQ(again.hash(), first.hash()) << "seed " << seed;
  }
}

TEST(RegionGroupTest, FreeFlightsAreTheSameBitsInOneWorldAndInNine) {
  SceneBuilder builder(kHalf);
  builder.Gravity();
  builder.scene().fields.push_back(VortexField{{0, 0, 0}, 100, 2, 0.7});
  for (int i = 0; i < 40; ++i) {
    builder.Add(Ball(0.2), {-16.0 + i % 8 * 4, 300.0 + i, -10.0 + i / 8 * 4}, {static_cast<float>(i % 5), 0, 2});
  }
  RegionGroup one = Make(builder, 1, 1, true), nine = Make(builder, 9, 1, true);
  one.RunTo(Tick(200));
  nine.RunTo(Tick(200));
  EXPECT_EQ(one.States(), nine.States());
  EXPECT_GT(nine.totals().handovers, 40U);
}

TEST(RegionGroupTest, BodiesThatLeaveTheWorldBelongToTheNearestCell) {
  SceneBuilder builder(kHalf);
  for (int i = 0; i < 8; ++i) {
    const double angle = i * 0.785;
    builder.Add(Ball(0.5), {5 * std::cos(angle), 0, 5 * std::sin(angle)},
                {static_cast<float>(20 * std::cos(angle + 0.6)), 0, static_cast<float>(20 * std::sin(angle + 0.6))});
  }
  RegionGroup group = Make(builder, 4, 1);
  group.RunTo(Tick(600));
  EXPECT_THAT(group.problems(), IsEmpty());
  EXPECT_EQ(group.States().size(), 8U);
  EXPECT_GT(Length(group.StateOf(BodyId(2)).position), 100);
}

TEST(RegionGroupTest, ABodyThatIsNoLongerFiniteIsTakenOutAndTheRestGoesOn) {
  SceneBuilder builder(kHalf);
  builder.Add(Ball(0.5), {-0.6, 1, 0}, {1, 0, 0});
  builder.Add(Ball(0.5), {3, 1, 0}, {-1, 0, 0});
  builder.scene().fields.push_back(UniformField{{{-1, 0, -1}, {0.3, 5, 1}}, {1e30, 0, 0}});
  RegionGroup group = Make(builder, 2, 1);
  group.RunTo(Tick(200));
  EXPECT_THAT(group.problems(), IsEmpty());
  EXPECT_EQ(group.tick(), Tick(200));
  EXPECT_THAT(group.totals().nonfinite, ::testing::Contains(BodyId(1)));
}

TEST(RegionGroupTest, SleepersCostABorderLittle) {
  SceneBuilder builder(kHalf);
  builder.Gravity().Floor();
  for (int i = 0; i < 60; ++i) builder.Add(Box(0.4), {i % 2 == 0 ? -0.5 : 0.5, 0.4, -15.0 + i / 2});
  RegionGroup group = Make(builder, 2, 1);
  group.RunTo(Tick(400));
  ASSERT_EQ(group.region(1).asleep_count() + group.region(2).asleep_count(), 60U);
  const std::uint64_t bytes = group.totals().frame_bytes, frames = group.totals().frames;
  group.RunTo(Tick(500));
  const double per_frame =
      static_cast<double>(group.totals().frame_bytes - bytes) / static_cast<double>(group.totals().frames - frames);
  std::printf("30 sleeping ghosts: %.0f bytes a frame\n", per_frame);
  EXPECT_LT(per_frame, 60);
}

absl::StatusOr<std::shared_ptr<const Scene>> ShippedScene(const std::string& name, std::uint32_t bodies) {
  const std::string path = std::string(TESSERA_SOURCE_DIR) + "/scenes/" + name + ".textproto";
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  absl::StatusOr<LoadedScene> loaded =
      LoadScene(SceneForm::kText, text.str(), path, {.scatter_count = bodies, .hash = {}});
  if (!loaded.ok()) return loaded.status();
  return loaded->scene;
}

// Dumbbells are driven along the walls in rows, lying in each other's hollows.
TEST(RegionGroupTest, NothingIsFlungOutOfACrowd) {
  const auto scene = ShippedScene("plaza", 2000);
  ASSERT_TRUE(scene.ok()) << scene.status();
  RegionGroup group(*scene, *MakeGridMap((*scene)->ground(), 1), {});
  double fastest = 0;
  for (Tick::rep tick = 1; tick <= 750; ++tick) {
    group.RunTo(Tick(tick));
    for (const region::OwnedBody& body : group.region(1).owned()) {
      fastest = std::max(fastest, static_cast<double>(Length(body.state.linear_velocity)));
    }
  }
  std::printf("the fastest of 2000 bodies in 12.5 s: %.1f m/s\n", fastest);
  EXPECT_LT(fastest, 15);
}

class SceneTest : public ::testing::TestWithParam<const char*> {};

TEST_P(SceneTest, RunsOnFourRegions) {
  const auto scene = ShippedScene(GetParam(), 300);
  ASSERT_TRUE(scene.ok()) << scene.status();
  RegionGroup group(*scene, *MakeGridMap((*scene)->ground(), 4), {});
  group.RunTo(Tick(240));
  EXPECT_THAT(group.problems(), IsEmpty());
  EXPECT_THAT(group.totals().nonfinite, IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Scenes, SceneTest,
                         ::testing::Values("bridge", "dissertation", "minimal", "plaza", "shapes", "stack"),
                         [](const auto& name) { return std::string(name.param); });

}  // namespace
}  // namespace tessera::simulation
