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
