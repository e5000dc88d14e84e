// A character against closed forms: speeds, heights of jumps and steps, slopes, and what it may push.
#include "core/physics/character.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "absl/strings/str_cat.h"
#include "core/world/scene_io.h"

namespace tessera::physics {
namespace {

constexpr double kStep_s = 1.0 / 60, kGravity_m_s2 = 9.81;
constexpr BodyId kWalker = PlayerBodyId(PlayerNumber(1));
constexpr double kFeet_m = 0.9;  // from the centre of the capsule down to its bottom

constexpr const char* kFloor = "bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }";

std::string Block(int id, Vec3d center, Vec3d half) {
  return absl::StrCat("bodies { id: ", id, " motion: MOTION_STATIC pose { position { x: ", center.x, " y: ", center.y,
                      " z: ", center.z, " } } shape { box { half_extents { x: ", half.x, " y: ", half.y, " z: ", half.z,
                      " } } } }");
}

std::string Crate(int id, Vec3d center, double half_m, double mass_kg) {
  return absl::StrCat("bodies { id: ", id, " mass: ", mass_kg, " pose { position { x: ", center.x, " y: ", center.y,
                      " z: ", center.z, " } } shape { box { half_extents { x: ", half_m, " y: ", half_m, " z: ", half_m,
                      " } } } }");
}

// A plane through the origin that rises along -z, where yaw 0 looks.
std::string Slope(double angle_rad) {
  return absl::StrCat("bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: ", std::cos(angle_rad),
                      " z: ", std::sin(angle_rad), " } } } }");
}

// One character in a world, an input at a time.
struct Walk {
  explicit Walk(const std::string& bodies, Vec3d feet = {}, const std::string& rules = "jump_speed: 4.5") {
    const auto written = ParseScene(
        absl::StrCat(R"(name: "course" bounds { min { x: -99 y: -99 z: -99 } max { x: 99 y: 99 z: 99 } })", bodies,
                     "player { body { mass: 80 shape { capsule { radius: 0.35 half_height: 0.55 } } }",
                     "spawn_points { y: 1 } character { walk_speed: 4 run_speed: 7 step_height: 0.3 max_slope: 0.8 ",
                     rules, " } }"),
        "course.textproto");
    EXPECT_TRUE(written.ok()) << written.status();
    const auto resolved = ResolveScene(*written, "course.textproto");
    EXPECT_TRUE(resolved.ok()) << resolved.status();
    scene = *resolved;
    for (const BodyDef& def : scene->bodies) world.Add(def, def.initial);
    BodyDef def = scene->player->body;
    def.id = kWalker;
    def.initial.position = feet + Vec3d(0, kFeet_m, 0);
    world.Add(def, def.initial);
  }

  void Step() {
    const CharacterDrive drive = DriveCharacter(world, kWalker, *scene->player, scene->gravity_m_s2, input, kStep_s);
    world.ApplyForce(kWalker, drive.force_n, drive.torque_nm);
    world.Step(kStep_s);
    highest_m = std::max(highest_m, Feet().y);
  }
  void Run(double seconds) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds / kStep_s)); ++i) Step();
  }
  BodyState State() const { return world.StateOf(kWalker); }
  Vec3d Feet() const { return State().position - Vec3d(0, kFeet_m, 0); }
  double Speed() const { return std::hypot(State().linear_velocity.x, State().linear_velocity.z); }

  std::shared_ptr<const Scene> scene;
  World world{{}};
  PlayerInput input;
  double highest_m = -99;
};

constexpr Vec2f kForward{0, 1};

TEST(CharacterTest, WalksAndRunsAtTheScenesSpeeds) {
  Walk walk(kFloor);
  walk.input.move = kForward;
  walk.Run(1);
  const double from = walk.Feet().z;
  walk.Run(5);
  EXPECT_NEAR((from - walk.Feet().z) / 5, 4, 0.04);
  EXPECT_NEAR(walk.Feet().x, 0, 0.001);
  walk.input.buttons = kRunButton;
  walk.Run(1);
  EXPECT_NEAR(walk.Speed(), 7, 0.07);
  walk.input.move = {0, 0.5F};
  walk.Run(1);
  EXPECT_NEAR(walk.Speed(), 3.5, 0.035);
}

TEST(CharacterTest, MovesAsThePlayerLooks) {
  Walk walk(kFloor);
  walk.input.move = {1, 0};
  walk.input.yaw_rad = static_cast<float>(std::numbers::pi / 2);  // looks along -x, so that right is -z
  walk.Run(2);
  EXPECT_LT(walk.Feet().z, -6);
  EXPECT_NEAR(walk.Feet().x, 0, 0.01);
  const Vec3d looks = Rotate(walk.State().orientation, Vec3d(0, 0, -1));
  EXPECT_NEAR(looks.x, -1, 1e-3);
  EXPECT_NEAR(looks.y, 0, 1e-6);
}

