// Workers under deaths, leases and planned maps: real programs, with this test as agent and control plane.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>

#include "core/region/census.h"
#include "core/region/failover_io.h"
#include "core/world/partition_change.h"
#include "region_worker/testing/agented_workers.h"
#include "region_worker/worker_options.h"

namespace tessera::worker {
namespace {

constexpr char kScene[] = R"(
  name: "field"
  bounds { min { x: -20 y: -2 z: -20 } max { x: 20 y: 30 z: 20 } }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  scatters {
    first_id: 100 count: 60
    area { min { x: -15 y: 1 z: -15 } max { x: 15 y: 3 z: 15 } }
    spacing: 1.2
    templates { mass: 1 linear_velocity { x: 2 z: 1 } never_sleeps: true shape { sphere { radius: 0.4 } } }
  }
)";
constexpr std::uint64_t kBalls = 60;

std::uint64_t ChecksumOfAll() {
  std::uint64_t sum = 0;
  for (std::uint64_t ball = 0; ball < kBalls; ++ball) sum += region::Mix(BodyId(100 + ball));
  return sum;
}

class WorkerFailoverTest : public AgentedWorkers {
 protected:
  WorkerFailoverTest() : AgentedWorkers("plaza-9", kScene) {}

  v1::WorkerOrder NextOrder(std::uint32_t region) {
    v1::WorkerOrder order = OrderBy(*map_, region);
    for (const auto& [other, address] : addresses_) *order.add_peers() = address;
    for (const MapRegion& entry : map_->regions()) {
      if (entry.id.value() == region) order.set_standby(entry.standby.value());
      if (entry.standby.value() == region) order.add_primaries(entry.id.value());
    }
    order.set_run(run_);
    return order;
  }
  // `regions` of them, moving, each with a standby that has its log.
  void StartWorld(std::uint32_t regions) {
    map_ = *MakeGridMap(scene_->ground(), regions);
    for (std::uint32_t region = 1; region <= regions; ++region) StartWorker(region);
    for (std::uint32_t region = 1; region <= regions; ++region) {
      agent_->Give(NextOrder(region));
      addresses_[region] =
          Wait(region, [](const auto& report) { return report.phase() == v1::WORKER_PHASE_BOUND; }).address();
    }
    run_ = true;
    for (std::uint32_t region = 1; region <= regions; ++region) agent_->Give(NextOrder(region));
    for (std::uint32_t region = 1; region <= regions && regions > 1; ++region) {
      Wait(region, [](const auto& report) { return report.acknowledged_tick() > 30 && !report.unprotected(); });
    }
  }
  // By one census after `after` that all of `regions` took, each body is there once.
  void ExpectAllBodies(const std::vector<std::uint32_t>& regions, std::uint64_t after) {
    const std::uint64_t tick = (after / 60 + 1) * 60;
    std::uint64_t owned = 0, checksum = 0;
    for (const std::uint32_t region : regions) {
      const auto at = [&](const v1::WorkerReport& report) {
        return std::ranges::find(report.censuses(), tick, &v1::Census::tick);
      };
      const v1::WorkerReport report = Wait(region, [&](const auto& r) { return at(r) != r.censuses().end(); });
      if (at(report) == report.censuses().end()) return;
      owned += at(report)->owned();
      checksum += at(report)->id_checksum();
    }
    EXPECT_EQ(owned, kBalls);
    EXPECT_EQ(checksum, ChecksumOfAll());
  }
  // Acts as the control plane does when `dead` is gone; gives the tick at which the world goes on.
  std::uint64_t FailOver(std::uint32_t dead) {
    const RegionId gone(dead);
    const MapVersion version(map_->version().value() + 1);
    map_ = *FailoverMap(*map_, std::span(&gone, 1), version);
    addresses_.erase(dead);
    v1::Failover failover;
    failover.set_version(version.value());
    failover.add_dead()->set_region(dead);
    failover.mutable_dead(0)->set_incarnation(5);
    const auto order_of = [&](std::uint32_t region) {
      v1::WorkerOrder order = NextOrder(region);
      *order.mutable_failover() = failover;
      return order;
    };
    std::vector<region::Inventory> inventories;
    for (const MapRegion& live : map_->regions()) agent_->Give(order_of(live.id.value()));
    for (const MapRegion& live : map_->regions()) {
      const auto inventory = agent_->WaitForInventory(live.id.value(), version.value());
      EXPECT_TRUE(inventory.has_value());
      inventories.push_back(*region::FromProto(inventory.value_or(v1::Inventory())));
    }
    const auto resolution = region::Resolve(*map_, std::span(&gone, 1), inventories);
    EXPECT_TRUE(resolution.ok()) << resolution.status();
    for (const MapRegion& live : map_->regions()) {
      v1::WorkerOrder order = order_of(live.id.value());
      *order.mutable_resolution() = region::ToProto(*resolution);
      agent_->Give(order);
    }
    for (const MapRegion& live : map_->regions()) {
      Wait(live.id.value(), [&](const auto& report) { return report.map_version() == version.value(); });
    }
    return resolution->resume_tick.value();
  }

