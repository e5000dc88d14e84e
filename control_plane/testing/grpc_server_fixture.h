// GrpcServerTest: a control plane behind its socket, with stubs of its services, and an agent whose workers are played.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sodium.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "control_plane/grpc_server.h"
#include "control_plane/sqlite_store.h"
#include "control_plane/testing/fake_workers.h"
#include "control_plane/testing/loaded_plane.h"
#include "core/world/scene_io.h"
#include "host/temporary_folder.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"

namespace tessera::control {

// Far beyond what anything here takes: a hang fails the test, a slow machine does not.
inline constexpr std::chrono::seconds kPatience{30};

struct Context {
  grpc::ClientContext context;
  Context() { context.set_deadline(std::chrono::system_clock::now() + kPatience); }
  grpc::ClientContext* operator&() { return &context; }
};

// An agent over a real stream.
class StreamAgent {
 public:
  StreamAgent(const std::shared_ptr<grpc::Channel>& channel, const v1::AgentHello& hello)
      : stub_(v1::AgentLinkService::NewStub(channel)), stream_(stub_->Attach(&context_)) {
    v1::AgentMessage first;
    *first.mutable_hello() = hello;
    stream_->Write(first);
    v1::ControlMessage answer;
    if (stream_->Read(&answer)) admitted = answer.admitted();
  }
  ~StreamAgent() {
    context_.TryCancel();
    if (thread_.joinable()) thread_.join();
  }
  // Acts on what comes until the stream ends.
  void Play() {
    thread_ = std::thread([this] {
      v1::ControlMessage message;
      while (stream_->Read(&message)) {
        std::vector<v1::AgentMessage> out = fake.Apply(message.desired());
        out.push_back(fake.Heartbeat());
        for (const v1::AgentMessage& m : out) stream_->Write(m);
      }
    });
  }
  grpc::Status Finish() { return stream_->Finish(); }

  FakeWorkers fake;
  v1::Admitted admitted;

 private:
  grpc::ClientContext context_;
  std::unique_ptr<v1::AgentLinkService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::AgentMessage, v1::ControlMessage>> stream_;
  std::thread thread_;
};

inline v1::Scene TestScene() {
  const auto scene = ParseScene(R"(
      name: "table"
      bounds { min { x: -50 y: -10 z: -50 } max { x: 50 y: 50 z: 50 } }
      bodies { id: 1 motion: MOTION_STATIC shape { box { half_extents { x: 40 y: 1 z: 40 } } } }
      bodies { id: 2 mass: 1 shape { sphere { radius: 0.5 } } pose { position { y: 5 } } }
      player {
        body { mass: 1 shape { sphere { radius: 0.5 } } }
        spawn_points { x: 10 y: 2 z: 10 }
        max_force: 10
        max_speed: 5
      })",
                                "test");
  EXPECT_TRUE(scene.ok()) << scene.status();
  return *scene;
}

// The same with pebbles on the table: more than a megabyte.
inline v1::Scene LargeScene() {
  constexpr int kPebbles = 30'000;
  v1::Scene scene = TestScene();
  for (int i = 0; i < kPebbles; ++i) {
    v1::Body& pebble = *scene.add_bodies();
    pebble.set_id(static_cast<std::uint32_t>(i + 3));
    pebble.set_motion(v1::MOTION_STATIC);
    pebble.mutable_shape()->mutable_sphere()->set_radius(0.01);
    v1::Vec3& at = *pebble.mutable_pose()->mutable_position();
    at.set_x(-40 + 0.4 * (i % 200));
    at.set_y(2);
    at.set_z(-40 + 0.4 * (i / 200));
  }
  return scene;
}

class GrpcServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_GE(sodium_init(), 0);
    store_ = *SqliteStore::Open(folder_.path() + "/control.db");
    plane_ = LoadPlane(*store_, settings_, OpenFiles());
    ASSERT_NE(plane_, nullptr);
    auto server = GrpcServer::Start({.socket = folder_.path() + "/control.sock", .operators = {}, .players = {}},
                                    std::nullopt, *plane_, metrics_);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->socket(), grpc::InsecureChannelCredentials());
    hosts_ = v1::HostService::NewStub(channel_);
    instances_ = v1::InstanceService::NewStub(channel_);
    sessions_ = v1::SessionService::NewStub(channel_);
  }
  // Null: no checkpoints are kept, and nothing comes in pieces.
  virtual std::unique_ptr<CheckpointFiles> OpenFiles() { return nullptr; }
  void TearDown() override {
    agent_.reset();
    if (plane_) plane_->Stop();
    server_.reset();
    plane_.reset();
    store_.reset();
  }

  void AddAgent() {
    v1::AddHostRequest add;
    add.set_name("alpha");
    v1::AddHostResponse added;
    ASSERT_TRUE(hosts_->AddHost(&Context(), add, &added).ok());
    hello_.set_join_token(added.join_token());
    hello_.set_advertise_address("127.0.0.1");
    hello_.set_metrics_port(9100);
    hello_.mutable_resources()->set_region_capacity(4);
    agent_ = std::make_unique<StreamAgent>(channel_, hello_);
    ASSERT_EQ(agent_->admitted.host_name(), "alpha");
  }
  v1::CreateInstanceRequest CreateRequest(std::uint32_t regions) {
    v1::CreateInstanceRequest request;
    *request.mutable_spec()->mutable_scene() = TestScene();
    request.mutable_spec()->set_regions(regions);
    return request;
  }
  // Watches until `state` or the end; the states seen, each once in a row.
  std::vector<v1::InstanceState> WatchUntil(const std::string& id, v1::InstanceState state, v1::Instance* last) {
    Context context;
    v1::WatchInstanceRequest request;
    request.set_id(id);
    const auto reader = instances_->WatchInstance(&context, request);
    v1::WatchInstanceResponse response;
    std::vector<v1::InstanceState> seen;
    while (reader->Read(&response)) {
      *last = response.instance();
      if (seen.empty() || seen.back() != last->state()) seen.push_back(last->state());
      if (last->state() == state) break;
    }
    context.context.TryCancel();
    return seen;
  }

  ControlSettings settings_;
  host::TemporaryFolder folder_;
  std::unique_ptr<SqliteStore> store_;
  ControlMetrics metrics_;
  std::unique_ptr<ControlPlane> plane_;
  std::unique_ptr<GrpcServer> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::HostService::Stub> hosts_;
  std::unique_ptr<v1::InstanceService::Stub> instances_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
  v1::AgentHello hello_;
  std::unique_ptr<StreamAgent> agent_;
};

}  // namespace tessera::control
