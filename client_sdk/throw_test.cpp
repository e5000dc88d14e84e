// A thrown body is seen at once, and becomes the server's without a jump.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "client_sdk/throw_stage.h"
#include "game_sdk/examples/car/car_movement.h"

namespace tessera::client {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr NetworkConditions kFar{.delay = milliseconds(50)};  // 100 ms there and back

double P99(std::vector<double> values) {
  std::ranges::sort(values);
  return values.empty() ? 0
                        : values[static_cast<std::size_t>(std::ceil(0.99 * static_cast<double>(values.size() - 1)))];
}

TEST(ThrowTest, ABallIsDrawnAtOnceAndGoesOnAsTheServers) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  const auto thrown = stage.Throw({3, 4, 0});
  ASSERT_TRUE(thrown.ok()) << thrown.status();
  stage.shown = stage.client->Interpolated(stage.now);
  ASSERT_NE(stage.Find(*thrown), nullptr) << "in the same frame";
  EXPECT_TRUE(stage.Find(*thrown)->predicted);
  EXPECT_EQ(stage.Find(*thrown)->seen, nullptr) << "nobody but the player has it yet";
  ASSERT_TRUE(stage.Frame()) << stage.error;
  ASSERT_NE(stage.Find(*thrown), nullptr);
  const double begins_at = stage.Find(*thrown)->pose.position.x;
  ASSERT_TRUE(stage.Run(0.07)) << stage.error;
  ASSERT_NE(stage.Find(*thrown), nullptr) << "and moves before the server can have heard of it";
  EXPECT_GT(stage.Find(*thrown)->pose.position.x, begins_at + 0.1);
  EXPECT_EQ(stage.taken(), 0U);
  ASSERT_TRUE(stage.Run(0.5)) << stage.error;
  ASSERT_EQ(stage.taken(), 1U) << testing::PrintToString(stage.lines);
  EXPECT_LT(stage.jumps()[0], 0.02);
  EXPECT_EQ(stage.Find(*thrown), nullptr) << "it is the server's now";
  EXPECT_EQ(stage.missing() + stage.doubled() + stage.lost(), 0U);
  EXPECT_THAT(stage.lines, IsEmpty());
}

TEST(ThrowTest, NoneOfManyJumpsIsLostOrShownTwice) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  constexpr int kThrows = 60;
  for (int i = 0; i < kThrows; ++i) {
    const auto thrown = stage.ThrowNumber(i);
    ASSERT_TRUE(thrown.ok()) << thrown.status();
    ASSERT_TRUE(stage.Run(0.4)) << stage.error;
  }
  ASSERT_TRUE(stage.Run(1)) << stage.error;
  EXPECT_EQ(stage.taken(), std::size_t{kThrows}) << testing::PrintToString(stage.lines);
  EXPECT_LT(P99(stage.jumps()), 0.02) << testing::PrintToString(stage.jumps());
  EXPECT_EQ(stage.lost(), 0U);
  EXPECT_EQ(stage.missing(), 0U);
  EXPECT_EQ(stage.doubled(), 0U);
}

TEST(ThrowTest, OneWhoStandsStillThrowsAsWell) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  stage.client->Move({}, {});
  ASSERT_TRUE(stage.Run(6)) << stage.error;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(stage.Throw({3.0 + i, 2.0 - 0.5 * i, 4}).ok());
    ASSERT_TRUE(stage.Run(i % 2 == 0 ? 0.5 : 4)) << stage.error;
  }
  EXPECT_EQ(stage.taken(), 10U);
  EXPECT_LT(P99(stage.jumps()), 0.02) << testing::PrintToString(stage.jumps());
  EXPECT_EQ(stage.missing() + stage.doubled() + stage.lost(), 0U);
}

// Throws while it moves; each ball is drawn once, from the first frame on, and goes on as the server's.
void ThrowAndExpectNoJump(ThrowStage& stage, double least_way_m) {
  ASSERT_TRUE(stage.Begin()) << stage.error;
  constexpr int kThrows = 40;
  Vec3d before = stage.Find(stage.client->own_body())->pose.position;
  double way_m = 0;
  for (int i = 0; i < kThrows; ++i) {
    const auto thrown = stage.ThrowNumber(i);
    ASSERT_TRUE(thrown.ok()) << thrown.status();
    ASSERT_TRUE(stage.Run(0.4)) << stage.error;
    ASSERT_NE(stage.Find(stage.client->own_body()), nullptr);
    const Vec3d at = stage.Find(stage.client->own_body())->pose.position;
    way_m += Length(at - before);
    before = at;
  }
  ASSERT_TRUE(stage.Run(1)) << stage.error;
  EXPECT_GT(way_m, least_way_m) << "it has moved";
  EXPECT_EQ(stage.taken(), std::size_t{kThrows}) << testing::PrintToString(stage.lines);
  EXPECT_LT(P99(stage.jumps()), 0.02) << testing::PrintToString(stage.jumps());
  EXPECT_EQ(stage.missing() + stage.doubled() + stage.lost(), 0U) << testing::PrintToString(stage.why_lost);
  EXPECT_THAT(stage.lines, IsEmpty());
}

