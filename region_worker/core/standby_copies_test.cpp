#include "region_worker/core/standby_copies.h"

#include <gmock/gmock.h>

#include "region_worker/testing/regions.h"
#include "region_worker/testing/small_world.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr RegionId kPrimary{2};

class StandbyCopiesTest : public testing::Test {
 protected:
  StandbyCopiesTest() { links_.Up(kPrimary, Incarnation(1), TimePoint(), actions_); }
  // Whom it has asked for a whole state since it was last asked.
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
  StandbyCopies copies_{catalog_};
  const std::vector<RegionId> primaries_ = {kPrimary};
};

TEST_F(StandbyCopiesTest, AStandbyThatHearsLateOfItsPrimaryAsksForAllThatItMissed) {
  copies_.Set(primaries_, links_, actions_);
  EXPECT_THAT(TakeAsked(), ElementsAre(kPrimary));
  copies_.Set(primaries_, links_, actions_);
  EXPECT_THAT(TakeAsked(), IsEmpty());
}

TEST_F(StandbyCopiesTest, TheNextLifeOfADeadPrimaryIsAskedOnceTheDeadIsSettled) {
  copies_.Set(primaries_, links_, actions_);
  (void)TakeAsked();
  copies_.DeclareDead(kPrimary);
  copies_.Set(primaries_, links_, actions_);
  EXPECT_THAT(TakeAsked(), IsEmpty());
  copies_.Forget(links_, actions_);
  EXPECT_THAT(TakeAsked(), ElementsAre(kPrimary));
}

}  // namespace
}  // namespace tessera::worker
