// The control plane through its sockets: gRPC clients, an agent whose workers are played, HTTP pages' content.
#include "control_plane/grpc_server.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <sodium.h>

#include <thread>

#include "control_plane/http_pages.h"
#include "control_plane/memory_store.h"
#include "control_plane/sqlite_store.h"
#include "control_plane/testing/fake_workers.h"
#include "core/world/scene_io.h"
#include "host/temporary_folder.h"
#include "telemetry/log_throttle.h"
#include "telemetry/testing/captured_log.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"

namespace tessera::control {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Far beyond what anything here takes: a hang fails the test, a slow machine does not.
constexpr std::chrono::seconds kPatience{30};

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

v1::Scene TestScene() {
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

class GrpcServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_GE(sodium_init(), 0);
    const Now now{std::chrono::steady_clock::now().time_since_epoch(),
                  std::chrono::system_clock::now().time_since_epoch()};
    store_ = *SqliteStore::Open(folder_.path() + "/control.db");
    auto cluster = Cluster::Load(*store_, {}, SystemRandomBytes, now);
    ASSERT_TRUE(cluster.ok()) << cluster.status();
    plane_ = std::make_unique<ControlPlane>(*store_, *std::move(cluster));
    auto server = GrpcServer::Start({.socket = folder_.path() + "/control.sock", .operators = {}, .players = {}},
                                    std::nullopt, *plane_, metrics_);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->socket(), grpc::InsecureChannelCredentials());
    hosts_ = v1::HostService::NewStub(channel_);
    instances_ = v1::InstanceService::NewStub(channel_);
    sessions_ = v1::SessionService::NewStub(channel_);
  }
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

TEST_F(GrpcServerTest, LeadsAWorldFromCreateToEnd) {
  AddAgent();
  agent_->Play();
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), CreateRequest(4), &created).ok());
  const std::string id = created.instance().id();
  v1::Instance instance;
  WatchUntil(id, v1::INSTANCE_STATE_RUNNING, &instance);
  ASSERT_EQ(instance.state(), v1::INSTANCE_STATE_RUNNING) << instance.reason();

  v1::JoinInstanceRequest join;
  join.set_instance_id(id);
  join.set_player_name("ann");
  v1::JoinInstanceResponse joined;
  ASSERT_TRUE(sessions_->JoinInstance(&Context(), join, &joined).ok());
  EXPECT_EQ(joined.player(), 1u);
  EXPECT_EQ(joined.regions_size(), 4);
  EXPECT_EQ(joined.tick_rate_hz(), 60u);
  v1::GetSceneRequest get_scene;
  get_scene.set_scene_hash(joined.scene_hash());
  v1::GetSceneResponse scene;
  ASSERT_TRUE(sessions_->GetScene(&Context(), get_scene, &scene).ok());
  v1::Scene parsed;
  ASSERT_TRUE(parsed.ParseFromString(scene.scene()));
  EXPECT_EQ(SceneHash(parsed), joined.scene_hash());

  v1::LeaveInstanceRequest leave;
  leave.set_instance_id(id);
  leave.set_credential(joined.credential());
  leave.set_credential_key(joined.credential_key());
  v1::LeaveInstanceResponse left;
  EXPECT_TRUE(sessions_->LeaveInstance(&Context(), leave, &left).ok());

  v1::DeleteInstanceRequest remove;
  remove.set_id(id);
  v1::DeleteInstanceResponse removed;
  ASSERT_TRUE(instances_->DeleteInstance(&Context(), remove, &removed).ok());
  WatchUntil(id, v1::INSTANCE_STATE_ENDED, &instance);
  EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_ENDED);
  EXPECT_EQ(sessions_->JoinInstance(&Context(), join, &joined).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(GrpcServerTest, AWatchIsToldOfAFailureAndEnds) {
  AddAgent();
  agent_->fake.exit_at_start = {2};
  agent_->Play();
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), CreateRequest(2), &created).ok());
  v1::Instance instance;
  WatchUntil(created.instance().id(), v1::INSTANCE_STATE_FAILED, &instance);
  EXPECT_THAT(instance.reason(), HasSubstr("region 2 on alpha: worker exited with code 3"));
}

