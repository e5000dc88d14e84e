#include "region_worker/core/standby_copies.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "region_worker/testing/regions.h"
#include "region_worker/testing/small_world.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr RegionId kPrimary{2};

class StandbyCopiesTest : public testing::Test {
 protected:
  StandbyCopiesTest() { links_.Up(kPrimary, Incarnation(1), TimePoint(), actions_); }
  // The regions that it has asked for a whole state since the last call.
  std::vector<RegionId> TakeAsked() {
    std::vector<RegionId> asked;
    for (const SentMessage& sent : TakeSent(actions_)) {
      if (sent.message.kind == LinkMessageKind::kLogAgain) asked.push_back(sent.to);
    }
    return asked;
  }

  const region::Catalog catalog_{SmallWorld()};
  LinkTable links_{kSelf};
  Actions actions_;
  TimePoint now_;
  StandbyCopies copies_{catalog_};
  const std::vector<RegionId> primaries_ = {kPrimary};
};

TEST_F(StandbyCopiesTest, AStandbyThatHearsLateOfItsPrimaryAsksForAllThatItMissed) {
  copies_.Set(primaries_, now_, links_, actions_);
  EXPECT_THAT(TakeAsked(), ElementsAre(kPrimary));
  copies_.Set(primaries_, now_, links_, actions_);
  EXPECT_THAT(TakeAsked(), IsEmpty());
}

TEST_F(StandbyCopiesTest, ACopyOutlivesItsOrderUntilTheNewStandbyHasOne) {
  copies_.Set(primaries_, now_, links_, actions_);
  (void)TakeAsked();
  region::RegionState state;
  state.region = kPrimary;
  state.incarnation = Incarnation(1);
  state.tick = Tick(5);
  const auto receive = [&] {
    const region::Bytes bytes = region::EncodeState(state);
    copies_.OnLog(kPrimary, {.kind = LinkMessageKind::kLog, .bytes = bytes, .last = true}, now_, links_, actions_);
  };
  receive();
  ASSERT_THAT(copies_.Whole(), SizeIs(1));
  copies_.Set({}, now_, links_, actions_);
  state.tick = Tick(6);
  receive();
  ASSERT_THAT(copies_.Whole(), SizeIs(1));
  EXPECT_EQ(copies_.Whole()[0]->tick(), Tick(5)) << "another region follows it from now on";
  copies_.Expire(now_ + StandbyCopies::kRetiredFor - std::chrono::milliseconds(1));
  EXPECT_THAT(copies_.Whole(), SizeIs(1));
  copies_.DeclareDead(kPrimary);
  copies_.Expire(now_ + StandbyCopies::kRetiredFor);
  EXPECT_THAT(copies_.Dead(), SizeIs(1)) << "it may be all that there is";
  copies_.Forget(links_, actions_);
  EXPECT_THAT(copies_.Whole(), IsEmpty());
}

TEST_F(StandbyCopiesTest, ARetiredCopyEndsAfterAWhileAndBeginsAnewIfItIsWantedAgain) {
  copies_.Set(primaries_, now_, links_, actions_);
  copies_.Set({}, now_, links_, actions_);
  EXPECT_THAT(TakeAsked(), ElementsAre(kPrimary));
  copies_.Set(primaries_, now_, links_, actions_);
  EXPECT_THAT(TakeAsked(), ElementsAre(kPrimary));
  copies_.Set({}, now_, links_, actions_);
  copies_.Expire(now_ + StandbyCopies::kRetiredFor);
  EXPECT_EQ(copies_.AcknowledgedAt(kPrimary), std::nullopt);
}

TEST_F(StandbyCopiesTest, ACopyThatIsWantedAgainStaysUntilAWholeStateIsInItsPlace) {
  copies_.Set(primaries_, now_, links_, actions_);
  region::RegionState state;
  state.region = kPrimary;
  state.incarnation = Incarnation(1);
  const auto receive = [&](std::uint64_t tick) {
    state.tick = Tick(tick);
    const region::Bytes bytes = region::EncodeState(state);
    copies_.OnLog(kPrimary, {.kind = LinkMessageKind::kLog, .bytes = bytes, .last = true}, now_, links_, actions_);
  };
  receive(5);
  copies_.Set({}, now_, links_, actions_);
  copies_.Set(primaries_, now_, links_, actions_);
  ASSERT_THAT(copies_.Whole(), SizeIs(1)) << "a death now must find it";
  EXPECT_EQ(copies_.Whole()[0]->tick(), Tick(5));
  v1::WorkerReport report;
  copies_.Report(report);
  EXPECT_THAT(report.standby_copies(), IsEmpty()) << "it lacks what came meanwhile";
  const auto answers = [&](LinkMessageKind kind) {
    return std::ranges::count_if(TakeSent(actions_),
                                 [&](const SentMessage& sent) { return sent.message.kind == kind; });
  };
  (void)TakeAsked();
  copies_.OnLeaseAsk(kPrimary, 1, now_, links_, actions_);
  EXPECT_EQ(answers(LinkMessageKind::kLeaseGiven), 0);
  receive(5);
  EXPECT_EQ(answers(LinkMessageKind::kLogTaken), 0) << "nothing new";
  receive(9);
  EXPECT_EQ(answers(LinkMessageKind::kLogTaken), 1);
  copies_.Report(report);
  ASSERT_THAT(report.standby_copies(), SizeIs(1));
  EXPECT_EQ(report.standby_copies(0).tick(), 9U);
}

TEST_F(StandbyCopiesTest, TheNextLifeOfADeadPrimaryIsAskedOnceTheDeadIsSettled) {
  copies_.Set(primaries_, now_, links_, actions_);
  (void)TakeAsked();
  copies_.DeclareDead(kPrimary);
  copies_.Set(primaries_, now_, links_, actions_);
  EXPECT_THAT(TakeAsked(), IsEmpty());
  copies_.Forget(links_, actions_);
  EXPECT_THAT(TakeAsked(), ElementsAre(kPrimary));
}

}  // namespace
}  // namespace tessera::worker
