// A world whose regions step more slowly on one host than on the others, under a virtual clock.
#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <string>

#include "control_plane/control_settings.h"
#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Sets what a step takes in each worker, by the host that it runs on.
void StepsTake(ClusterHarness& harness, const std::map<std::string, double>& seconds_by_host) {
  for (auto& [name, agent] : harness.agents) {
    for (auto& [key, worker] : agent.fake.workers) {
      worker.report.mutable_step()->set_p50_seconds(seconds_by_host.at(name));
    }
  }
}

TEST(SlowHostTest, ARegionThatAHostMakesSlowIsMovedAndStaysAway) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  ASSERT_EQ(harness.agents.at("beta").fake.workers.size(), 2u);
  const std::map<std::string, double> times = {{"alpha", 0.010}, {"beta", 0.040}};
  const auto run = [&](milliseconds span) {
    for (; span.count() > 0; span -= milliseconds(500)) {
      StepsTake(harness, times);  // also of workers that have just begun
      harness.Run(milliseconds(500));
    }
  };
  run(kSlowHostAfter - seconds(2));
  EXPECT_EQ(harness.agents.at("beta").fake.workers.size(), 2u) << "it may pass";
  run(seconds(12));
  EXPECT_EQ(harness.Workers(), 4u);
  EXPECT_TRUE(harness.Get(id).changes().empty());
  ExpectEachBodyOnce(harness, 4);
  EXPECT_EQ(harness.agents.at("beta").fake.workers.size(), 1u);
  const v1::Instance moved = harness.Get(id);
  EXPECT_EQ(std::count_if(moved.events().begin(), moved.events().end(),
                          [](const v1::InstanceEvent& event) {
                            return event.text().find("moving what a slow host holds up: region ") != std::string::npos;
                          }),
            1);
  run(seconds(60));
  EXPECT_EQ(harness.agents.at("beta").fake.workers.size(), 1u) << "one at a time, and nothing goes back to even it out";
  EXPECT_EQ(harness.Get(id).map().version(), moved.map().version());
}

TEST(SlowHostTest, ASlowHostKeepsItsRegionWhereNoOtherHasRoom) {
  ClusterHarness harness;
  harness.AddHost("alpha", 1);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 2);
  ASSERT_EQ(harness.agents.at("beta").fake.workers.size(), 1u);
  for (int i = 0; i < 80; ++i) {
    StepsTake(harness, {{"alpha", 0.010}, {"beta", 0.040}});
    harness.Run(milliseconds(500));
  }
  EXPECT_EQ(harness.agents.at("beta").fake.workers.size(), 1u);
  EXPECT_EQ(harness.Get(id).map().version(), 1u);
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
}

}  // namespace
}  // namespace tessera::control