TEST_F(GrpcServerTest, AnAgentFetchesScenesWithItsSecretOnly) {
  AddAgent();
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), CreateRequest(1), &created).ok());
  const auto link = v1::AgentLinkService::NewStub(channel_);
  v1::FetchSceneRequest request;
  request.set_scene_hash(created.instance().scene_hash());
  request.set_host_id(agent_->admitted.host_id());
  v1::FetchSceneResponse response;
  EXPECT_EQ(link->FetchScene(&Context(), request, &response).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  request.set_host_secret(agent_->admitted.host_secret());
  EXPECT_TRUE(link->FetchScene(&Context(), request, &response).ok());
  EXPECT_FALSE(response.scene().empty());
  request.set_scene_hash("feed");
  EXPECT_EQ(link->FetchScene(&Context(), request, &response).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(GrpcServerTest, AnAgentFetchesTheGameOfAnInstanceWithItsSecretOnly) {
  AddAgent();
  v1::CreateInstanceRequest create = CreateRequest(1);
  create.mutable_spec()->mutable_game()->set_name("game.lua");
  create.mutable_spec()->mutable_game()->set_content("function on_tick() end");
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), create, &created).ok());
  EXPECT_EQ(created.instance().game_name(), "game.lua");
  const auto link = v1::AgentLinkService::NewStub(channel_);
  v1::FetchGameRequest request;
  request.set_game_hash(created.instance().game_hash());
  request.set_host_id(agent_->admitted.host_id());
  v1::FetchGameResponse response;
  EXPECT_EQ(link->FetchGame(&Context(), request, &response).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  request.set_host_secret(agent_->admitted.host_secret());
  EXPECT_TRUE(link->FetchGame(&Context(), request, &response).ok());
  EXPECT_EQ(response.game(), "function on_tick() end");
}