TEST(CharacterTest, StopsWithinWhatItsBrakesAllow) {
  Walk walk(kFloor);
  walk.input.move = kForward;
  walk.Run(2);
  walk.input.move = {};
  const double from = walk.Feet().z;
  walk.Run(2);
  EXPECT_NEAR(from - walk.Feet().z, 4.0 * 4.0 / (2 * 40), 0.05);
  EXPECT_LT(walk.Speed(), 1e-4);
  EXPECT_TRUE(walk.State().asleep);
  walk.input.move = kForward;
  walk.Run(1);
  EXPECT_GT(walk.Speed(), 3.9);
}

class StepTest : public testing::TestWithParam<double> {};

TEST_P(StepTest, IsClimbed) {
  const double height = GetParam();
  Walk walk(absl::StrCat(kFloor, Block(2, {0, height / 2, -6}, {5, height / 2, 4})));
  walk.input.move = kForward;
  walk.Run(2);
  EXPECT_NEAR(walk.Feet().y, height, 0.01);
  EXPECT_LT(walk.Feet().z, -4);
  EXPECT_LT(walk.highest_m, height + 0.1);  // it does not leap
  walk.input.move = {0, -1};                // and back down
  walk.Run(2);
  EXPECT_NEAR(walk.Feet().y, 0, 0.01);
}
INSTANTIATE_TEST_SUITE_P(Heights, StepTest, testing::Values(0.02, 0.1, 0.18, 0.25, 0.3));

class LedgeTest : public testing::TestWithParam<double> {};

TEST_P(LedgeTest, BarsTheWay) {
  const double height = GetParam();
  Walk walk(absl::StrCat(kFloor, Block(2, {0, height / 2, -6}, {5, height / 2, 4})));
  walk.input.move = kForward;
  walk.input.buttons = kRunButton;
  walk.Run(3);
  EXPECT_LT(walk.Feet().y, 0.1);
  EXPECT_GT(walk.Feet().z, -2);
}
INSTANTIATE_TEST_SUITE_P(Heights, LedgeTest, testing::Values(0.33, 0.36, 0.5, 1.0, 3.0));

TEST(CharacterTest, ClimbsAndDescendsStairs) {
  std::string stairs = kFloor;
  for (int i = 0; i < 10; ++i) {
    const double top = 0.18 * (i + 1), front = -2 - 0.3 * i;
    stairs += Block(2 + i, {0, top / 2, (front - 8) / 2}, {2, top / 2, (front + 8) / 2});
  }
  Walk walk(stairs);
  walk.input.move = kForward;
  walk.Run(2);
  EXPECT_NEAR(walk.Feet().y, 1.8, 0.01);
  const double top_z = walk.Feet().z;
  walk.input.move = {0, -1};
  double worst_gap = 0;
  while (walk.Feet().z < -0.5 && walk.Feet().z > top_z - 1) {
    walk.Step();
    const double z = walk.Feet().z;
    const double under = z > -2 ? 0 : std::min(10.0, std::floor((-2 - z) / 0.3) + 1) * 0.18;
    worst_gap = std::max(worst_gap, walk.Feet().y - under);
  }
  EXPECT_LT(worst_gap, 0.3);  // it goes down step by step instead of flying off
  walk.Run(0.5);
  EXPECT_NEAR(walk.Feet().y, 0, 0.01);
}

TEST(CharacterTest, StandsOnASlopeBelowTheLimit) {
  for (const double slope : {0.2, 0.5, 0.75}) {
    Walk walk(Slope(slope), {0, 0.35 / std::cos(slope) - 0.35, 0});
    walk.Run(1);
    const Vec3d from = walk.Feet();
    walk.Run(10);
    EXPECT_LT(Length(walk.Feet() - from), 0.001) << slope;
  }
}

TEST(CharacterTest, WalksUpAndDownASlopeWithoutLeavingIt) {
  const double slope = 0.5;
  Walk walk(Slope(slope), {0, 0.35 / std::cos(slope) - 0.35, 0});
  for (const float way : {1.0F, -1.0F}) {
    walk.input.move = {0, way};
    walk.Run(0.5);
    const Vec3d from = walk.Feet();
    for (int i = 0; i < 60; ++i) {
      walk.Step();
      const double off = walk.Feet().y - (-std::tan(slope) * walk.Feet().z + 0.35 / std::cos(slope) - 0.35);
      EXPECT_NEAR(off, 0, 0.01);
    }
    EXPECT_NEAR(Length(walk.Feet() - from), 4, 0.08);
  }
}

TEST(CharacterTest, SlidesOnASteeperSlopeAndCannotWalkUpIt) {
  for (const Vec2f move : {Vec2f{}, kForward}) {
    const double slope = 0.95;
    Walk walk(Slope(slope), {0, 0.35 / std::cos(slope) - 0.35, 0});
    walk.input.move = move;
    walk.Run(1);
    // Without friction: g sin(slope) along the slope.
    EXPECT_LT(walk.Feet().y, -0.4 * kGravity_m_s2 * std::sin(slope) * std::sin(slope)) << move.y;
  }
}

