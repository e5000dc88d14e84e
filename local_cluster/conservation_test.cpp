#include "local_cluster/conservation.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/region/census.h"

namespace tessera::local {
namespace {

std::vector<BodyId> Ids(std::initializer_list<std::uint64_t> values) {
  std::vector<BodyId> ids;
  for (const std::uint64_t value : values) ids.emplace_back(value);
  return ids;
}

void AddCensus(v1::Instance& instance, std::uint32_t region, std::uint64_t tick, const std::vector<BodyId>& owned) {
  while (static_cast<std::uint32_t>(instance.region_status_size()) < region) {
    instance.add_region_status()->set_region(static_cast<std::uint32_t>(instance.region_status_size()));
  }
  v1::Census& census = *instance.mutable_region_status(static_cast<int>(region) - 1)->mutable_report()->add_censuses();
  census.set_tick(tick);
  census.set_owned(owned.size());
  std::uint64_t checksum = 0;
  for (const BodyId id : owned) checksum += region::Mix(id);
  census.set_id_checksum(checksum);
}

class ConservationTest : public testing::Test {
 protected:
  ConservationTest() { instance_.set_regions(2); }
  v1::Instance instance_;
  Conservation conservation_{Ids({1, 2, 3})};
};

TEST_F(ConservationTest, SaysNothingBeforeEveryRegionReportedATick) {
  AddCensus(instance_, 1, 60, Ids({1, 2, 3}));
  conservation_.Observe(instance_);
  EXPECT_FALSE(conservation_.result().has_value());
}

TEST_F(ConservationTest, FindsAllBodiesWhereverTheyAre) {
  AddCensus(instance_, 1, 60, Ids({1, 3}));
  AddCensus(instance_, 2, 60, Ids({2}));
  AddCensus(instance_, 1, 120, Ids({}));
  AddCensus(instance_, 2, 120, Ids({3, 2, 1}));
  conservation_.Observe(instance_);
  conservation_.Observe(instance_);
  ASSERT_TRUE(conservation_.result().has_value());
  EXPECT_EQ(conservation_.result()->tick, 120u);
  EXPECT_EQ(conservation_.result()->censuses, 2u);
  EXPECT_EQ(conservation_.result()->found, 3u);
  EXPECT_EQ(conservation_.result()->lost, 0u);
  EXPECT_EQ(conservation_.result()->duplicated, 0u);
}

TEST_F(ConservationTest, WhatTheGameRemovedIsNotExpectedAnyMore) {
  AddCensus(instance_, 1, 60, Ids({1, 2}));
  AddCensus(instance_, 2, 60, Ids({3}));
  conservation_.Observe(instance_);
  v1::WorkerReport& report = *instance_.mutable_region_status(1)->mutable_report();
  report.set_tick(100);
  report.add_removed_first(2);
  report.add_removed_last(3);
  AddCensus(instance_, 1, 120, Ids({1}));
  AddCensus(instance_, 2, 120, Ids({}));
  conservation_.Observe(instance_);
  ASSERT_TRUE(conservation_.result().has_value());
  EXPECT_EQ(conservation_.result()->tick, 120u);
  EXPECT_EQ(conservation_.result()->expected, 1u);
  EXPECT_EQ(conservation_.result()->lost, 0u);
  EXPECT_EQ(conservation_.result()->taken_out, 0u);
}

TEST_F(ConservationTest, CountsLostAndDoubledBodies) {
  AddCensus(instance_, 1, 60, Ids({1}));
  AddCensus(instance_, 2, 60, Ids({2}));
  conservation_.Observe(instance_);
  EXPECT_EQ(conservation_.result()->lost, 1u);
  AddCensus(instance_, 1, 120, Ids({1, 2, 3}));
  AddCensus(instance_, 2, 120, Ids({1, 2}));
  conservation_.Observe(instance_);
  EXPECT_EQ(conservation_.result()->duplicated, 2u);
  AddCensus(instance_, 1, 180, Ids({1, 2}));
  AddCensus(instance_, 2, 180, Ids({3}));
  conservation_.Observe(instance_);
  EXPECT_EQ(conservation_.result()->duplicated, 2u) << "the worst is kept";
  EXPECT_EQ(conservation_.result()->lost, 0u) << "what is back was not lost";
}

TEST_F(ConservationTest, SeesOneLostAndAnotherDoubled) {
  AddCensus(instance_, 1, 60, Ids({1, 2}));
  AddCensus(instance_, 2, 60, Ids({2}));
  conservation_.Observe(instance_);
  EXPECT_EQ(conservation_.result()->lost, 1u);
  EXPECT_EQ(conservation_.result()->duplicated, 1u);
}

TEST_F(ConservationTest, ABodyThatItsOwnerTookOutIsCountedAsThatAndNotAsLost) {
  AddCensus(instance_, 1, 60, Ids({1, 3}));
  AddCensus(instance_, 2, 60, Ids({2}));
  conservation_.Observe(instance_);
  v1::WorkerReport& report = *instance_.mutable_region_status(0)->mutable_report();
  report.set_tick(130);
  report.add_nonfinite_ids(3);
  AddCensus(instance_, 1, 120, Ids({1, 3}));
  AddCensus(instance_, 2, 120, Ids({2}));
  conservation_.Observe(instance_);
  AddCensus(instance_, 1, 180, Ids({1}));
  AddCensus(instance_, 2, 180, Ids({2}));
  conservation_.Observe(instance_);
  ASSERT_EQ(conservation_.result()->tick, 180u);
  EXPECT_EQ(conservation_.result()->lost, 0u);
  EXPECT_EQ(conservation_.result()->duplicated, 0u);
  EXPECT_EQ(conservation_.result()->taken_out, 1u);
  AddCensus(instance_, 1, 240, Ids({}));
  AddCensus(instance_, 2, 240, Ids({2}));
  conservation_.Observe(instance_);
  EXPECT_EQ(conservation_.result()->lost, 1u) << "another one";
}

TEST_F(ConservationTest, APlayersBodyCountsFromItsTickOn) {
  conservation_.Expect(PlayerBodyId(PlayerNumber(1)), 100);
  AddCensus(instance_, 1, 60, Ids({1, 2, 3}));
  AddCensus(instance_, 2, 60, Ids({}));
  conservation_.Observe(instance_);
  EXPECT_FALSE(conservation_.result().has_value());
  AddCensus(instance_, 1, 120, Ids({1, 2, 3}));
  AddCensus(instance_, 2, 120, {PlayerBodyId(PlayerNumber(1))});
  conservation_.Observe(instance_);
  EXPECT_EQ(conservation_.result()->expected, 4u);
  EXPECT_EQ(conservation_.result()->lost + conservation_.result()->duplicated, 0u);
}

// The dead region's part of the ticks before is never reported, and one region's census since is incomplete.
TEST_F(ConservationTest, CountsAnewOnceAllRegionsOfANewMapStepByIt) {
  const auto set_map = [&](std::uint64_t version, std::initializer_list<std::uint32_t> regions) {
    instance_.mutable_map()->set_version(version);
    instance_.mutable_map()->clear_regions();
    for (const std::uint32_t region : regions) instance_.mutable_map()->add_regions()->set_id(region);
  };
  set_map(1, {1, 2});
  AddCensus(instance_, 1, 60, Ids({1, 3}));
  AddCensus(instance_, 2, 60, Ids({2}));
  conservation_.Observe(instance_);
  set_map(2, {1});
  AddCensus(instance_, 1, 120, Ids({1, 3}));
  instance_.mutable_region_status(0)->mutable_report()->set_tick(130);
  conservation_.Observe(instance_);
  instance_.mutable_region_status(0)->mutable_report()->set_map_version(2);
  conservation_.Observe(instance_);
  ASSERT_TRUE(conservation_.result().has_value());
  EXPECT_EQ(conservation_.result()->tick, 60u);
  AddCensus(instance_, 1, 180, Ids({1, 2, 3}));
  conservation_.Observe(instance_);
  EXPECT_EQ(conservation_.result()->tick, 180u);
  EXPECT_EQ(conservation_.result()->lost, 0u);
}

}  // namespace
}  // namespace tessera::local
