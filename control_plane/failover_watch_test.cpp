#include "control_plane/failover_watch.h"

#include <gtest/gtest.h>

#include "control_plane/control_settings.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kDead = 7;

Now At(milliseconds steady) { return {seconds(1000) + steady, seconds(0)}; }

// Regions 1 and 2 live, region 3 was silent and is declared dead; map version 5.
records::Instance Failing() {
  records::Instance record;
  record.mutable_map()->set_version(5);
  for (const std::uint32_t region : {1, 2}) record.add_placements()->set_region(region);
  records::Dead& dead = *record.mutable_failover()->add_dead();
  dead.set_region(3);
  dead.set_incarnation(kDead);
  return record;
}

v1::Inventory InventoryOf(std::uint32_t region, std::uint64_t version = 5) {
  v1::Inventory inventory;
  inventory.set_region(region);
  inventory.set_version(version);
  inventory.set_tick(100);
  return inventory;
}

TEST(FailoverWatchTest, WaitsForTheInventoriesOfAllTheLiving) {
  const records::Instance record = Failing();
  FailoverWatch watch;
  watch.Begin(record, {{kDead, Steady(0)}}, At(milliseconds(0)));
  EXPECT_EQ(watch.WaitsFor(record, At(milliseconds(0))), "the inventories of regions 1, 2");
  EXPECT_TRUE(*watch.Add(record, 1, InventoryOf(1), At(milliseconds(1))));
  EXPECT_EQ(watch.WaitsFor(record, At(milliseconds(1))), "the inventory of region 2");
  EXPECT_TRUE(*watch.Add(record, 2, InventoryOf(2), At(milliseconds(2))));
  EXPECT_EQ(watch.WaitsFor(record, At(milliseconds(2))), "") << "it never had a lease";
  EXPECT_EQ(watch.inventories().size(), 2U);
}

TEST(FailoverWatchTest, RefusesWhatBelongsElsewhere) {
  const records::Instance record = Failing();
  FailoverWatch watch;
  watch.Begin(record, {}, At(milliseconds(0)));
  EXPECT_FALSE(*watch.Add(record, 1, InventoryOf(1, 4), At(milliseconds(1)))) << "of an earlier failover";
  EXPECT_FALSE(watch.Add(record, 1, InventoryOf(2), At(milliseconds(1))).ok()) << "of another region";
  EXPECT_TRUE(watch.inventories().empty());
}

TEST(FailoverWatchTest, ALeaseRunsOutAfterItsLastRenewalByAnybody) {
  const records::Instance record = Failing();
  FailoverWatch watch;
  watch.Begin(record, {{kDead, At(milliseconds(-300)).steady}}, At(milliseconds(0)));
  v1::Inventory witness = InventoryOf(1);
  v1::StandbyCopyInventory& copy = *witness.add_standby_copies();
  copy.set_region(3);
  copy.set_incarnation(kDead);
  copy.set_last_acknowledged_ms(100);
  ASSERT_TRUE(*watch.Add(record, 1, witness, At(milliseconds(50))));
  ASSERT_TRUE(*watch.Add(record, 2, InventoryOf(2), At(milliseconds(50))));
  const milliseconds out = milliseconds(50 - 100) + kLeaseTtl + kLeaseDrift;  // the standby renewed it last
  EXPECT_EQ(watch.WaitsFor(record, At(out - milliseconds(1))), "the lease of region 3 to run out");
  EXPECT_EQ(watch.WaitsFor(record, At(out)), "");
}

TEST(FailoverWatchTest, AWholeLeaseIsWaitedForWhereNothingIsKnownAndNoneWhereTheEndWasSeen) {
  const records::Instance record = Failing();
  FailoverWatch watch;
  watch.Begin(record, {}, At(milliseconds(0)));  // as a control plane does that has just started
  for (const std::uint32_t region : {1, 2}) {
    ASSERT_TRUE(*watch.Add(record, region, InventoryOf(region), At(milliseconds(1))));
  }
  EXPECT_EQ(watch.WaitsFor(record, At(kLeaseTtl)), "the lease of region 3 to run out");
  EXPECT_EQ(watch.WaitsFor(record, At(kLeaseTtl + kLeaseDrift)), "");
  watch.AddExit(kDead);
  EXPECT_EQ(watch.WaitsFor(record, At(milliseconds(2))), "");
}

TEST(FailoverWatchTest, AnotherDeathAsksForAllInventoriesAnewAndKeepsWhatIsKnownOfTheFirst) {
  records::Instance record = Failing();
  FailoverWatch watch;
  watch.Begin(record, {{kDead, At(milliseconds(0)).steady}}, At(milliseconds(0)));
  ASSERT_TRUE(*watch.Add(record, 1, InventoryOf(1), At(milliseconds(1))));
  record.mutable_map()->set_version(6);
  records::Dead& second = *record.mutable_failover()->add_dead();
  second.set_region(2);
  second.set_incarnation(8);
  second.set_exit_seen(true);
  record.mutable_placements()->RemoveLast();
  watch.Begin(record, {{8, Steady(0)}}, At(milliseconds(10)));
  EXPECT_EQ(watch.WaitsFor(record, At(milliseconds(10))), "the inventory of region 1");
  ASSERT_TRUE(*watch.Add(record, 1, InventoryOf(1, 6), At(milliseconds(11))));
  EXPECT_EQ(watch.WaitsFor(record, At(milliseconds(11))), "the lease of region 3 to run out");
  EXPECT_EQ(watch.WaitsFor(record, At(kLeaseTtl + kLeaseDrift)), "");
}

}  // namespace
}  // namespace tessera::control
