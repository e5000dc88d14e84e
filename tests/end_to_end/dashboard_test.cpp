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

TEST(DashboardTest, ShowsEveryHistogramOfARegion) {
  std::string all;
  for (const DashboardQuery& query : DashboardQueries("1m")) all += query.expression + "\n";
  for (const MetricInfo& metric : ListedMetrics()) {
    if (metric.type == "histogram" && metric.name.starts_with("tessera_region_")) {
      EXPECT_THAT(all, HasSubstr(metric.name));
    }
  }
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