TEST(CharacterTest, DoesNotRunUpASlopeThatIsTooSteep) {
  Walk walk(absl::StrCat(kFloor, R"(bodies { id: 2 motion: MOTION_STATIC pose { position { z: -3 } }
      shape { plane { normal { y: 0.5 z: 0.866025 } } } })"));
  walk.input.move = kForward;
  walk.input.buttons = kRunButton;
  walk.Run(4);
  EXPECT_LT(walk.highest_m, 0.35);
  EXPECT_LT(walk.Feet().y, 0.1);
}

TEST(CharacterTest, JumpsAsHighAsItsSpeedSays) {
  for (const double speed : {3.0, 4.5, 6.0}) {
    Walk walk(kFloor, {}, absl::StrCat("jump_speed: ", speed));
    walk.Run(0.5);
    walk.input.buttons = kJumpButton;
    walk.Step();
    walk.input.buttons = 0;
    walk.Run(2);
    const double height = speed * speed / (2 * kGravity_m_s2);
    EXPECT_NEAR(walk.highest_m, height, 0.02 * height + 0.002) << speed;
    EXPECT_NEAR(walk.Feet().y, 0, 0.005);
  }
}

TEST(CharacterTest, KeepsItsWayInTheAir) {
  Walk walk(kFloor);
  walk.input.move = kForward;
  walk.Run(1);
  walk.input = {};
  walk.input.buttons = kJumpButton;
  walk.Step();
  walk.input.buttons = 0;
  const double from = walk.Feet().z;
  walk.Run(0.7);
  EXPECT_NEAR(from - walk.Feet().z, 4 * 0.7, 0.3);  // nothing brakes it up there
}

// Whatever is asked: it is no higher above the ground than a jump from a step.
TEST(CharacterTest, DoesNotFlyWhateverIsAsked) {
  std::string bodies = kFloor;
  for (int i = 0; i < 12; ++i) {
    bodies += Block(2 + i, {std::cos(i * 0.52) * 4, 0.15, std::sin(i * 0.52) * 4}, {0.6, 0.15, 0.6});
  }
  Walk walk(bodies);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> share(-1, 1);
  for (int i = 0; i < 6000; ++i) {
    if (i % 7 == 0) {
      walk.input.move = {share(random), share(random)};
      walk.input.yaw_rad = 3.1F * share(random);
      walk.input.buttons = static_cast<std::uint32_t>(random());
    }
    walk.input.force_n = {0, 1e6F, 0};
    walk.Step();
    const Vec3d feet = walk.Feet();
    if (std::hypot(feet.x, feet.z) > 6) walk.input.yaw_rad = static_cast<float>(std::atan2(feet.x, feet.z));
    ASSERT_GT(feet.y, -0.05) << i;
  }
  EXPECT_LT(walk.highest_m, 0.3 + 0.1 + 4.5 * 4.5 / (2 * kGravity_m_s2));
  EXPECT_LT(Length(Rotate(walk.State().orientation, Vec3d(0, 1, 0)) - Vec3d(0, 1, 0)), 1e-5);
}

TEST(CharacterTest, PushesLightBodiesAndNotHeavyOnes) {
  for (const double mass : {20.0, 500.0}) {
    Walk walk(absl::StrCat(kFloor, Crate(2, {0, 0.5, -3}, 0.5, mass)), {}, "push_mass: 100");
    walk.input.move = kForward;
    walk.Run(3);
    const double moved = -3 - walk.world.StateOf(BodyId(2)).position.z;
    if (mass < 100) {
      EXPECT_GT(moved, 2);
    } else {
      EXPECT_LT(moved, 0.1);
    }
    EXPECT_LT(walk.highest_m, 0.05);
  }
}

TEST(CharacterTest, StandsOnACrate) {
  Walk walk(absl::StrCat(kFloor, Crate(2, {0, 0.5, 0}, 0.5, 40)), {0, 1, 0});
  walk.Run(3);
  EXPECT_NEAR(walk.Feet().y, 1, 0.01);
  EXPECT_NEAR(walk.Feet().x, 0, 0.01);
}

TEST(CharacterTest, WalksAlongAWallThatItLeansOn) {
  Walk walk(absl::StrCat(kFloor, Block(2, {0, 2, -1}, {50, 2, 0.5})));
  walk.input.move = {0.7071F, 0.7071F};
  walk.Run(3);
  EXPECT_GT(walk.Feet().x, 0.9 * 3 * 4 * 0.7071);
  EXPECT_NEAR(walk.Feet().z, -0.15, 0.02);
  EXPECT_LT(walk.highest_m, 0.02);
}

}  // namespace
}  // namespace tessera::physics