TEST_F(GrpcServerTest, LinesOfAGameAreListedForInstancesThatRunOne) {
  AddAgent();
  v1::CreateInstanceRequest create = CreateRequest(1);
  v1::CreateInstanceResponse without, with;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), create, &without).ok());
  create.mutable_spec()->mutable_game()->set_name("game.lua");
  create.mutable_spec()->mutable_game()->set_content("function on_tick() end");
  ASSERT_TRUE(instances_->CreateInstance(&Context(), create, &with).ok());
  v1::ListGameLinesRequest request;
  v1::ListGameLinesResponse response;
  const auto list = [&](const std::string& id) {
    request.set_id(id);
    return instances_->ListGameLines(&Context(), request, &response).error_code();
  };
  EXPECT_EQ(list("inst-404"), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(list(without.instance().id()), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(list(with.instance().id()), grpc::StatusCode::OK);
}

TEST_F(GrpcServerTest, AUsedTokenIsRefusedOnTheStream) {
  AddAgent();
  StreamAgent second(channel_, hello_);
  EXPECT_EQ(second.admitted.host_id(), "");
  const grpc::Status status = second.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(status.error_message(), HasSubstr("join_token"));
}

TEST_F(GrpcServerTest, BadSpecsNameTheField) {
  AddAgent();
  const auto refusal = [this](const v1::CreateInstanceRequest& request) {
    v1::CreateInstanceResponse response;
    const grpc::Status status = instances_->CreateInstance(&Context(), request, &response);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_EQ(status.error_message().find('\n'), std::string::npos);
    return status.error_message();
  };
  EXPECT_EQ(refusal(CreateRequest(0)), "spec.regions: 0 is not in 1 to 1000");
  EXPECT_EQ(refusal(CreateRequest(10000)), "spec.regions: 10000 is not in 1 to 1000");
  EXPECT_EQ(refusal({}), "spec: missing");
  v1::CreateInstanceRequest request = CreateRequest(1);
  request.mutable_spec()->mutable_scene()->mutable_bodies(1)->set_mass(-1);
  EXPECT_THAT(refusal(request), HasSubstr("spec.scene"));
  EXPECT_THAT(refusal(request), HasSubstr("mass"));
  request = CreateRequest(1);
  request.mutable_spec()->mutable_start_deadline()->set_seconds(-1);
  EXPECT_THAT(refusal(request), HasSubstr("spec.start_deadline"));
  request = CreateRequest(1);
  request.mutable_spec()->set_expected_players(1);
  request.mutable_spec()->mutable_scene()->clear_player();
  EXPECT_THAT(refusal(request), HasSubstr("spec.expected_players"));
  request = CreateRequest(1);
  request.mutable_spec()->mutable_borders()->set_ghost_depth(65);
  EXPECT_EQ(refusal(request), "spec.borders.ghost_depth: 65 is not in 0 to 64");
  request = CreateRequest(1);
  request.mutable_spec()->set_region_threads(33);
  EXPECT_EQ(refusal(request), "spec.region_threads: 33 is not in 1 to 32");
  request = CreateRequest(1);
  request.mutable_spec()->mutable_borders()->set_whole_up_to(100'001);
  EXPECT_EQ(refusal(request), "spec.borders.whole_up_to: 100001 is not in 0 to 100000");
  v1::ListInstancesResponse listed;
  ASSERT_TRUE(instances_->ListInstances(&Context(), {}, &listed).ok());
  EXPECT_EQ(listed.instances_size(), 0);
}

TEST_F(GrpcServerTest, BorderSettingsThatAreLeftOutAreFilledIn) {
  AddAgent();
  const auto made = [this](const v1::CreateInstanceRequest& request) {
    v1::CreateInstanceResponse response;
    const grpc::Status status = instances_->CreateInstance(&Context(), request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.instance().borders();
  };
  v1::CreateInstanceRequest request = CreateRequest(1);
  request.set_validate_only(true);
  EXPECT_EQ(made(request).ghost_depth(), 1U);
  EXPECT_EQ(made(request).whole_up_to(), 32U);
  request.mutable_spec()->mutable_borders()->set_ghost_depth(0);
  request.mutable_spec()->mutable_borders()->set_whole_up_to(0);
  EXPECT_TRUE(made(request).has_ghost_depth());
  EXPECT_EQ(made(request).ghost_depth(), 0U);
  EXPECT_TRUE(made(request).has_whole_up_to());
  EXPECT_EQ(made(request).whole_up_to(), 0U);
}

TEST_F(GrpcServerTest, UnknownInstancesAreNotFound) {
  v1::JoinInstanceRequest join;
  join.set_instance_id("inst-9");
  v1::JoinInstanceResponse joined;
  const grpc::Status status = sessions_->JoinInstance(&Context(), join, &joined);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(status.error_message(), "instance_id: no instance inst-9");
  v1::WatchInstanceRequest watch;
  watch.set_id("inst-9");
  Context context;
  v1::WatchInstanceResponse response;
  const auto reader = instances_->WatchInstance(&context, watch);
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(GrpcServerTest, AJoinThatGivesUpLeavesNoPlayer) {
  AddAgent();  // its workers never start
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), CreateRequest(1), &created).ok());
  v1::JoinInstanceRequest join;
  join.set_instance_id(created.instance().id());
  v1::JoinInstanceResponse joined;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(50));
  EXPECT_EQ(sessions_->JoinInstance(&context, join, &joined).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  v1::GetInstanceRequest get;
  get.set_id(created.instance().id());
  v1::GetInstanceResponse got;
  ASSERT_TRUE(instances_->GetInstance(&Context(), get, &got).ok());
  EXPECT_EQ(got.instance().players(), 0u);
}

TEST_F(GrpcServerTest, AJoinWaitsForTheWorkers) {
  AddAgent();
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), CreateRequest(4), &created).ok());
  v1::JoinInstanceRequest join;
  join.set_instance_id(created.instance().id());
  v1::JoinInstanceResponse joined;
  std::thread joining([&] { EXPECT_TRUE(sessions_->JoinInstance(&Context(), join, &joined).ok()); });
  agent_->Play();
  joining.join();
  EXPECT_EQ(joined.regions_size(), 4);
  for (const v1::RegionAddress& address : joined.regions()) EXPECT_NE(address.game_port(), 0u);
}

