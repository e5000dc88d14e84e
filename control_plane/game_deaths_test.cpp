#include "control_plane/game_deaths.h"

#include <gmock/gmock.h>

#include <string>

#include "control_plane/control_settings.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr std::uint64_t kTickRate = 60;
constexpr std::uint64_t kForgivenTicks = 60 * kTickRate;

class GameDeathsTest : public ::testing::Test {
 protected:
  GameDeathsTest() {
    record_.set_id("inst-1");
    record_.set_state(v1::INSTANCE_STATE_RUNNING);
    record_.set_tick_rate_hz(kTickRate);
    record_.set_game_native(true);
    record_.set_game_name("arena");
    record_.set_game_hash(std::string(64, 'a'));
    host_.set_id("host-2");
    host_.set_name("beta");
  }
  // A worker that was placed on the host dies in the game.
  v1::WorkerExited Death(std::uint64_t incarnation) {
    records::Placement& placement = *record_.add_placements();
    placement.set_region(2);
    placement.set_host_id("host-2");
    placement.set_incarnation(incarnation);
    v1::WorkerExited exited;
    exited.mutable_identity()->set_region(2);
    exited.mutable_identity()->set_incarnation(incarnation);
    exited.set_died_in_game("arena: Segmentation fault in on_tick");
    return exited;
  }
  bool Count(const v1::WorkerExited& exited, std::uint64_t newest_tick) {
    const auto next = CountGameDeath(record_, newest_tick, host_, exited);
    if (next) record_ = *next;
    return next.has_value();
  }

  records::Instance record_;
  records::Host host_;
  const Now now_{std::chrono::hours(1), std::chrono::hours(2)};
};

TEST_F(GameDeathsTest, ThreeInARowEndTheWorldWithGamePlaceAndSignal) {
  for (const std::uint64_t incarnation : {5, 6}) {
    EXPECT_TRUE(Count(Death(incarnation), 100 * incarnation));
    EXPECT_FALSE(FailedByGame(record_, now_)) << incarnation;
  }
  EXPECT_TRUE(Count(Death(7), 700));
  const auto failed = FailedByGame(record_, now_);
  ASSERT_TRUE(failed);
  EXPECT_EQ(failed->state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_EQ(failed->reason(),
            "its game native:arena@aaaaaaaa crashed 3 workers in a row, the last one that of region 2 on beta: "
            "Segmentation fault in on_tick");
  ASSERT_THAT(failed->events(), SizeIs(1));
  EXPECT_THAT(failed->events(0).text(), HasSubstr("stopped: its game native:arena@aaaaaaaa"));
}

TEST_F(GameDeathsTest, OneThatComesAfterAMinuteOfStepsIsTheFirstAgain) {
  EXPECT_TRUE(Count(Death(5), 100));
  EXPECT_TRUE(Count(Death(6), 100 + kForgivenTicks - 1));
  EXPECT_THAT(record_.game_deaths().incarnations(), ElementsAre(5, 6));
  EXPECT_TRUE(Count(Death(7), 100 + 2 * kForgivenTicks));
  EXPECT_THAT(record_.game_deaths().incarnations(), ElementsAre(7));
}

TEST_F(GameDeathsTest, TheSameDeathIsCountedOnce) {
  const v1::WorkerExited death = Death(5);
  EXPECT_TRUE(Count(death, 100));
  EXPECT_FALSE(Count(death, 100)) << "an agent repeats an exit on each new stream";
}

TEST_F(GameDeathsTest, AWorkerThatWasDeclaredDeadForItsSilenceStillCounts) {
  const v1::WorkerExited death = Death(5);
  record_.clear_placements();
  EXPECT_FALSE(Count(death, 100)) << "nothing is known of it";
  records::Dead& dead = *record_.mutable_failover()->add_dead();
  dead.set_host_id("host-2");
  dead.set_incarnation(5);
  EXPECT_TRUE(Count(death, 100));
}

TEST_F(GameDeathsTest, NobodyElseIsBelieved) {
  const v1::WorkerExited death = Death(5);
  host_.set_id("host-3");
  EXPECT_FALSE(Count(death, 100)) << "another host's worker";
  host_.set_id("host-2");
  record_.set_game_native(false);
  EXPECT_FALSE(Count(death, 100)) << "a game in Lua crashes nobody";
  record_.set_game_native(true);
  v1::WorkerExited other = death;
  other.clear_died_in_game();
  EXPECT_FALSE(Count(other, 100)) << "it died elsewhere";
  record_.set_state(v1::INSTANCE_STATE_STOPPING);
  EXPECT_FALSE(Count(death, 100)) << "nobody waits for it";
}

TEST_F(GameDeathsTest, ARestoreByItselfKeepsTheCountAndCountsStepsFromItsTick) {
  EXPECT_TRUE(Count(Death(5), 10'000));
  records::Instance next = record_;
  FollowRestore(record_, 9'000, next);
  record_ = next;
  EXPECT_TRUE(Count(Death(6), 9'000 + kForgivenTicks - 1));
  EXPECT_THAT(record_.game_deaths().incarnations(), ElementsAre(5, 6));
}

TEST_F(GameDeathsTest, AnOperatorsRestoreOfAWorldThatFailedBeginsWithoutDeaths) {
  EXPECT_TRUE(Count(Death(5), 100));
  record_.set_state(v1::INSTANCE_STATE_FAILED);
  records::Instance next = record_;
  FollowRestore(record_, 90, next);
  EXPECT_FALSE(next.has_game_deaths());
}

}  // namespace
}  // namespace tessera::control