TEST(ThrowTest, ACharacterThrowsWhileItWalksRunsAndJumps) {
  ThrowStage stage(kFar);
  stage.player =
      "player { body { mass: 80 shape { capsule { radius: 0.3 half_height: 0.25 } } } spawn_points { y: 0.55 } "
      "character { walk_speed: 3 run_speed: 5 jump_speed: 4 } }";
  stage.steers = [](int frame) {
    Steering steering;
    steering.move = {0, 1};
    steering.yaw_rad = 0.785F * static_cast<float>(frame / 50 % 8) - 3;
    steering.buttons = (frame % 90 < 20 ? 1U : 0U) | (frame % 200 < 100 ? 2U : 0U);
    return steering;
  };
  ThrowAndExpectNoJump(stage, 30);
}

// By the game's own movement, which the client predicts by as well.
TEST(ThrowTest, ADriverThrowsOutOfACarThatMoves) {
  ThrowStage stage(kFar);
  stage.player =
      "player { body { kind: \"car\" mass: 1200 shape { box { half_extents { x: 0.9 y: 0.3 z: 2 } } } } "
      "spawn_points { y: 1 } max_force: 1 max_speed: 50 }";
  stage.movement = &car_movement;
  stage.crates = false;  // it would push them before itself
  // To and fro, in bends.
  stage.steers = [](int frame) {
    Steering steering;
    const int part = frame % 240;
    steering.move = {frame % 100 < 50 ? 0.5F : -0.4F, part < 60 || part >= 180 ? 0.7F : -0.7F};
    return steering;
  };
  ThrowAndExpectNoJump(stage, 15);
}

TEST(ThrowTest, LossDelaysAndDoublesNothing) {
  ThrowStage stage({.loss = 0.05, .delay = milliseconds(50), .jitter = milliseconds(10)});
  ASSERT_TRUE(stage.Begin()) << stage.error;
  for (int i = 0; i < 40; ++i) {
    ASSERT_TRUE(stage.ThrowNumber(i).ok());
    ASSERT_TRUE(stage.Run(0.4)) << stage.error;
  }
  ASSERT_TRUE(stage.Run(1)) << stage.error;
  EXPECT_EQ(stage.taken(), 40U);
  EXPECT_EQ(stage.missing() + stage.doubled() + stage.lost(), 0U);
}

TEST(ThrowTest, ABallThatTheGameDoesNotMakeGoes) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  const auto thrown = stage.Throw({0, 3, 0}, "waste");
  ASSERT_TRUE(thrown.ok()) << thrown.status();
  ASSERT_TRUE(stage.Run(0.5)) << stage.error;
  EXPECT_NE(stage.Find(*thrown), nullptr);
  ASSERT_TRUE(stage.Run(0.5)) << stage.error;
  EXPECT_EQ(stage.Find(*thrown), nullptr);
  EXPECT_EQ(stage.lost(), 1U);
  EXPECT_EQ(stage.taken(), 0U);
}

// The game made one without saying that it is the one that was predicted.
TEST(ThrowTest, ABallOfTheSameKindIsNotTakenForIt) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  ASSERT_TRUE(stage.Throw({0, 3, 0}, "late").ok());
  ASSERT_TRUE(stage.Run(1)) << stage.error;
  EXPECT_EQ(stage.lost(), 1U);
  EXPECT_EQ(stage.taken(), 0U);
}

// It flies, and still has a velocity to draw a trail by, before the server has it.
TEST(ThrowTest, ABallHasItsVelocityFromTheFirstFrameOn) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  const auto thrown = stage.Throw({3, 4, 0});
  ASSERT_TRUE(thrown.ok()) << thrown.status();
  ASSERT_TRUE(stage.Run(0.07)) << stage.error;
  ASSERT_NE(stage.Find(*thrown), nullptr);
  EXPECT_NEAR(stage.Find(*thrown)->velocity_m_s.x, 3, 0.1);
}

