#include "client_sdk/input_maker.h"

#include <gtest/gtest.h>

#include <vector>

namespace tessera::client {
namespace {

constexpr PlayerNumber kMover{3};
constexpr std::uint32_t kInputRate_hz = 60;
constexpr std::chrono::nanoseconds kInputTick{1'000'000'000 / kInputRate_hz};

struct InputMakerTest : testing::Test {
  // Polls once a tick, for so many.
  std::vector<PlayerInput> Run(int ticks) {
    std::vector<PlayerInput> all;
    for (int i = 0; i < ticks; ++i, now += kInputTick) {
      for (const PlayerInput& input : maker.MakeDue(now, world)) all.push_back(input);
    }
    return all;
  }

  InputMaker maker{kMover, kInputRate_hz};
  InputMaker::World world{
      .moves = true, .goes_on_alone = false, .predicted = false, .tick_rate_hz = kInputRate_hz, .shown_tick = 10.5};
  TimePoint now{std::chrono::hours(1)};
};

TEST_F(InputMakerTest, MakesOneInputATickWhileThePlayerSteers) {
  EXPECT_TRUE(Run(10).empty());
  maker.Move({1, 0, 0}, {});
  const std::vector<PlayerInput> made = Run(30);
  ASSERT_NEAR(static_cast<double>(made.size()), 30, 1);
  for (std::size_t i = 0; i < made.size(); ++i) {
    EXPECT_EQ(made[i].number, i + 1);
    EXPECT_EQ(made[i].body, PlayerBodyId(kMover));
    EXPECT_EQ(made[i].shown_at, ShownAt(10.5));
  }
  maker.Move({}, {});
  EXPECT_TRUE(Run(10).empty());
}

TEST_F(InputMakerTest, ABodyThatGoesOnAloneHearsThatSteeringHasEnded) {
  world.goes_on_alone = true;
  maker.Steer({.force_n = {}, .torque_nm = {}, .move = {0, 1}});
  const std::size_t steered = Run(10).size();
  maker.Steer({});
  const std::vector<PlayerInput> ending = Run(100);
  EXPECT_NEAR(static_cast<double>(ending.size()), 29, 1);  // half a second, and no more
  EXPECT_EQ(ending.front().number, steered + 1);
  EXPECT_EQ(ending.front().move, Vec2f());
}

TEST_F(InputMakerTest, ALookElsewhereIsSentThough) {
  world.goes_on_alone = true;
  Steering look;
  look.yaw_rad = 1;
  maker.Steer(look);
  EXPECT_FALSE(Run(100).empty());
  maker.Steer(look);  // the same
  EXPECT_TRUE(Run(10).empty());
}

TEST_F(InputMakerTest, NothingIsMadeWhileTheWorldStands) {
  maker.Move({1, 0, 0}, {});
  world.moves = false;
  EXPECT_TRUE(Run(10).empty());
  world.moves = true;
  EXPECT_EQ(Run(1).size(), 1u);  // those that were missed are not made up for
}

TEST_F(InputMakerTest, AnInputIsMeantForTheTickAfterThoseThatWait) {
  PlayerInput asked;
  asked.body = PlayerBodyId(kMover);
  EXPECT_EQ(maker.Make(asked, 0).target, Tick());  // nobody has reported yet
  EXPECT_EQ(maker.Make(asked, 0).number, 2u);
  ASSERT_EQ(maker.Applied(now, Tick(100), 1, 0), 1u);  // input 1 acted in tick 100, so 2 does in 101 and 3 in 102
  EXPECT_EQ(maker.Make(asked, 0).target, Tick(102));
  EXPECT_EQ(maker.Applied(now, Tick(100), 1, 0), 1u);           // in another datagram of the same snapshot
  EXPECT_EQ(maker.Applied(now, Tick(99), 3, 0), std::nullopt);  // an older report
  EXPECT_EQ(maker.Applied(now, Tick(101), 0, 0), 1u);           // inputs do not go back
  asked.body = BodyId(5);
  EXPECT_EQ(maker.Make(asked, 0).target, Tick());  // nobody knows that of another body
}

TEST_F(InputMakerTest, NumbersGoOnBeyondThoseOfAnEarlierClient) {
  maker.Move({1, 0, 0}, {});
  ASSERT_EQ(Run(1).size(), 1u);
  maker.SkipPast(1);  // its own
  EXPECT_TRUE(maker.Due(now));
  maker.SkipPast(50);
  EXPECT_FALSE(maker.Due(now));  // those that were made would pass for late
  EXPECT_EQ(maker.next(), 51u);
  maker.Forget();
  EXPECT_EQ(maker.next(), 51u);
}

}  // namespace
}  // namespace tessera::client
