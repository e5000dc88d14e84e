// Worlds whose regions are added, moved, evened out and replaced while players play.
#include "host/process.h"
#include "local_cluster/connection.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

class GrowthTest : public WorldTest {
 protected:
  void ScaleTo(std::uint32_t regions) {
    v1::ScaleInstanceRequest request;
    request.set_id(run_->instance_id());
    request.set_regions(regions);
    run_->connection().Call("instance scale", run_->connection().instances(), &v1::InstanceService::Stub::ScaleInstance,
                            request);
    ASSERT_TRUE(PlayUntil("that many regions", [&] {
      return run_->Latest().map().regions_size() == static_cast<int>(regions) && IsSettled();
    }));
  }
  std::map<std::uint32_t, std::string> Hosts() {
    std::map<std::uint32_t, std::string> hosts;
    const v1::Instance instance = run_->Latest();
    for (const v1::RegionStatus& status : instance.region_status()) hosts[status.region()] = status.host();
    return hosts;
  }
};

TEST_F(GrowthTest, FromTwoToFourAndBackUnderLoadNothingIsLost) {
  Start(2, 1, 8);
  ASSERT_TRUE(PlayUntilProtected());
  ASSERT_TRUE(PlayOn(1));
  ScaleTo(4);
  ASSERT_TRUE(PlayOn(2));
  ScaleTo(2);
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

TEST_F(GrowthTest, ADrainedHostIsLeftByAllItsRegionsWhileTheWorldRuns) {
  Start(4, 2, 8);
  ASSERT_TRUE(PlayUntilProtected());
  ASSERT_TRUE(PlayOn(1));
  EXPECT_EQ(Tessera({"host", "drain", "local-1"}).exit_code, 0);
  ASSERT_TRUE(PlayUntil("nothing runs on the host", [&] {
    return IsSettled() && std::ranges::none_of(Hosts(), [](const auto& at) { return at.second == "local-1"; });
  }));
  EXPECT_EQ(run_->Latest().map().regions_size(), 4);
  ASSERT_TRUE(PlayOn(2));
  const support::RunResult removed = Tessera({"host", "remove", "local-1"});
  EXPECT_EQ(removed.exit_code, 0) << removed.err;
  ExpectAllIsThere();
}

TEST_F(GrowthTest, RestartingTheWorkersReplacesEachWhileTheWorldRuns) {
  Start(2, 2, 4);
  ASSERT_TRUE(PlayUntilProtected());
  ASSERT_TRUE(PlayOn(1));
  std::set<std::int64_t> old;
  for (const auto& [region, pid] : Pids()) old.insert(pid);
  v1::RestartWorkersRequest request;
  request.set_id(run_->instance_id());
  run_->connection().Call("restart", run_->connection().instances(), &v1::InstanceService::Stub::RestartWorkers,
                          request);
  ASSERT_TRUE(PlayUntil("all workers are new ones", [&] {
    return IsSettled() && std::ranges::none_of(Pids(), [&](const auto& at) { return old.contains(at.second); });
  }));
  ASSERT_TRUE(PlayOn(2));
  for (const std::int64_t pid : old) EXPECT_FALSE(host::IsAlive(pid));
  EXPECT_EQ(run_->Latest().failovers(), 0u);
  ExpectAllIsThere();
}

// Four of five bodies run into one corner: the borders follow, and then rest.
TEST_F(GrowthTest, BordersMoveTowardsAHotSpotAndComeToRest) {
  Start({.scene = support::ScenePath("rush"),
         .regions = 4,
         .bodies = 400,
         .bots = 1,
         .hosts = 2,
         .capacity = 8,
         .adjust = [](v1::InstanceSpec& spec) { spec.set_balance(true); }});
  const auto busiest = [&] {
    std::uint64_t most = 0, all = 0;
    const v1::Instance instance = run_->Latest();
    for (const v1::RegionStatus& status : instance.region_status()) {
      most = std::max<std::uint64_t>(most, status.report().owned());
      all += status.report().owned();
    }
    return all > 0 ? static_cast<double>(most) / static_cast<double>(all) : 1.0;
  };
  const auto in_corner = [&] {
    double there = 0, all = 0;
    for (const auto& [id, body] : run_->bots()[0]->client().World()) {
      if (id.value() < 1000) continue;
      ++all;
      if (body.state.position.x < -10 && body.state.position.z < -10) ++there;
    }
    return all > 0 ? there / all : 0;
  };
  ASSERT_TRUE(PlayUntil("the crowd is in the corner", [&] { return in_corner() > 0.75; }));
  // One quarter of the world would hold three quarters of the bodies, had the borders not moved.
  ASSERT_TRUE(PlayUntil("the crowd is shared out", [&] { return busiest() < 0.5 && IsSettled(); }));
  ASSERT_TRUE(PlayOn(2));
  const auto found = run_->conservation();
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->lost, 0u);
  EXPECT_EQ(found->duplicated, 0u);
  EXPECT_EQ(run_->Finish().failure, "");
}

}  // namespace
}  // namespace tessera::end_to_end