  std::optional<PartitionMap> map_;
  std::map<std::uint32_t, v1::RegionAddress> addresses_;
  bool run_ = false;
};

TEST_F(WorkerFailoverTest, AKilledWorkersBodiesGoOnWithItsStandby) {
  StartWorld(4);
  workers_[2]->Signal(SIGKILL);
  workers_[2]->Wait();
  const std::uint64_t resumed = FailOver(2);
  ExpectAllBodies({1, 3, 4}, resumed);
}

TEST_F(WorkerFailoverTest, TwoDeathsOneAfterTheOtherLoseNothing) {
  StartWorld(4);
  workers_[4]->Signal(SIGKILL);
  FailOver(4);
  for (const MapRegion& live : map_->regions()) {
    if (live.standby == RegionId()) continue;
    Wait(live.id.value(), [&](const auto& report) {
      return report.map_version() == map_->version().value() && !report.unprotected() && report.acknowledged_tick() > 0;
    });
  }
  const auto second =
      std::ranges::find_if(map_->regions(), [](const auto& live) { return live.standby != RegionId(); });
  ASSERT_NE(second, map_->regions().end());
  const std::uint32_t dead = second->id.value();
  workers_[dead]->Signal(SIGKILL);
  const std::uint64_t resumed = FailOver(dead);
  std::vector<std::uint32_t> left;
  for (const MapRegion& live : map_->regions()) left.push_back(live.id.value());
  ExpectAllBodies(left, resumed);
}

TEST_F(WorkerFailoverTest, WithoutALeaseItPausesAndGoesOnWhenItIsBack) {
  StartWorld(2);
  agent_->GiveLeases(false);
  workers_[2]->Signal(SIGSTOP);  // the standby of region 1, and silent
  const v1::WorkerReport paused = Wait(1, [](const auto& report) { return report.paused(); });
  EXPECT_EQ(paused.phase(), v1::WORKER_PHASE_RUNNING);
  workers_[2]->Signal(SIGCONT);
  const v1::WorkerReport back = Wait(1, [&](const auto& report) {
    return report.tick() > paused.tick() + 60 && !report.paused() && !report.unprotected();
  });
  ExpectAllBodies({1, 2}, back.tick());
}

TEST_F(WorkerFailoverTest, OneThatWasDeclaredDeadEnds) {
  StartWorld(2);
  v1::WorkerOrder order = NextOrder(1);
  const RegionId gone(1);
  *order.mutable_map() = ToProto(*FailoverMap(*map_, std::span(&gone, 1), MapVersion(2)));
  order.clear_standby();
  order.clear_primaries();
  order.mutable_failover()->set_version(2);
  v1::DeadRegion& self = *order.mutable_failover()->add_dead();
  self.set_region(1);
  self.set_incarnation(5);
  agent_->Give(order);
  EXPECT_EQ(workers_[1]->Wait(), 0);
  EXPECT_NE(workers_[1]->said().find("fenced"), std::string::npos);
}

}  // namespace
}  // namespace tessera::worker
