// Debian's Prometheus scrapes a running instance: it finds every process by itself, every metric of docs/metrics.md is
// there, and every query of the dashboard returns data.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "host/temporary_folder.h"
#include "local_cluster/local_cluster.h"
#include "tests/end_to_end/dashboard.h"
#include "tests/end_to_end/prometheus_server.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {
namespace {

constexpr int kRegions = 4;
// Longer than the test: whatever happened since the first scrape is in it, such as the one full snapshot of a client.
constexpr char kRateWindow[] = "5m";

// One cluster, one instance with a client in it, one Prometheus, for all tests of this file.
class PrometheusTest : public ::testing::Test {
 protected:
  struct World {
    host::TemporaryFolder folder;
    std::unique_ptr<local::LocalCluster> cluster;
    std::unique_ptr<PrometheusServer> prometheus;
    std::string instance_id;
    std::optional<host::ChildProcess> client;
  };

  static void SetUpTestSuite() {
    setenv("TESSERA_BIN", TESSERA_BINARY_DIR "/bin", 1);
    auto world = std::make_unique<World>();
    // A range of ports of its own, because tests run side by side.
    const auto first_port = static_cast<std::uint16_t>(20000 + getpid() % 20 * 1000);
    world->cluster = std::make_unique<local::LocalCluster>(local::LocalClusterOptions{
        .state_dir = world->folder.path(), .first_port = first_port, .page_listen = "127.0.0.1:0"});
    world->prometheus = std::make_unique<PrometheusServer>(
        world->cluster->http_address(), world->cluster->gateway_metrics_address(), world->folder.path());

    const support::RunResult created = support::RunProgram(
        "tessera", {"--control", world->cluster->control_address(), "-o", "json", "instance", "create", "--scene",
                    support::ScenePath("plaza"), "--bodies", "300", "--regions", std::to_string(kRegions), "--wait"});
    ASSERT_EQ(created.exit_code, 0) << created.err;
    world->instance_id = nlohmann::json::parse(created.out).at("id");
    const support::RunResult kept = support::RunProgram(
        "tessera", {"--control", world->cluster->control_address(), "instance", "checkpoint", world->instance_id});
    ASSERT_EQ(kept.exit_code, 0) << kept.err;
    // The client comes when Prometheus has looked once, so that it sees the full snapshot as an increase.
    ASSERT_TRUE(world->prometheus->Until(
        [&] { return world->prometheus->Query("tessera_region_tick > 0").size() == kRegions; }));
    auto client = host::ChildProcess::Start(
        {.argv = {support::BinaryPath("tessera"), "--control", world->cluster->control_address(), "client",
                  world->instance_id, "--seconds", "600"},
         .log_path = world->folder.path() + "/client.log"});
    ASSERT_TRUE(client.ok()) << client.status();
    world->client = *std::move(client);
    world_ = world.release();
  }

  static void TearDownTestSuite() {
    if (world_ == nullptr) return;
    world_->client.reset();
    world_->prometheus.reset();
    world_->cluster.reset();
    delete world_;
    world_ = nullptr;
  }

  static const PrometheusServer& prometheus() { return *world_->prometheus; }

