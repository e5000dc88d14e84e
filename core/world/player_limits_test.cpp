#include "core/world/player_limits.h"

#include <gtest/gtest.h>

#include <limits>

namespace tessera {
namespace {

TEST(PlayerLimitsTest, ComeBackAsTheyWereWritten) {
  for (const PlayerLimits& limits :
       {PlayerLimits{}, PlayerLimits{5.0F, {}, {}, {1, 1, 1}}, PlayerLimits{{}, 2.0F, 3.0F, {1, 0, 0.5F}}}) {
    ByteWriter out;
    Write(out, limits);
    const std::vector<std::uint8_t> bytes = out.Take();
    ByteReader in(bytes);
    EXPECT_EQ(ReadPlayerLimits(in), limits);
    EXPECT_TRUE(in.ok());
    EXPECT_EQ(in.remaining(), 0U);
  }
}

TEST(PlayerLimitsTest, WhatCannotBeIsNamed) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  EXPECT_EQ(WrongField(PlayerLimits{}), nullptr);
  EXPECT_STREQ(WrongField(PlayerLimits{-1.0F, {}, {}, {1, 1, 1}}), "force");
  EXPECT_STREQ(WrongField(PlayerLimits{{}, nan, {}, {1, 1, 1}}), "torque");
  EXPECT_STREQ(WrongField(PlayerLimits{{}, {}, infinite, {1, 1, 1}}), "speed");
  EXPECT_STREQ(WrongField(PlayerLimits{{}, {}, {}, {1, nan, 1}}), "axes");
  EXPECT_STREQ(WrongField(PlayerLimits{{}, {}, {}, {1, 1, 2}}), "axes");
}

TEST(PlayerLimitsTest, UnknownFlagsAreRefused) {
  const std::vector<std::uint8_t> bytes{16};
  ByteReader in(bytes);
  ReadPlayerLimits(in);
  EXPECT_FALSE(in.ok());
}

TEST(PlayerLimitsTest, ACharacterGetsSlowerAndNotFaster) {
  PlayerRules rules;
  rules.max_speed_m_s = 5;
  rules.character.emplace();
  rules.character->walk_speed_m_s = 4;
  rules.character->run_speed_m_s = 8;
  const PlayerRules slow = RulesWith(rules, {{}, {}, 6.0F, {1, 1, 1}});
  EXPECT_EQ(slow.character->walk_speed_m_s, 4);
  EXPECT_EQ(slow.character->run_speed_m_s, 6);
  EXPECT_EQ(slow.max_speed_m_s, 6);
}

}  // namespace
}  // namespace tessera
