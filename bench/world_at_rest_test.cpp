#include "bench/world_at_rest.h"

#include <gtest/gtest.h>

#include <string>

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;

// Two regions on two hosts, each of which stands by for the other.
v1::Instance RestingWorld() {
  v1::Instance world;
  world.set_state(v1::INSTANCE_STATE_RUNNING);
  world.mutable_map()->set_version(3);
  for (const std::uint32_t id : {1u, 2u}) {
    v1::MapRegion& region = *world.mutable_map()->add_regions();
    region.set_id(id);
    region.set_standby(3 - id);
    v1::RegionStatus& status = *world.add_region_status();
    status.set_region(id);
    status.set_host("local-" + std::to_string(id));
    v1::WorkerReport& report = *status.mutable_report();
    report.set_phase(v1::WORKER_PHASE_RUNNING);
    report.set_acknowledged_tick(7);
    report.set_map_version(3);
  }
  return world;
}

TEST(WorldAtRestTest, RestsWithAllItsRegionsProtected) {
  const v1::Instance world = RestingWorld();
  EXPECT_TRUE(IsAtRest(world, 2));
  EXPECT_FALSE(IsAtRest(world, 3)) << "one is still to come";
}

TEST(WorldAtRestTest, DoesNotRestWhileItIsChanged) {
  v1::Instance failed = RestingWorld();
  failed.set_state(v1::INSTANCE_STATE_FAILED);
  EXPECT_FALSE(IsAtRest(failed, 2));
  v1::Instance changed = RestingWorld();
  changed.add_changes();
  EXPECT_FALSE(IsAtRest(changed, 2));
  v1::Instance behind = RestingWorld();
  behind.mutable_region_status(1)->mutable_report()->set_map_version(2);
  EXPECT_FALSE(IsAtRest(behind, 2));
}

TEST(WorldAtRestTest, DoesNotRestWithARegionThatNobodyFollows) {
  v1::Instance unprotected = RestingWorld();
  unprotected.add_unprotected_regions(2);
  EXPECT_FALSE(IsAtRest(unprotected, 2));
  v1::Instance silent = RestingWorld();
  silent.mutable_region_status(0)->mutable_report()->set_acknowledged_tick(0);
  EXPECT_FALSE(IsAtRest(silent, 2));
  v1::Instance alone = RestingWorld();
  alone.mutable_map()->mutable_regions(0)->set_standby(0);
  EXPECT_FALSE(IsAtRest(alone, 2));
  v1::Instance together = RestingWorld();
  together.mutable_region_status(1)->set_host("local-1");
  EXPECT_FALSE(IsAtRest(together, 2)) << "the death of a host would take both";
}

TEST(WorldAtRestTest, IsSpreadEvenlyWithOneRegionMoreAtMost) {
  v1::Instance world = RestingWorld();
  EXPECT_TRUE(IsSpreadEvenly(world));
  world.add_region_status()->set_host("local-1");
  EXPECT_TRUE(IsSpreadEvenly(world)) << "three regions go no more evenly on two hosts";
  world.add_region_status()->set_host("local-1");
  EXPECT_FALSE(IsSpreadEvenly(world));
}

TEST(SteadyForTest, CountsAnewAfterABreak) {
  SteadyFor steady(1s);
  const SteadyFor::TimePoint start{100s};
  EXPECT_FALSE(steady.Take(true, start));
  EXPECT_FALSE(steady.Take(false, start + 900ms));
  EXPECT_FALSE(steady.Take(true, start + 1s));
  EXPECT_FALSE(steady.Take(true, start + 1900ms));
  EXPECT_TRUE(steady.Take(true, start + 2s));
}

}  // namespace
}  // namespace tessera::bench