  static World* world_;
};
PrometheusTest::World* PrometheusTest::world_ = nullptr;

bool HasFiniteSample(const nlohmann::json& result) {
  for (const auto& series : result) {
    if (std::isfinite(std::strtod(series.at("value").at(1).get<std::string>().c_str(), nullptr))) return true;
  }
  return false;
}

TEST_F(PrometheusTest, FindsEveryProcessAndKnowsWhichItIs) {
  std::map<std::string, int> up;
  nlohmann::json targets;
  const auto all_up = [&] {
    up.clear();
    targets = prometheus().Api("/api/v1/targets?state=active").at("activeTargets");
    for (const auto& target : targets) up[target.at("labels").at("component")] += target.at("health") == "up";
    return up == std::map<std::string, int>{{"control", 1}, {"agent", 1}, {"gateway", 1}, {"region", kRegions}};
  };
  ASSERT_TRUE(prometheus().Until(all_up)) << targets.dump(1);
  std::set<std::string> regions;
  for (const auto& target : targets) {
    const auto& labels = target.at("labels");
    if (labels.at("component") != "control" && labels.at("component") != "gateway") {
      EXPECT_TRUE(labels.contains("host")) << labels;
    }
    if (labels.at("component") != "region") continue;
    EXPECT_EQ(labels.at("instance_id"), world_->instance_id);
    regions.insert(labels.at("region"));
  }
  EXPECT_THAT(regions, ::testing::ElementsAre("1", "2", "3", "4"));
}

TEST_F(PrometheusTest, EveryListedMetricIsExported) {
  std::set<std::string> missing;
  const auto none_missing = [&] {
    missing.clear();
    for (const MetricInfo& metric : ListedMetrics()) {
      if (HasLabelsOfAGame(metric.name)) continue;               // this world runs none
      if (metric.name == "tessera_control_under_way") continue;  // and is not on its way to anything
      const std::string series = metric.type == "histogram" ? metric.name + "_bucket" : metric.name;
      if (prometheus().Query("count(" + series + ")").empty()) missing.insert(metric.name);
    }
    return missing.empty();
  };
  EXPECT_TRUE(prometheus().Until(none_missing)) << "not exported: " << ::testing::PrintToString(missing);
}

TEST_F(PrometheusTest, NoMetricIsExportedThatIsNotListed) {
  std::set<std::string> listed;
  for (const MetricInfo& metric : ListedMetrics()) {
    listed.insert(metric.name);
    if (metric.type != "histogram") continue;
    for (const char* ending : {"_bucket", "_sum", "_count"}) listed.insert(metric.name + ending);
  }
  for (const std::string name : prometheus().Api("/api/v1/label/__name__/values")) {
    if (name.starts_with("tessera_") || name.starts_with("process_")) {
      EXPECT_TRUE(listed.contains(name)) << name << " is not in docs/metrics.md";
    }
  }
}

TEST_F(PrometheusTest, EveryQueryOfTheDashboardReturnsData) {
  std::vector<DashboardQuery> open = DashboardQueries(kRateWindow);
  ASSERT_FALSE(open.empty());
  // This world runs no game.
  std::erase_if(open, [](const DashboardQuery& query) {
    return std::ranges::all_of(MetricNamesIn(query.expression), HasLabelsOfAGame);
  });
  // Not at once: rates need two scrapes, quantiles something that happened between them.
  const auto all_answered = [&] {
    std::erase_if(open,
                  [](const DashboardQuery& query) { return HasFiniteSample(prometheus().Query(query.expression)); });
    return open.empty();
  };
  if (prometheus().Until(all_answered)) return;
  for (const DashboardQuery& query : open) ADD_FAILURE() << "no data: " << query.panel << ": " << query.expression;
}

// Nothing that is marked may have happened yet, so an empty answer is one; a query that is not understood throws.
TEST_F(PrometheusTest, EveryMarkOfTheDashboardCanBeAsked) {
  for (const DashboardQuery& mark : DashboardMarks()) {
    EXPECT_TRUE(prometheus().Query(mark.expression).is_array()) << mark.panel;
  }
}

TEST_F(PrometheusTest, EvaluatesEveryAlertAndNoneOfThemIsAboutAFault) {
  nlohmann::json rules;
  const auto all_evaluated = [&] {
    rules = prometheus().Api("/api/v1/rules").at("groups").at(0).at("rules");
    return std::all_of(rules.begin(), rules.end(), [](const auto& rule) { return rule.at("health") == "ok"; });
  };
  ASSERT_TRUE(prometheus().Until(all_evaluated)) << rules.dump(1);
  for (const auto& rule : rules) {
    // A loaded machine may well make these two true; they are about speed.
    if (rule.at("name") == "TesseraTickRateLow" || rule.at("name") == "TesseraRegionBusy") continue;
    EXPECT_NE(rule.at("state"), "firing") << rule.dump(1);
  }
}

}  // namespace
}  // namespace tessera::end_to_end
