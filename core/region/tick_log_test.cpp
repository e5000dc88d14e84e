#include "core/region/tick_log.h"

#include <gtest/gtest.h>

namespace tessera::region {
namespace {

class TickLogTest : public ::testing::Test {
 protected:
  bool WritesWhole(Tick tick) {
    LogView view{RegionId(1), Incarnation(1), tick, {}, {}, {}, {}, &grants, {}};
    return DecodeLogHeader(log.Write(view, {}))->whole;
  }
  TickLog log{1.0 / 60};
  const KeptGrants grants{};
};

TEST_F(TickLogTest, BeginsWithAWholeStateAndGoesOnWithChanges) {
  EXPECT_FALSE(log.on());
  log.Switch(true);
  EXPECT_TRUE(WritesWhole(Tick(1)));
  EXPECT_FALSE(WritesWhole(Tick(2)));
  log.Restart();
  EXPECT_TRUE(WritesWhole(Tick(3)));
}

TEST_F(TickLogTest, TheStandbyHasWhatItAcknowledgedAndNeverMoreThanThereIs) {
  EXPECT_EQ(log.standby_has(), std::nullopt);
  log.Switch(true);
  EXPECT_EQ(log.standby_has(), Tick());
  log.Acknowledged(Tick(5), Tick(7));
  log.Acknowledged(Tick(4), Tick(7));
  log.Acknowledged(Tick(9), Tick(7));
  EXPECT_EQ(log.acknowledged(), Tick(5));
  log.Switch(true);  // another standby
  EXPECT_EQ(log.standby_has(), Tick());
  log.Switch(false);
  log.Acknowledged(Tick(6), Tick(7));
  EXPECT_EQ(log.acknowledged(), Tick());
}

TEST_F(TickLogTest, AMessageThatWasNotWrittenIsNoticed) {
  log.Validate(Tick(1));
  log.Switch(true);
  EXPECT_DEBUG_DEATH(log.Validate(Tick(1)), "");
  EXPECT_TRUE(WritesWhole(Tick(1)));
  log.Validate(Tick(1));
  EXPECT_DEBUG_DEATH(log.Validate(Tick(2)), "");
}

}  // namespace
}  // namespace tessera::region
