// Lists and their filters.
#include "control_plane/cluster/queries.h"

#include <gmock/gmock.h>

#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

class QueriesTest : public ::testing::Test {
 protected:
  QueriesTest() {
    HostEntry& host = rig_.AddHost("alpha");
    for (int i = 0; i < 5; ++i) rig_.AddRunning({&host});
  }

  StateRig rig_;
};

bool IsOdd(const std::string& id) { return (id.back() - '0') % 2 == 1; }

TEST_F(QueriesTest, ListsGiveThoseThatAreShownAlsoPageByPage) {
  std::vector<std::string> ids;
  v1::ListInstancesRequest request;
  request.set_page_size(2);
  int pages = 0;
  do {
    const auto page = ListInstances(*rig_.state, request, IsOdd);
    ASSERT_TRUE(page.ok()) << page.status();
    for (const v1::Instance& instance : page->instances()) ids.push_back(instance.id());
    request.set_page_token(page->next_page_token());
    ++pages;
  } while (!request.page_token().empty() && pages < 5);
  EXPECT_THAT(ids, ElementsAre("inst-1", "inst-3", "inst-5"));
  EXPECT_EQ(pages, 2);
  EXPECT_EQ(ListInstances(*rig_.state, {})->instances_size(), 5);
  EXPECT_EQ(ListInstances(*rig_.state, {}, [](const std::string&) { return false; })->instances_size(), 0);
}

TEST_F(QueriesTest, MetricsAreLookedForWhereTheirHostServesThem) {
  HostEntry& host = *rig_.state->FindHost("host-1");
  records::Host record = host.record;
  record.set_advertise_address("10.0.0.2");
  record.set_metrics_port(7702);
  ASSERT_TRUE(rig_.state->StoreHost(host, record).ok());
  InstanceEntry& first = *rig_.state->FindInstance("inst-1");
  first.workers[0].report.mutable_address()->set_link_port(7801);
  first.workers[0].report.mutable_address()->set_metrics_port(7802);
  const auto addresses = [&] {
    std::vector<std::string> all;
    for (const ScrapeTarget& target : ScrapeTargets(*rig_.state)) all.push_back(target.address);
    return all;
  };
  EXPECT_THAT(addresses(), ElementsAre("10.0.0.2:7702", "10.0.0.2:7802")) << "served at loopback, or everywhere";
  record.set_metrics_address("10.9.0.2");
  ASSERT_TRUE(rig_.state->StoreHost(host, record).ok());
  EXPECT_THAT(addresses(), ElementsAre("10.9.0.2:7702", "10.9.0.2:7802"));
  record.set_metrics_address("fd00::2");
  ASSERT_TRUE(rig_.state->StoreHost(host, record).ok());
  EXPECT_THAT(addresses(), ElementsAre("[fd00::2]:7702", "[fd00::2]:7802"));
}

TEST_F(QueriesTest, ASummaryCountsWhatItsInstancesReport) {
  InstanceEntry& first = *rig_.state->FindInstance("inst-1");
  first.workers[0].report.set_unprotected(true);
  const ClusterSummary summary = Summarise(*rig_.state);
  EXPECT_EQ(summary.hosts.at(v1::HOST_STATE_READY), 1);
  EXPECT_EQ(summary.instances.at(v1::INSTANCE_STATE_RUNNING), 5);
  ASSERT_EQ(summary.health.size(), 5U);
  const v1::Instance view = *GetInstance(*rig_.state, "inst-1");
  EXPECT_EQ(summary.health[0].id, "inst-1");
  EXPECT_EQ(summary.health[0].unprotected, 1);
  EXPECT_EQ(summary.health[0].unprotected, view.unprotected_regions_size());
  EXPECT_EQ(summary.health[0].imbalance, view.imbalance());
  EXPECT_EQ(summary.health[1].unprotected, 0);
}

TEST_F(QueriesTest, ASummaryNamesTheInstancesThatAreToStartOrStop) {
  const auto set = [this](const std::string& id, v1::InstanceState state) {
    rig_.state->FindInstance(id)->record.set_state(state);
  };
  set("inst-1", v1::INSTANCE_STATE_STARTING);
  set("inst-2", v1::INSTANCE_STATE_STOPPING);
  set("inst-3", v1::INSTANCE_STATE_WAITING_FOR_PLAYERS);
  set("inst-4", v1::INSTANCE_STATE_ENDED);
  EXPECT_THAT(Summarise(*rig_.state).under_way,
              ElementsAre(Pair("inst-1", v1::INSTANCE_STATE_STARTING), Pair("inst-2", v1::INSTANCE_STATE_STOPPING)));
}

TEST_F(QueriesTest, ASceneIsShownToWhomAnInstanceOfItIs) {
  const std::string hash = rig_.state->FindInstance("inst-1")->record.scene_hash();
  EXPECT_TRUE(ShowsScene(*rig_.state, hash, IsOdd));
  EXPECT_FALSE(ShowsScene(*rig_.state, hash, [](const std::string& id) { return id == "inst-9"; }));
  EXPECT_FALSE(ShowsScene(*rig_.state, hash + "0", IsOdd));
}

}  // namespace
}  // namespace tessera::control