TEST_F(GrpcServerTest, WatchesAreLoggedAsOtherCallsAre) {
  const telemetry::CapturedLog log;
  Context context;
  v1::WatchInstanceRequest watch;
  watch.set_id("inst-9");
  EXPECT_EQ(instances_->WatchInstance(&context, watch)->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
  Context other;
  v1::WatchGameEventsRequest events;
  events.set_id("inst-8");
  EXPECT_EQ(instances_->WatchGameEvents(&other, events)->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
  // The answer may be there before its line is.
  plane_->Stop();
  server_.reset();
  plane_.reset();
  const auto line = [&](const std::string& method) {
    const auto lines = log.LinesWith("rpc method=" + method);
    return lines.size() == 1 ? lines[0] : "lines: " + std::to_string(lines.size());
  };
  EXPECT_THAT(line("InstanceService/WatchInstance"),
              AllOf(HasSubstr("who=local"), HasSubstr("subject=inst-9"), HasSubstr("result=NOT_FOUND")));
  EXPECT_THAT(line("InstanceService/WatchGameEvents"),
              AllOf(HasSubstr("who=local"), HasSubstr("subject=inst-8"), HasSubstr("result=NOT_FOUND")));
}

TEST_F(GrpcServerTest, StrangersHellosFillNoLog) {
  const telemetry::CapturedLog log;
  const std::string long_token(1 << 20, 'x');
  hello_.set_join_token(long_token);
  hello_.set_advertise_address("127.0.0.1");
  constexpr std::size_t kTimes = 100;
  const auto begun = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < kTimes; ++i) {
    const grpc::Status status = StreamAgent(channel_, hello_).Finish();
    EXPECT_EQ(status.error_message(), "hello.join_token: has 1048576 bytes, at most 256");
  }
  plane_->Stop();
  server_.reset();
  plane_.reset();
  const auto took = std::chrono::ceil<std::chrono::seconds>(std::chrono::steady_clock::now() - begun);
  std::size_t bytes = 0;
  for (const std::string& line : log.Lines()) bytes += line.size();
  const auto refused = log.LinesWith("agent refused");
  ASSERT_FALSE(refused.empty());
  EXPECT_THAT(refused.front(), HasSubstr("result=INVALID_ARGUMENT"));
  const auto most = static_cast<std::size_t>(took.count()) * telemetry::LogThrottle::kLinesPerSecond;
  EXPECT_LE(refused.size(), std::min(kTimes, most));
  EXPECT_LT(bytes, 100'000U);
}

TEST_F(GrpcServerTest, StoppingEndsWhatWaits) {
  AddAgent();
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), CreateRequest(1), &created).ok());
  v1::WatchInstanceRequest watch;
  watch.set_id(created.instance().id());
  Context context;
  const auto reader = instances_->WatchInstance(&context, watch);
  v1::WatchInstanceResponse response;
  ASSERT_TRUE(reader->Read(&response));
  plane_->Stop();
  while (reader->Read(&response)) continue;
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(GrpcServerTest, APortInUseIsNamed) {
  MemoryStore store;
  const auto authority = OpenAuthority(store, folder_.path() + "/seal.key", SystemRandomBytes);
  ASSERT_TRUE(authority.ok()) << authority.status();
  const auto start = [&](const std::string& operators) {
    return GrpcServer::Start({.socket = folder_.path() + "/second.sock", .operators = operators, .players = {}},
                             *authority, *plane_, metrics_);
  };
  const auto first = start("127.0.0.1:0");
  ASSERT_TRUE(first.ok()) << first.status();
  const std::string address = (*first)->operators();
  EXPECT_EQ(start(address).status(), absl::UnavailableError("address " + address + " is in use (grpc)"));
  EXPECT_EQ(start("").status().code(), absl::StatusCode::kUnavailable) << "the socket is in use, too";
  for (const char* wrong : {"127.0.0.1", ":80", "127.0.0.1:port", "127.0.0.1:65536", "::1:80"}) {
    EXPECT_EQ(start(wrong).status().code(), absl::StatusCode::kInvalidArgument) << wrong;
  }
}

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
