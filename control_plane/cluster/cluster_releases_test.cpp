// Worlds of one release on hosts with programs of several, through the whole cluster.
#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class ClusterReleasesTest : public ::testing::Test {
 protected:
  FakeHost& AddHost(const std::string& name, const std::string& version, const std::vector<std::string>& releases) {
    FakeHost& agent = harness_.AddHost(name, 4);
    Install(agent, version, releases);
    return agent;
  }
  // Its agent is another one from now on.
  void Install(FakeHost& agent, const std::string& version, const std::vector<std::string>& releases) {
    agent.version = version;
    agent.releases = releases;
    harness_.Attach(agent);
  }
  std::vector<std::string> ReleasesOfWorkers() const {
    std::vector<std::string> releases;
    for (const auto& [name, agent] : harness_.agents) {
      for (const auto& [key, worker] : agent.fake.workers) releases.push_back(worker.order.release());
    }
    return releases;
  }
  // As of a checkpoint of now.
  records::Manifest ManifestOf(const std::string& id) {
    const v1::Instance world = harness_.Get(id);
    records::Manifest manifest;
    manifest.set_tick(world.region_status(0).report().tick());
    *manifest.mutable_map() = world.map();
    return manifest;
  }
  void KillWorkerOf(const std::string& id, std::uint32_t region) {
    FakeHost& agent = harness_.AgentOf(id, region);
    harness_.Send(agent, agent.fake.Kill({id, region}, 9));
  }

  ClusterHarness harness_;
};

TEST_F(ClusterReleasesTest, AWorldKeepsItsReleaseThroughAnUpgradeOfItsHostsAndADeath) {
  FakeHost& alpha = AddHost("alpha", "0.1.0", {});
  FakeHost& beta = AddHost("beta", "0.1.0", {});
  const std::string id = Start(harness_, 2);
  EXPECT_EQ(harness_.Get(id).release(), "0.1.0");
  const FakeHost& gamma = AddHost("gamma", "0.2.0", {"0.2.0"});
  Install(alpha, "0.2.0", {"0.1.0", "0.2.0"});
  Install(beta, "0.2.0", {"0.1.0", "0.2.0"});
  KillWorkerOf(id, 1);
  harness_.Run(seconds(5));
  ExpectSettled(harness_, id, 2);
  EXPECT_THAT(gamma.fake.workers, SizeIs(0)) << "it has no program of the world's release";
  EXPECT_THAT(ReleasesOfWorkers(), Each(std::string("0.1.0")));
  EXPECT_EQ(harness_.Get(id).release(), "0.1.0");
}

TEST_F(ClusterReleasesTest, AnUpgradeMovesItOnAndSaysSo) {
  AddHost("alpha", "0.2.0", {"0.1.0", "0.2.0"});
  FakeHost& beta = AddHost("beta", "0.1.0", {});
  const std::string id = Start(harness_, 2);
  ASSERT_EQ(harness_.Get(id).release(), "0.1.0");
  Install(beta, "0.2.0", {"0.1.0", "0.2.0"});
  const auto kept = harness_.cluster().Restore(harness_.now, id, ManifestOf(id), {"scene", ""}, false);
  ASSERT_TRUE(kept.ok()) << kept.status();
  harness_.Run(seconds(3));
  EXPECT_EQ(harness_.Get(id).release(), "0.1.0") << "a restore alone is no upgrade";
  const auto upgraded =
      harness_.cluster().Restore(harness_.now, id, ManifestOf(id), {"scene", ""}, false, ReleaseChoice::kNewest);
  ASSERT_TRUE(upgraded.ok()) << upgraded.status();
  harness_.Run(seconds(3));
  const v1::Instance world = harness_.Get(id);
  EXPECT_EQ(world.state(), v1::INSTANCE_STATE_RUNNING) << world.reason();
  EXPECT_EQ(world.release(), "0.2.0");
  EXPECT_THAT(ReleasesOfWorkers(), Each(std::string("0.2.0")));
  std::vector<std::string> events;
  events.reserve(static_cast<std::size_t>(world.events_size()));
  for (const v1::InstanceEvent& event : world.events()) events.push_back(event.text());
  EXPECT_THAT(events, Contains("its workers are of release 0.2.0 now, and were of 0.1.0"));
}

TEST_F(ClusterReleasesTest, AHostThatListsNonsenseIsRefused) {
  v1::AgentHello hello = ClusterHarness::Hello(4);
  hello.set_join_token("token");
  hello.add_releases("../bin");
  EXPECT_THAT(std::string(CheckHello(hello).message()), HasSubstr("hello.releases: \"../bin\" is no release"));
}

}  // namespace
}  // namespace tessera::control
