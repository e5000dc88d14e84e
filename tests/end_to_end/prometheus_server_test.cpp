// Prometheus reads every metric that MetricsServer serves, through the configuration that operators install.
#include "tests/end_to_end/prometheus_server.h"

#include "gtest/gtest.h"
#include "host/temporary_folder.h"
#include "prometheus/counter.h"
#include "prometheus/registry.h"
#include "telemetry/metrics_server.h"

namespace tessera::end_to_end {
namespace {

constexpr char kNoGateway[] = "127.0.0.1:1";

TEST(PrometheusServerTest, ScrapesWhatDiscoveryListsWithItsLabels) {
  auto registry = std::make_shared<prometheus::Registry>();
  prometheus::BuildCounter().Name("tessera_region_ticks_total").Help("Ticks").Register(*registry).Add({}).Increment(42);
  auto server = telemetry::MetricsServer::Start("127.0.0.1", 0, registry);
  ASSERT_TRUE(server.ok()) << server.status();
  const nlohmann::json targets = {
      {{"targets", {(*server)->address()}},
       {"labels", {{"component", "region"}, {"host", "h1"}, {"instance_id", "i1"}, {"region", "2"}}}}};
  (*server)->AddHandler("/sd/prometheus", [&](const telemetry::HttpRequest&) {
    return telemetry::HttpReply{.content_type = "application/json", .body = targets.dump()};
  });

  const host::TemporaryFolder folder;
  const PrometheusServer prometheus((*server)->address(), kNoGateway, folder.path());
  nlohmann::json result;
  const auto scraped = [&] {
    result =
        prometheus.Query(R"(tessera_region_ticks_total{component="region", host="h1", instance_id="i1", region="2"})");
    return !result.empty();
  };
  ASSERT_TRUE(prometheus.Until(scraped));
  ASSERT_EQ(result.size(), 1u);
  EXPECT_EQ(result[0].at("value").at(1), "42");
  EXPECT_EQ(prometheus.Query(R"(up{job="tessera"} == 1)").size(), 1u);
  EXPECT_EQ(prometheus.Query("process_resident_memory_bytes > 1e6").size(), 1u);
}

TEST(PrometheusServerTest, TellsWhatIsWrongWithAQuery) {
  auto server = telemetry::MetricsServer::Start("127.0.0.1", 0, nullptr);
  ASSERT_TRUE(server.ok()) << server.status();
  const host::TemporaryFolder folder;
  const PrometheusServer prometheus((*server)->address(), kNoGateway, folder.path());
  EXPECT_THROW(prometheus.Query("rate("), std::runtime_error);
  EXPECT_TRUE(prometheus.Query("no_such_metric").empty());
}

}  // namespace
}  // namespace tessera::end_to_end
