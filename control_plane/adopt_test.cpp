#include "control_plane/adopt.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

v1::PartitionMap AdoptedMap(std::uint64_t version, std::uint32_t regions) {
  v1::PartitionMap map = ToProto(*MakeGridMap({0, 0, 100, 100}, regions));
  map.set_version(version);
  return map;
}

HeldOrder OrderOf(std::uint32_t region, std::uint64_t incarnation, const v1::PartitionMap& map) {
  HeldOrder held{.host_id = "host-1", .order = {}};
  held.order.set_region(region);
  held.order.set_incarnation(incarnation);
  held.order.set_run(true);
  *held.order.mutable_map() = map;
  return held;
}

// One that was ordered to join by a plan for so many regions.
HeldOrder NewcomerOf(std::uint32_t region, std::uint64_t incarnation, const v1::PartitionMap& map,
                     const v1::PartitionMap& planned) {
  HeldOrder held = OrderOf(region, incarnation, map);
  held.order.set_joins_running(true);
  *held.order.mutable_planned()->mutable_map() = planned;
  held.order.mutable_planned()->set_effective_tick(1);
  return held;
}

// The record of a world that had two regions, 1 and 2, when the backup was made.
records::Instance Adopted(const std::vector<HeldOrder>& orders, const CopiesHeld& copies = {}) {
  records::Instance old;
  *old.mutable_map() = AdoptedMap(1, 2);
  old.set_wanted_regions(2);
  old.set_last_incarnation(1'000'002);
  return AdoptOrders(old, orders, copies, [](const std::string&) { return std::string(); });
}

const records::Placement& PlaceOf(const records::Instance& record, std::uint32_t region) {
  for (const records::Placement& place : record.placements()) {
    if (place.region() == region) return place;
  }
  static const records::Placement kNone;
  return kNone;
}

TEST(AdoptTest, TheWorldIsToHaveAsManyRegionsAsItHas) {
  const v1::PartitionMap map = AdoptedMap(5, 4);
  const records::Instance next = Adopted({OrderOf(1, 1, map), OrderOf(3, 3, map)});
  EXPECT_EQ(next.wanted_regions(), 4U) << "not two, and not any number that is left after a death";
  EXPECT_EQ(next.placements_size(), 4);
}

TEST(AdoptTest, ARegionThatLeavesIsNotWanted) {
  v1::PartitionMap map = AdoptedMap(5, 3);
  map.add_regions()->set_id(4);  // owns no cells any more
  EXPECT_EQ(Adopted({OrderOf(1, 1, map)}).wanted_regions(), 3U);
}

TEST(AdoptTest, ThoseOfAPlanThatGoesOnAreWanted) {
  HeldOrder order = OrderOf(1, 1, AdoptedMap(5, 2));
  *order.order.mutable_planned()->mutable_map() = AdoptedMap(6, 3);
  order.order.mutable_planned()->set_effective_tick(100);
  const records::Instance next = Adopted({order});
  EXPECT_TRUE(next.has_planned());
  EXPECT_EQ(next.wanted_regions(), 3U);
}

TEST(AdoptTest, APlanWhoseNewcomersStillStartIsGivenUpAndItsRegionsAreWanted) {
  const v1::PartitionMap map = AdoptedMap(5, 2);
  const records::Instance next = Adopted({OrderOf(1, 1, map), NewcomerOf(3, 3, map, AdoptedMap(6, 3))});
  EXPECT_FALSE(next.has_planned());
  EXPECT_EQ(next.placements_size(), 2);
  EXPECT_EQ(next.wanted_regions(), 3U);
}

TEST(AdoptTest, APlanThatAFailoverHasDroppedCountsForNothing) {
  const v1::PartitionMap before = AdoptedMap(5, 2);
  const records::Instance next = Adopted({OrderOf(1, 1, AdoptedMap(7, 2)), NewcomerOf(3, 3, before, AdoptedMap(6, 3))});
  EXPECT_EQ(next.wanted_regions(), 2U);
}

TEST(AdoptTest, TheDeadOfAFailoverAreToBeReplaced) {
  HeldOrder order = OrderOf(1, 1, AdoptedMap(5, 3));
  order.order.mutable_failover()->set_version(5);
  order.order.mutable_failover()->add_dead()->set_region(4);
  const records::Instance next = Adopted({order});
  EXPECT_EQ(next.failover().dead_size(), 1);
  EXPECT_EQ(next.wanted_regions(), 4U);
}

TEST(AdoptTest, ARegionOfWhichNobodyHasAnOrderIsTheOneThatItsStandbyHasACopyOf) {
  const std::vector<HeldOrder> orders = {OrderOf(1, 1, AdoptedMap(5, 2))};
  EXPECT_EQ(PlaceOf(Adopted(orders, {{2, 7}}), 2).incarnation(), 7U);
  const records::Instance lied_to = Adopted(orders, {{2, 5'000'000}});
  EXPECT_EQ(PlaceOf(lied_to, 2).incarnation(), 1'000'003U) << "no such number was ever given";
  EXPECT_EQ(lied_to.last_incarnation(), 1'000'003U);
}

TEST(AdoptTest, ANewcomerIsUnprotectedAndJoinsOnlyUntilItsMapIsInForce) {
  const v1::PartitionMap before = AdoptedMap(5, 2), planned = AdoptedMap(6, 3);
  HeldOrder waits = OrderOf(1, 1, before);
  *waits.order.mutable_planned()->mutable_map() = planned;
  waits.order.mutable_planned()->set_effective_tick(100);
  const records::Instance joining = Adopted({waits, NewcomerOf(3, 3, before, planned)});
  EXPECT_TRUE(PlaceOf(joining, 3).joins());
  EXPECT_TRUE(PlaceOf(joining, 3).unprotected()) << "without a copy of it nothing is lost";
  EXPECT_FALSE(PlaceOf(joining, 1).unprotected());

  // Its agent has not heard yet that the map is in force.
  const records::Instance joined = Adopted({OrderOf(1, 1, planned), NewcomerOf(3, 3, before, planned)});
  EXPECT_FALSE(PlaceOf(joined, 3).joins());
  EXPECT_EQ(PlaceOf(joined, 3).incarnation(), 3U);
  EXPECT_TRUE(PlaceOf(joined, 3).unprotected());
}

}  // namespace
}  // namespace tessera::control