// Each ball that is simulated ahead costs steps and inputs, so it ends also where nobody draws.
TEST(ThrowTest, WhoDoesNotLookSimulatesItNoLongerThanOthers) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  stage.client->Move({}, {});
  ASSERT_TRUE(stage.Throw({6, 5, 0}).ok());
  ASSERT_TRUE(stage.Run(0.5)) << stage.error;
  ASSERT_EQ(stage.taken(), 1U);
  const auto is_ball = [](const ShownBody& body) { return IsSpawned(body.id); };
  ASSERT_TRUE(std::ranges::find_if(stage.shown, is_ball)->predicted);
  stage.looks = false;
  ASSERT_TRUE(stage.Run(2)) << stage.error;
  stage.shown = stage.client->Interpolated(stage.now);
  const auto ball = std::ranges::find_if(stage.shown, is_ball);
  ASSERT_NE(ball, stage.shown.end());
  EXPECT_FALSE(ball->predicted);
}

TEST(ThrowTest, WhoLeavesIsToldThatItIsGone) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  const auto thrown = stage.Throw({0, 3, 0});
  ASSERT_TRUE(thrown.ok()) << thrown.status();
  ASSERT_TRUE(stage.Frame()) << stage.error;
  (void)stage.client->Leave();
  ASSERT_TRUE(stage.Run(1)) << stage.error;
  EXPECT_EQ(stage.why_lost, std::vector<std::string>{"nothing is predicted any more"});
  EXPECT_EQ(stage.Find(*thrown), nullptr);
}

TEST(ThrowTest, WhatIsWrongIsNamedAndNothingIsSent) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  const auto refused = [&](const SpawnAsk& ask, std::string_view command = "throw 0 1 0") {
    return std::string(stage.client->PredictSpawn(ask, command).status().message());
  };
  const auto refused_motion = [&](const std::function<void(SpawnMotion&)>& change) {
    SpawnAsk ask{.prefab = "ball"};
    change(ask.motion);
    return refused(ask);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused({.prefab = "bal"}), "prefab: the scene has no \"bal\"");
  EXPECT_EQ(refused({.prefab = "pair"}), "prefab: \"pair\" has 2 bodies, and one can be predicted");
  EXPECT_EQ(refused_motion([&](SpawnMotion& of) { of.position.y = nan; }), "position: is not finite");
  EXPECT_THAT(refused_motion([&](SpawnMotion& of) { of.position.y = 30; }), HasSubstr("position: is more than 20 m"));
  EXPECT_THAT(refused_motion([&](SpawnMotion& of) { of.rotation.w = nan; }), HasSubstr("orientation: "));
  EXPECT_THAT(refused_motion([&](SpawnMotion& of) { of.velocity_m_s.x = nan; }), HasSubstr("velocity: "));
  EXPECT_THAT(refused_motion([&](SpawnMotion& of) { of.spin_rad_s.y = 2000; }), HasSubstr("spin: "));
  EXPECT_THAT(refused({.prefab = "ball", .from_own = true}, std::string(2000, 'x')), HasSubstr("bytes: 2000"));
  for (std::size_t i = 0; i < Client::kMaxPredictedSpawns; ++i) {
    ASSERT_TRUE(stage.Throw({0, 1, 0}, "waste").ok());
  }
  EXPECT_EQ(refused({.prefab = "ball", .from_own = true}), "16 bodies are predicted already");
  ASSERT_TRUE(stage.Run(1)) << stage.error;
  EXPECT_THAT(stage.lines, IsEmpty());
  EXPECT_EQ(stage.lost(), Client::kMaxPredictedSpawns);
}

TEST(ThrowTest, WithoutPredictionNothingIsShownNorSent) {
  ThrowStage stage(kFar);
  ASSERT_TRUE(stage.Begin()) << stage.error;
  const auto grant = stage.world->Grant();
  ASSERT_TRUE(grant.ok());
  GrantOptions options;
  options.bind_address = "127.0.0.1";
  options.packed_scene = stage.world->packed_scene();
  auto other = Client::JoinByGrant(*grant, options);
  ASSERT_TRUE(other.ok()) << other.status();
  for (int frame = 0; frame < 60; ++frame) {
    ASSERT_TRUE(stage.Frame());
    (void)(*other)->Poll(stage.now);
  }
  const auto thrown = (*other)->PredictSpawn({.prefab = "ball", .from_own = true}, "throw 0 1 0");
  EXPECT_EQ(thrown.status().message(), "nothing is predicted here, or not yet");
}

}  // namespace
}  // namespace tessera::client
