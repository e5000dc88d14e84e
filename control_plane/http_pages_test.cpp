#include "control_plane/http_pages.h"

#include <gmock/gmock.h>

#include <chrono>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "control_plane/backup.h"
#include "control_plane/control_metrics.h"
#include "control_plane/memory_store.h"
#include "control_plane/testing/loaded_plane.h"
#include "prometheus/registry.h"
#include "telemetry/http_get.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

class HttpPagesTest : public ::testing::Test {
 protected:
  HttpPagesTest() {
    plane_ = LoadPlane(store_);
    server_ = *telemetry::MetricsServer::Start("127.0.0.1", 0, std::make_shared<prometheus::Registry>());
    AddPages(*server_, gate_);
    gate_->Set(plane_.get());
  }
  ~HttpPagesTest() override { gate_->Set(nullptr); }

  int AddHost(const std::string& name) {
    v1::AddHostRequest request;
    request.set_name(name);
    return static_cast<int>(
        plane_->Call([&](Cluster& cluster, Now now) { return cluster.AddHost(now, request); }).status().code());
  }
  // The page, once it has this status, or as it is after the patience.
  std::string HealthOnce(int status) {
    const auto patience_ends = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (true) {
      const auto reply = telemetry::HttpGet(server_->address(), "/healthz");
      if (!reply.ok()) return std::string(reply.status().message());
      if (reply->status == status || std::chrono::steady_clock::now() > patience_ends) {
        return std::to_string(reply->status) + " " + reply->body;
      }
      std::this_thread::yield();
    }
  }

  MemoryStore store_;
  std::unique_ptr<ControlPlane> plane_;
  std::shared_ptr<PlaneGate> gate_ = std::make_shared<PlaneGate>();
  std::unique_ptr<telemetry::MetricsServer> server_;
};

TEST_F(HttpPagesTest, HealthSaysThatTheStoreCannotBeWrittenAndWhenItCanAgain) {
  EXPECT_EQ(HealthOnce(200), "200 ok\n");
  store_.FailNext(std::numeric_limits<int>::max());
  EXPECT_EQ(AddHost("alpha"), static_cast<int>(absl::StatusCode::kUnavailable));
  EXPECT_THAT(HealthOnce(503), HasSubstr("503 the store cannot be written: "));
  store_.FailNext(0);
  EXPECT_EQ(HealthOnce(200), "200 ok\n") << "it is tried again without anybody asking";
}

// No agent has been admitted, so there is nobody to wait for.
TEST_F(HttpPagesTest, NobodyJoinsOneThatBeganFromABackupBeforeItKnowsWhatRuns) {
  ASSERT_EQ(AddHost("alpha"), 0);
  std::string backup;
  ASSERT_TRUE(plane_
                  ->Backup([&backup](std::string_view bytes) {
                    backup.append(bytes);
                    return absl::OkStatus();
                  })
                  .ok());
  MemoryStore store;
  ASSERT_TRUE(RestoreBackup(backup, store).ok());
  const auto plane = LoadPlane(store);
  ASSERT_NE(plane, nullptr);
  ControlPlane& restored = *plane;
  ASSERT_TRUE(restored.Ask([](const ClusterState& state) { return state.recovering(); }));
  v1::JoinInstanceRequest request;
  request.set_instance_id("inst-1");
  absl::Status status = restored.CheckRecovered();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(restored
                .Join(
                    request, [] { return false; }, "")
                .status()
                .code(),
            absl::StatusCode::kUnavailable);
  const auto patience_ends = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!status.ok() && std::chrono::steady_clock::now() < patience_ends) status = restored.CheckRecovered();
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(restored
                .Join(
                    request, [] { return false; }, "")
                .status()
                .code(),
            absl::StatusCode::kNotFound);
}

TEST(SummaryMetricsTest, WhatWaitsAndWhatIsLeftOverAreNumbers) {
  ClusterSummary summary;
  summary.stray_checkpoints = 3;
  summary.health.resize(2);
  summary.health[0].id = "inst-1";
  summary.health[1].id = "inst-2";
  summary.health[1].lacks_room = true;
  summary.health[1].last_loss = std::chrono::seconds(1'700'000'000);
  const SummaryMetrics metrics([&] { return summary; }, [] { return Revision(0); });
  std::map<std::string, std::vector<double>> values;
  for (const prometheus::MetricFamily& family : metrics.Collect()) {
    for (const prometheus::ClientMetric& metric : family.metric) values[family.name].push_back(metric.gauge.value);
  }
  EXPECT_EQ(values["tessera_control_stray_checkpoints"], std::vector<double>{3});
  EXPECT_EQ(values["tessera_control_change_waits"], (std::vector<double>{0, 1}));
  EXPECT_EQ(values["tessera_control_lost_timestamp_seconds"], (std::vector<double>{0, 1'700'000'000}));
}

TEST_F(HttpPagesTest, OneThatFollowsIsWell) {
  gate_->Set(nullptr);
  EXPECT_EQ(HealthOnce(200), "200 ok, follows\n");
  gate_->Set(plane_.get());
}

}  // namespace
}  // namespace tessera::control
