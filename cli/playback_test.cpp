#include "cli/playback.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera::cli {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Optional;

const client::TimePoint kStart{std::chrono::hours(1)};

TEST(TakeKeysTest, FindsKeysAmongOtherBytes) {
  std::string bytes = "x \x1b[D\x1bOC\x1b[4~?q.";
  EXPECT_THAT(TakeKeys(bytes), ElementsAre(Key::kSpace, Key::kLeft, Key::kRight, Key::kEnd, Key::kQ, Key::kPeriod));
  EXPECT_EQ(bytes, "");
}

TEST(TakeKeysTest, AnEscapeSequenceMayComeInPieces) {
  std::string bytes = "\x1b[";
  EXPECT_THAT(TakeKeys(bytes), IsEmpty());
  bytes += "A,";
  EXPECT_THAT(TakeKeys(bytes), ElementsAre(Key::kUp, Key::kComma));
}

TEST(TakeKeysTest, AnUnknownSequenceHoldsNothingUp) {
  std::string bytes = "\x1b[15~q";
  EXPECT_THAT(TakeKeys(bytes), ElementsAre(Key::kQ));
  EXPECT_EQ(bytes, "");
}

TEST(PlaybackTest, PlaysAtItsSpeedAndNoFurtherThanTheEnd) {
  Playback playback(10s, 2s, 2, false);
  playback.Advance(kStart);
  EXPECT_EQ(playback.place(), 2s);
  playback.Advance(kStart + 3s);
  EXPECT_EQ(playback.place(), 8s);
  EXPECT_EQ(playback.client_time(), 6s);
  playback.Advance(kStart + 6s);
  EXPECT_EQ(playback.place(), 10s);
  EXPECT_EQ(playback.client_time(), 12s) << "the client itself finds the end";
  EXPECT_FALSE(playback.paused());
}

TEST(PlaybackTest, AtTheEndItPausesForWhoMayGoBack) {
  Playback playback(10s, 0s, 1, true);
  playback.Advance(kStart);
  playback.Advance(kStart + 20s);
  EXPECT_TRUE(playback.paused());
  EXPECT_LT(playback.client_time(), 10s);
  EXPECT_THAT(playback.Press(Key::kLeft), Optional(10s - Playback::kJump - 1us));
  EXPECT_THAT(playback.Press(Key::kEnd), Optional(10s - 1us));
}

TEST(PlaybackTest, StandsStillWhilePausedAndGoesOnFromThere) {
  Playback playback(60s, 0s, 1, true);
  playback.Advance(kStart);
  playback.Advance(kStart + 3s);
  EXPECT_EQ(playback.Press(Key::kSpace), std::nullopt);
  playback.Advance(kStart + 9s);
  EXPECT_EQ(playback.place(), 3s);
  playback.Press(Key::kSpace);
  playback.Advance(kStart + 10s);
  EXPECT_EQ(playback.place(), 4s);
}

TEST(PlaybackTest, AJumpMovesThePlaceAndNotTheClientsClock) {
  Playback playback(60s, 20s, 1, true);
  playback.Advance(kStart);
  EXPECT_THAT(playback.Press(Key::kRight), Optional(25s));
  EXPECT_THAT(playback.Press(Key::kLeft), Optional(20s));
  EXPECT_THAT(playback.Press(Key::kHome), Optional(0s));
  EXPECT_THAT(playback.Press(Key::kLeft), Optional(0s));
  EXPECT_EQ(playback.client_time(), 0s);
}

TEST(PlaybackTest, AStepPausesAndIsATickLong) {
  Playback playback(60s, 20s, 1, true);
  EXPECT_THAT(playback.Press(Key::kPeriod), Optional(20s + 16666us));
  EXPECT_TRUE(playback.paused());
  EXPECT_THAT(playback.Press(Key::kComma), Optional(20s));
}

TEST(PlaybackTest, ItsSpeedHasBounds) {
  Playback playback(60s, 0s, 1, true);
  for (int i = 0; i < 10; ++i) playback.Press(Key::kUp);
  EXPECT_EQ(playback.speed(), Playback::kFastest);
  for (int i = 0; i < 20; ++i) playback.Press(Key::kDown);
  EXPECT_EQ(playback.speed(), Playback::kSlowest);
}

TEST(PlaybackTest, SaysWhereItIs) {
  Playback playback(75s, 12345ms, 2, true);
  playback.Press(Key::kSpace);
  EXPECT_EQ(playback.Line(), "0:12.34 of 1:15.00, 2 times as fast, paused");
}

}  // namespace
}  // namespace tessera::cli
