// The control plane through its sockets: gRPC clients, an agent whose workers are played.
#include "control_plane/grpc_server.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "control_plane/memory_store.h"
#include "control_plane/sqlite_store.h"
#include "control_plane/testing/grpc_server_fixture.h"
#include "telemetry/log_throttle.h"
#include "telemetry/testing/captured_log.h"

namespace tessera::control {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

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

TEST_F(GrpcServerTest, AGameForAnotherSceneIsRefusedByFileAndLineWhereItComesIn) {
  AddAgent();
  v1::CreateInstanceRequest create = CreateRequest(1);
  create.mutable_spec()->mutable_game()->set_name("game.lua");
  create.mutable_spec()->mutable_game()->set_content("function on_tick() end");
  v1::CreateInstanceResponse created;
  ASSERT_TRUE(instances_->CreateInstance(&Context(), create, &created).ok());
  const std::string foreign = "\nkinds.goat = { on_tick = function(self)\nself.wool = 1 end }\n";
  const auto expect_refused = [](const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), testing::StartsWith("game.lua:2: the scene has no bodies of the kind `goat`"));
    EXPECT_THAT(status.error_message(), HasSubstr("(and 1 more)")) << "the property";
  };
  create.mutable_spec()->mutable_game()->set_content(foreign);
  for (const bool dry_run : {true, false}) {
    create.set_validate_only(dry_run);
    v1::CreateInstanceResponse response;
    expect_refused(instances_->CreateInstance(&Context(), create, &response));
    v1::SetGameRequest set;
    set.set_id(created.instance().id());
    set.set_validate_only(dry_run);
    *set.mutable_game() = create.spec().game();
    v1::SetGameResponse answer;
    expect_refused(instances_->SetGame(&Context(), set, &answer));
  }
  v1::ListInstancesResponse listed;
  ASSERT_TRUE(instances_->ListInstances(&Context(), {}, &listed).ok());
  ASSERT_EQ(listed.instances_size(), 1) << "nothing was made";
  EXPECT_EQ(listed.instances(0).next_game_hash(), "");
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
  v1::AgentHello by_secret = hello_;
  by_secret.clear_join_token();
  by_secret.set_host_id(agent_->admitted.host_id());
  by_secret.set_host_secret(agent_->admitted.host_secret());
  const StreamAgent second(channel_, by_secret);
  EXPECT_EQ(second.admitted.host_id(), by_secret.host_id());
  StreamAgent third(channel_, hello_);
  EXPECT_EQ(third.admitted.host_id(), "");
  const grpc::Status status = third.Finish();
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

// The log is another one before there is a server, whose threads could log.
class LoggedGrpcServerTest : public GrpcServerTest {
 protected:
  const telemetry::CapturedLog log;
};

TEST_F(LoggedGrpcServerTest, WatchesAreLoggedAsOtherCallsAre) {
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

TEST_F(LoggedGrpcServerTest, StrangersHellosFillNoLog) {
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

}  // namespace
}  // namespace tessera::control
