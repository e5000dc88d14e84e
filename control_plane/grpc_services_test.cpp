// Services and pages for tools: health, reflection, the discovery of processes, metrics.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

#include "control_plane/http_pages.h"
#include "control_plane/testing/grpc_server_fixture.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

// The bytes of one answer to `request` by a method whose messages are not among ours.
std::string CallRaw(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                    const std::string& request) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  Context context;
  const auto call = stub.PrepareCall(&context, method, &queue);
  const auto done = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(nullptr);
  if (!done()) return "not started";
  const grpc::Slice slice(request);
  call->WriteLast(grpc::ByteBuffer(&slice, 1), {}, nullptr);
  if (!done()) return "not written";
  grpc::ByteBuffer answer;
  call->Read(&answer, nullptr);
  std::string bytes;
  if (done()) {
    std::vector<grpc::Slice> slices;
    answer.Dump(&slices);
    for (const grpc::Slice& part : slices) bytes.append(reinterpret_cast<const char*>(part.begin()), part.size());
  }
  grpc::Status status;
  call->Finish(&status, nullptr);
  done();
  return bytes;
}

TEST_F(GrpcServerTest, TellsThatEachServiceServes) {
  for (const std::string service : {"", "tessera.v1.HostService", "tessera.v1.InstanceService",
                                    "tessera.v1.SessionService", "tessera.v1.AgentLinkService"}) {
    // HealthCheckRequest.service is field 1; HealthCheckResponse.status is field 1, and SERVING is 1.
    const std::string request =
        service.empty() ? "" : std::string("\x0a") + static_cast<char>(service.size()) + service;
    EXPECT_EQ(CallRaw(channel_, "/grpc.health.v1.Health/Check", request), "\x08\x01") << service;
  }
}

TEST_F(GrpcServerTest, ReflectionListsTheServices) {
  // ServerReflectionRequest.list_services is field 7, a string.
  const std::string listed =
      CallRaw(channel_, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", std::string("\x3a\x01*"));
  for (const char* service : {"HostService", "InstanceService", "SessionService", "AgentLinkService"}) {
    EXPECT_THAT(listed, HasSubstr(std::string("tessera.v1.") + service));
  }
}

TEST_F(GrpcServerTest, ServiceDiscoveryListsEveryProcess) {
  AddAgent();
  agent_->Play();
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), CreateRequest(1), &created).ok());
  v1::Instance instance;
  WatchUntil(created.instance().id(), v1::INSTANCE_STATE_RUNNING, &instance);
  const auto targets = plane_->Call([](Cluster& cluster, Now) { return ScrapeTargets(cluster.state()); });
  const std::string port = std::to_string(instance.region_status(0).report().address().metrics_port());
  EXPECT_EQ(
      ScrapeTargetsJson(targets, "127.0.0.1:7701"),
      R"([{"labels":{"component":"control"},"targets":["127.0.0.1:7701"]},)"
      R"({"labels":{"component":"agent","host":"alpha"},"targets":["127.0.0.1:9100"]},)"
      R"({"labels":{"component":"region","host":"alpha","instance_id":"inst-1","region":"1"},"targets":["127.0.0.1:)" +
          port + R"("]}])");
}

TEST_F(GrpcServerTest, MetricsAreThereFromTheStartAndCount) {
  const auto counter = [this](const std::string& family, const std::string& label) {
    for (const prometheus::MetricFamily& collected : metrics_.registry()->Collect()) {
      for (const prometheus::ClientMetric& metric : collected.metric) {
        if (collected.name != family || metric.label.at(0).value != label) continue;
        return collected.type == prometheus::MetricType::Histogram ? static_cast<double>(metric.histogram.sample_count)
                                                                   : metric.counter.value;
      }
    }
    return -1.0;
  };
  EXPECT_EQ(counter("tessera_control_placements_total", "placed"), 0);
  EXPECT_EQ(counter("tessera_control_sessions_total", "refused"), 0);
  EXPECT_EQ(counter("tessera_control_rpc_seconds", "InstanceService/CreateInstance"), 0);
  AddAgent();
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), CreateRequest(2), &created).ok());
  EXPECT_EQ(instances_->CreateInstance(&Context(), CreateRequest(3), &created).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(counter("tessera_control_placements_total", "placed"), 1);
  EXPECT_EQ(counter("tessera_control_placements_total", "no_room"), 1);
  EXPECT_EQ(counter("tessera_control_rpc_seconds", "InstanceService/CreateInstance"), 2);
  const ClusterSummary summary = plane_->Call([](Cluster& cluster, Now) { return Summarise(cluster.state()); });
  EXPECT_EQ(summary.hosts.at(v1::HOST_STATE_READY), 1);
  EXPECT_EQ(summary.instances.at(v1::INSTANCE_STATE_STARTING), 1);
}

}  // namespace
}  // namespace tessera::control
