#include "core/world/player_input.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace tessera {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

PlayerInput BackFrom(const PlayerInput& input, std::size_t* bytes = nullptr) {
  ByteWriter out;
  WriteSteering(out, input);
  if (bytes != nullptr) *bytes = out.size();
  ByteReader in(out.bytes());
  PlayerInput back;
  ReadSteering(in, back);
  EXPECT_TRUE(in.ok() && in.remaining() == 0);
  return back;
}

PlayerInput Steering(Vec2f move, float yaw_rad, float pitch_rad, std::uint32_t buttons) {
  PlayerInput input;
  input.move = move;
  input.yaw_rad = yaw_rad;
  input.pitch_rad = pitch_rad;
  input.buttons = buttons;
  return input;
}

TEST(PlayerInputTest, WhatIsNotAskedForCostsOneByte) {
  std::size_t bytes = 0;
  EXPECT_EQ(BackFrom({}, &bytes), PlayerInput());
  EXPECT_EQ(bytes, 1U);
  BackFrom(AsSent(Steering({0, 1}, 1, 0.2F, 3)), &bytes);
  EXPECT_EQ(bytes, 1U + 4 + 4 + 1);
}

TEST(PlayerInputTest, ComesBackAsItIsSaidToBeSent) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(-4, 4);
  for (int i = 0; i < 10'000; ++i) {
    PlayerInput asked =
        Steering({any(random), any(random)}, 3 * any(random), any(random), static_cast<std::uint32_t>(random()));
    asked.force_n = {any(random), -0.0F, 0};
    asked.torque_nm = {0, 0, any(random)};
    const PlayerInput sent = AsSent(asked);
    ASSERT_EQ(WrongField(sent), nullptr);
    ASSERT_EQ(BackFrom(sent), sent);
    ASSERT_EQ(AsSent(sent), sent);
    const double off = std::remainder(static_cast<double>(sent.yaw_rad - asked.yaw_rad), 2 * std::numbers::pi);
    ASSERT_NEAR(off, 0, 1e-4);
  }
}

TEST(PlayerInputTest, WhatNoPlayerMayAskIsCutDown) {
  const PlayerInput sent = AsSent(Steering({3, -4}, std::numeric_limits<float>::infinity(), 9, 0));
  EXPECT_NEAR(sent.move.x, 0.6, 1e-4);
  EXPECT_NEAR(sent.move.y, -0.8, 1e-4);
  EXPECT_EQ(sent.yaw_rad, 0);
  EXPECT_NEAR(sent.pitch_rad, std::numbers::pi / 2, 1e-4);
  EXPECT_EQ(AsSent(Steering({kNan, 1}, 0, 0, 0)).move, (Vec2f{0, 1}));
}

TEST(PlayerInputTest, NamesTheFieldThatIsWrong) {
  EXPECT_EQ(WrongField(Steering({0.6F, 0.8F}, -3.14F, 1.57F, ~0U)), nullptr);
  EXPECT_STREQ(WrongField(Steering({1, 1}, 0, 0, 0)), "move is longer than 1");
  EXPECT_STREQ(WrongField(Steering({kNan, 0}, 0, 0, 0)), "move is not finite");
  EXPECT_STREQ(WrongField(Steering({}, 4, 0, 0)), "yaw_rad is not within -pi and pi");
  EXPECT_STREQ(WrongField(Steering({}, kNan, 0, 0)), "yaw_rad is not within -pi and pi");
  EXPECT_STREQ(WrongField(Steering({}, 0, -1.6F, 0)), "pitch_rad is not within -pi/2 and pi/2");
}

TEST(PlayerInputTest, TheShownMomentComesBack) {
  PlayerInput input;
  input.shown_at = ShownAt(123'456.25);
  EXPECT_EQ(input.shown_at, 123'456 * kShownParts + kShownParts / 4);
  EXPECT_EQ(BackFrom(input), input);
  EXPECT_EQ(ShownAt(-5), 0U);
  EXPECT_EQ(ShownAt(std::numeric_limits<double>::quiet_NaN()), 0U);
  EXPECT_EQ(ShownAt(std::numeric_limits<double>::infinity()), 0U);
}

TEST(PlayerInputTest, UnknownFlagsAreRefused) {
  const std::uint8_t bytes[] = {0x40};
  ByteReader in(bytes);
  PlayerInput input;
  ReadSteering(in, input);
  EXPECT_FALSE(in.ok());
}

}  // namespace
}  // namespace tessera
