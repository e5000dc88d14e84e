// A checker that finds nothing false must be able to: it is fed lies and truths.
#include "tests/simulation/false_words.h"

#include <gmock/gmock.h>

namespace tessera::simulation {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr Micros kTick = Milliseconds(10);

class FalseWordsTest : public testing::Test {
 protected:
  // For so long, region 1 steps, and region 2 if `both`; `words` are said meanwhile.
  void Pass(Micros span, bool both, const std::vector<Word>& words) {
    for (const Micros end = now_ + span; now_ < end;) {
      now_ += kTick;
      tick_ = tick_ + 1;
      words_.Stepped(RegionId(1), Incarnation(1), tick_, now_);
      if (both) words_.Stepped(RegionId(2), Incarnation(2), tick_, now_);
      words_.Look(now_, world_, words);
    }
  }

  const std::vector<RegionId> world_ = {RegionId(1), RegionId(2)};
  Micros now_ = 0;
  Tick tick_;
  FalseWords words_;
};

TEST_F(FalseWordsTest, AWorldThatStepsAndIsCalledRunningIsNoLie) {
  Pass(Milliseconds(10'000), true, {{.reign = 1, .said = Said::kRunning}});
  EXPECT_THAT(words_.problems(), IsEmpty());
  EXPECT_EQ(words_.stood(), 0U);
}

TEST_F(FalseWordsTest, RunningMayBeSaidForTwoSecondsOfAWorldThatStandsAndNoLonger) {
  Pass(Milliseconds(1000), true, {{.reign = 1, .said = Said::kRunning}});
  Pass(Milliseconds(2200), false, {{.reign = 1, .said = Said::kRunning}});
  EXPECT_THAT(words_.problems(), IsEmpty());
  EXPECT_EQ(words_.stood(), Milliseconds(2210)) << "to the next look";
  Pass(Milliseconds(3000), false, {{.reign = 1, .said = Said::kRunning}});
  EXPECT_EQ(words_.lies(), 1U) << "one time on end is one lie";
  EXPECT_THAT(words_.problems(), ElementsAre(HasSubstr("RUNNING is said for 2.010 s, region 2 stands since 1.000 s")));
  EXPECT_GE(words_.false_running(), Milliseconds(4900));
}

TEST_F(FalseWordsTest, DegradedMayBeSaidForTwoSecondsOfAWorldThatStepsAndNoLonger) {
  Pass(Milliseconds(2000), true, {{.reign = 1, .said = Said::kDegraded}});
  EXPECT_THAT(words_.problems(), IsEmpty());
  Pass(Milliseconds(20), true, {{.reign = 1, .said = Said::kDegraded}});
  EXPECT_EQ(words_.lies(), 1U);
  EXPECT_THAT(words_.problems(), ElementsAre(HasSubstr("DEGRADED is said")));
}

TEST_F(FalseWordsTest, DegradedIsNoLieOfAWorldThatStandsOrOfWhoCannotSeeIt) {
  Pass(Milliseconds(300), false, {{.reign = 1, .said = Said::kDegraded}});
  Pass(Milliseconds(5000), false, {{.reign = 1, .said = Said::kDegraded}});
  Pass(Milliseconds(5000), true, {{.reign = 1, .said = Said::kDegraded, .sees = false}});
  EXPECT_THAT(words_.problems(), IsEmpty());
}

TEST_F(FalseWordsTest, EachReignHasItsOwnTimeAndASilentOneNone) {
  Pass(Milliseconds(1500), false, {{.reign = 1, .said = Said::kRunning}});
  Pass(Milliseconds(3000), false, {});
  Pass(Milliseconds(1900), false, {{.reign = 2, .said = Said::kRunning}});
  EXPECT_THAT(words_.problems(), IsEmpty());
  EXPECT_EQ(words_.silent(), Milliseconds(3000));
  // The first one goes on where it was: silence is no truth.
  Pass(Milliseconds(900), false, {{.reign = 1, .said = Said::kRunning}});
  EXPECT_EQ(words_.lies(), 1U);
}

TEST_F(FalseWordsTest, OneOfTwoWhoSpeakMayLie) {
  Pass(Milliseconds(6000), false, {{.reign = 1, .said = Said::kRunning}, {.reign = 2, .said = Said::kDegraded}});
  EXPECT_EQ(words_.lies(), 1U);
}

TEST_F(FalseWordsTest, AWorldThatIsSaidToBeOverIsALieAtOnce) {
  Pass(Milliseconds(100), true, {{.reign = 1, .said = Said::kOver}});
  EXPECT_EQ(words_.lies(), 1U);
}

// --- Owners.

TEST_F(FalseWordsTest, ALifeThatTakesAnothersPlaceAtLaterTicksIsTheOneOwner) {
  words_.Stepped(RegionId(2), Incarnation(2), Tick(50), now_);
  words_.Stepped(RegionId(2), Incarnation(9), Tick(51), now_);
  words_.Stepped(RegionId(2), Incarnation(9), Tick(52), now_);
  EXPECT_EQ(words_.two_owners(), 0U);
}

TEST_F(FalseWordsTest, WhoStepsOnAfterAnotherTookItsPlaceIsASecondOwner) {
  words_.Stepped(RegionId(2), Incarnation(2), Tick(50), now_);
  words_.Stepped(RegionId(2), Incarnation(9), Tick(51), now_);
  for (std::uint64_t tick = 51; tick < 60; ++tick) words_.Stepped(RegionId(2), Incarnation(2), Tick(tick), now_);
  EXPECT_EQ(words_.two_owners(), 1U) << "once for a life";
  EXPECT_THAT(words_.problems(), SizeIs(1));
}

TEST_F(FalseWordsTest, AWorldThatIsSetBackHasTwoOwnersOfItsTicks) {
  words_.Stepped(RegionId(2), Incarnation(2), Tick(50), now_);
  words_.Stepped(RegionId(2), Incarnation(9), Tick(21), now_);
  EXPECT_EQ(words_.two_owners(), 0U) << "as a death may set it back";
  words_.Stepped(RegionId(2), Incarnation(9), Tick(50), now_);
  words_.Stepped(RegionId(2), Incarnation(11), Tick(20), now_);
  EXPECT_EQ(words_.two_owners(), 1U);
}

// --- Changes.

TEST_F(FalseWordsTest, AnAcknowledgedChangeThatIsNotThereIsLostOnce) {
  words_.Acknowledged("one");
  words_.Acknowledged("two");
  words_.CheckKept(now_, {"one", "two", "never acknowledged"});
  EXPECT_EQ(words_.lost_changes(), 0U);
  words_.CheckKept(now_, {"two"});
  words_.CheckKept(now_, {"two"});
  EXPECT_EQ(words_.lost_changes(), 1U);
  EXPECT_THAT(words_.problems(), ElementsAre(HasSubstr("one was acknowledged")));
}

TEST_F(FalseWordsTest, WhatIsNewerThanABackupThatIsPutBackIsLostRightly) {
  words_.Acknowledged("old");
  words_.Acknowledged("new");
  words_.PutBack({"old"});
  words_.CheckKept(now_, {"old"});
  EXPECT_EQ(words_.lost_changes(), 0U);
  words_.CheckKept(now_, {});
  EXPECT_EQ(words_.lost_changes(), 1U) << "what it has is not";
}

}  // namespace
}  // namespace tessera::simulation
