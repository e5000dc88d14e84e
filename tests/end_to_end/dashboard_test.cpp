// The dashboard, the alerts and the list of metrics agree, without anything running.
#include "tests/end_to_end/dashboard.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace tessera::end_to_end {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A histogram is stored as three series.
std::set<std::string> ListedSeries() {
  std::set<std::string> series;
  for (const MetricInfo& metric : ListedMetrics()) {
    if (metric.type == "histogram") {
      for (const char* ending : {"_bucket", "_sum", "_count"}) series.insert(metric.name + ending);
    } else {
      series.insert(metric.name);
    }
  }
  return series;
}

TEST(MetricsPageTest, NamesFollowPrometheusConventions) {
  const std::set<MetricInfo> metrics = ListedMetrics();
  ASSERT_FALSE(metrics.empty());
  for (const MetricInfo& metric : metrics) {
    EXPECT_THAT((std::set<std::string>{"gauge", "counter", "histogram"}), ::testing::Contains(metric.type))
        << metric.name;
    EXPECT_EQ(metric.name.ends_with("_total"), metric.type == "counter") << metric.name;
    if (metric.type == "histogram") {
      EXPECT_TRUE(metric.name.ends_with("_seconds")) << metric.name;
    }
  }
}

TEST(DashboardTest, AsksOnlyForListedMetrics) {
  const std::set<std::string> listed = ListedSeries();
  for (const DashboardQuery& query : DashboardQueries("1m")) {
    EXPECT_THAT(query.expression, Not(HasSubstr("$"))) << query.panel;
    const std::set<std::string> names = MetricNamesIn(query.expression);
    EXPECT_FALSE(names.empty()) << query.panel;
    for (const std::string& name : names) EXPECT_TRUE(listed.contains(name)) << query.panel << ": " << name;
  }
}

TEST(DashboardTest, MarksWhatHappenedByListedMetrics) {
  const std::set<std::string> listed = ListedSeries();
  const std::vector<DashboardQuery> marks = DashboardMarks();
  ASSERT_FALSE(marks.empty());
  for (const DashboardQuery& mark : marks) {
    const std::set<std::string> names = MetricNamesIn(mark.expression);
    EXPECT_FALSE(names.empty()) << mark.panel;
    for (const std::string& name : names) EXPECT_TRUE(listed.contains(name)) << mark.panel << ": " << name;
  }
}

// No panel and no mark asks for these, each for a reason. Whoever adds a metric gives it a panel, or a line here.
std::set<std::string> WithoutPanel() {
  return {
      // The control plane counts the same, by world or for the cluster.
      "tessera_region_unprotected",
      "tessera_region_failovers_total",
      // Another metric that is shown says as much.
      "tessera_region_world_paused",
      "tessera_control_under_way",
      "tessera_agent_heartbeats_total",
      "tessera_game_published_total",
      "tessera_game_callback_calls_total",
      // The alert compares with it.
      "tessera_agent_certificate_life_seconds",
      // For whoever makes a game, tunes its messages, or reads its events.
      "tessera_game_counter_total",
      "tessera_game_messages_by_hops_total",
      "tessera_game_messages_ticks_total",
      "tessera_game_messages_ticks_max",
      "tessera_game_messages_copies_total",
      "tessera_control_game_events",
      // For whoever doubts a failover.
      "tessera_region_promotion_age_ticks",
  };
}

TEST(DashboardTest, ShowsEveryMetricButThese) {
  std::set<std::string> shown;
  for (const DashboardQuery& query : DashboardQueries("1m")) shown.merge(MetricNamesIn(query.expression));
  for (const DashboardQuery& mark : DashboardMarks()) shown.merge(MetricNamesIn(mark.expression));
  const std::set<std::string> exceptions = WithoutPanel();
  for (const MetricInfo& metric : ListedMetrics()) {
    const bool is_shown = std::ranges::any_of(std::initializer_list<std::string>{"", "_bucket", "_sum", "_count"},
                                              [&](const auto& ending) { return shown.contains(metric.name + ending); });
    EXPECT_NE(is_shown, exceptions.contains(metric.name)) << metric.name;
  }
}

TEST(DashboardTest, HasNoExceptionForWhatIsNoMetric) {
  std::set<std::string> listed;
  for (const MetricInfo& metric : ListedMetrics()) listed.insert(metric.name);
  for (const std::string& name : WithoutPanel()) EXPECT_TRUE(listed.contains(name)) << name;
}

TEST(DashboardTest, PanelsDoNotOverlap) {
  const auto dashboard = nlohmann::json::parse(ReadSource("deploy/grafana/dashboards/tessera.json"));
  std::set<std::pair<int, int>> taken;
  std::set<int> ids;
  for (const auto& panel : dashboard.at("panels")) {
    EXPECT_TRUE(ids.insert(panel.at("id").get<int>()).second) << "a panel id is used twice";
    const auto& place = panel.at("gridPos");
    for (int x = 0; x < place.at("w"); ++x) {
      for (int y = 0; y < place.at("h"); ++y) {
        const std::pair<int, int> square{place.at("x").get<int>() + x, place.at("y").get<int>() + y};
        EXPECT_LT(square.first, 24);
        EXPECT_TRUE(taken.insert(square).second) << panel.at("title") << " overlaps another panel";
      }
    }
  }
}

TEST(AlertsTest, AskOnlyForListedMetrics) {
  const std::set<std::string> listed = ListedSeries();
  const std::set<std::string> names = MetricNamesIn(ReadSource("deploy/prometheus/rules.yml"));
  ASSERT_FALSE(names.empty());
  for (const std::string& name : names) EXPECT_TRUE(listed.contains(name)) << name;
}

}  // namespace
}  // namespace tessera::end_to_end
