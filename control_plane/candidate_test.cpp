// Several control planes in one process over one FakeEtcd: one leads, the others say who.
#include "control_plane/candidate.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <sodium.h>

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <map>
#include <thread>

#include "control_plane/etcd/etcd_store.h"
#include "control_plane/testing/fake_etcd.h"
#include "control_plane/testing/free_address.h"
#include "control_plane/testing/grpc_server_fixture.h"
#include "host/temporary_folder.h"
#include "tessera/v1/host.grpc.pb.h"
#include "trust/dial.h"
#include "trust/leader_hint.h"

namespace tessera::control {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr std::chrono::seconds kCandidatePatience{30};
constexpr ElectionTimes kQuickElection{.ttl = 2s, .poll = 10ms};

// A control plane as a process would run it.
class Member {
 public:
  Member(const FakeEtcd& etcd, const std::string& folder, const std::string& shared, const std::string& name,
         const std::string& listen = "")
      : client_(etcd.Connect()),
        http_(*telemetry::MetricsServer::Start("127.0.0.1", 0, metrics_.registry())),
        pages_{.server = *http_},
        socket_(folder + "/" + name + ".sock"),
        candidate_(*client_, "tessera", {.operators = listen.empty() ? name + ":7700" : listen, .players = ""},
                   {.doors = {.socket = socket_, .operators = listen, .players = {}},
                    .seal = folder + "/seal.key",
                    .checkpoints = shared,
                    .store_name = "tessera in etcd",
                    .control = {}},
                   metrics_, pages_, kQuickElection) {
    AddPages(*http_, pages_.gate);
    thread_ = std::thread([this] {
      result_ = candidate_.Run([this] { return ended_.load(); },
                               [this] {
                                 ready_ = true;
                                 return absl::OkStatus();
                               });
      over_ = true;
    });
  }
  ~Member() { End().IgnoreError(); }
  absl::Status End() {
    ended_ = true;
    if (thread_.joinable()) thread_.join();
    return result_;
  }
  bool leads() const {
    return pages_.gate->With([](ControlPlane&) {});
  }
  bool ready() const { return ready_; }
  bool over() const { return over_; }
  double gauge() const {
    for (const prometheus::MetricFamily& family : metrics_.registry()->Collect()) {
      if (family.name == "tessera_control_leads") return family.metric.at(0).gauge.value;
    }
    return -1;
  }
  std::shared_ptr<grpc::Channel> Channel() const {
    grpc::ChannelArguments own;  // else a channel that failed before the door opened is met again
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel("unix:" + socket_, grpc::InsecureChannelCredentials(), own);
  }
  std::unique_ptr<v1::HostService::Stub> Hosts() const { return v1::HostService::NewStub(Channel()); }

 private:
  std::unique_ptr<EtcdClient> client_;
  ControlMetrics metrics_;
  std::unique_ptr<telemetry::MetricsServer> http_;
  const Pages pages_;
  const std::string socket_;
  Candidate candidate_;
  std::atomic<bool> ended_{false}, ready_{false}, over_{false};
  absl::Status result_;
  std::thread thread_;
};

// An agent with one worker, which asks for leases.
class AskingAgent {
 public:
  AskingAgent(const std::shared_ptr<grpc::Channel>& channel, const std::string& join_token)
      : stub_(v1::AgentLinkService::NewStub(channel)) {
    context_.set_deadline(std::chrono::system_clock::now() + kCandidatePatience);
    stream_ = stub_->Attach(&context_);
    v1::AgentMessage first;
    first.mutable_hello()->set_join_token(join_token);
    first.mutable_hello()->set_advertise_address("127.0.0.1");
    first.mutable_hello()->mutable_resources()->set_region_capacity(1);
    stream_->Write(first);
    v1::ControlMessage answer;
    stream_->Read(&answer);
  }
  ~AskingAgent() { context_.TryCancel(); }
  // Waits until it is ordered to run one.
  bool AwaitWorker() {
    v1::ControlMessage message;
    while (stream_->Read(&message)) {
      if (message.desired().workers_size() == 0) continue;
      const v1::WorkerOrder& order = message.desired().workers(0);
      identity_.set_instance_id(order.instance_id());
      identity_.set_region(order.region());
      identity_.set_incarnation(order.incarnation());
      return true;
    }
    return false;
  }
  void Ask(std::uint64_t number) {
    v1::AgentMessage message;
    *message.mutable_lease()->mutable_identity() = identity_;
    message.mutable_lease()->set_number(number);
    stream_->Write(message);
  }
  // The number of the next lease that comes; 0: the stream is over.
  std::uint64_t NextLease() {
    v1::ControlMessage message;
    while (stream_->Read(&message)) {
      if (message.has_lease()) return message.lease().number();
    }
    return 0;
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<v1::AgentLinkService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::AgentMessage, v1::ControlMessage>> stream_;
  v1::WorkerIdentity identity_;
};

class CandidateTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_GE(sodium_init(), 0); }

  // Polls, since what is waited for is said by nobody.
  template <class Condition>
  static bool Eventually(Condition&& condition) {
    const auto until = std::chrono::steady_clock::now() + kCandidatePatience;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > until) return false;
      std::this_thread::yield();
    }
    return true;
  }
  static grpc::Status Add(const Member& member, const std::string& name) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kCandidatePatience);
    v1::AddHostRequest request;
    request.set_name(name);
    v1::AddHostResponse response;
    return member.Hosts()->AddHost(&context, request, &response);
  }
  static int Hosts(const Member& member) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kCandidatePatience);
    v1::ListHostsResponse response;
    return member.Hosts()->ListHosts(&context, {}, &response).ok() ? response.hosts_size() : -1;
  }
  std::unique_ptr<Member> Start(const std::string& name, const std::string& listen = "") {
    return std::make_unique<Member>(etcd_, folder_.path(), folder_.path() + "/shared", name, listen);
  }

  host::TemporaryFolder folder_;
  FakeEtcd etcd_;
};

TEST_F(CandidateTest, OneLeadsAndTheOthersSayWho) {
  const auto one = Start("one");
  ASSERT_TRUE(Eventually([&] { return one->ready() && one->leads(); }));
  const auto two = Start("two");
  ASSERT_TRUE(Eventually([&] { return two->ready(); }));
  EXPECT_FALSE(two->leads());
  EXPECT_EQ(one->gauge(), 1);
  EXPECT_EQ(two->gauge(), 0);
  EXPECT_TRUE(Eventually([&] { return !etcd_.Value("tessera/serving").empty(); }))
      << "two may look whether one is there";

  EXPECT_TRUE(Add(*one, "alpha").ok());
  grpc::Status refused;
  ASSERT_TRUE(Eventually([&] {
    refused = Add(*two, "beta");
    return refused.error_message().find("not known") == std::string::npos;
  }));
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(refused.error_message(), "this control plane does not lead; the leader is one:7700");

  grpc::ClientContext context;
  v1::ListHostsResponse response;
  EXPECT_FALSE(two->Hosts()->ListHosts(&context, {}, &response).ok());
  const auto hint = context.GetServerTrailingMetadata().find(trust::kLeaderHeader);
  ASSERT_NE(hint, context.GetServerTrailingMetadata().end());
  EXPECT_EQ(std::string(hint->second.data(), hint->second.size()), "one:7700");
}

TEST_F(CandidateTest, TheNextLeadsOnFromTheStore) {
  auto one = Start("one");
  ASSERT_TRUE(Eventually([&] { return one->leads(); }));
  const auto two = Start("two");
  ASSERT_TRUE(Eventually([&] { return two->ready(); }));
  ASSERT_TRUE(Add(*one, "alpha").ok());
  EXPECT_TRUE(one->End().ok());
  ASSERT_TRUE(Eventually([&] { return two->leads(); }));
  EXPECT_EQ(Hosts(*two), 1);
  EXPECT_TRUE(Add(*two, "beta").ok());
}

// The process stays: it follows, and leads again when it is elected again.
TEST_F(CandidateTest, WhoIsDeposedFollows) {
  const auto one = Start("one");
  ASSERT_TRUE(Eventually([&] { return one->leads(); }));
  ASSERT_TRUE(Add(*one, "alpha").ok());
  auto two = Start("two");
  ASSERT_TRUE(Eventually([&] { return two->ready(); }));
  // The next election is mostly won by the one that waits; not, if the other one notices at that moment.
  for (int i = 0; i < 20 && !two->leads(); ++i) {
    etcd_.ExpireLeases();
    ASSERT_TRUE(Eventually([&] {
      const bool won = etcd_.Value("tessera/leader").starts_with("two");
      return won ? two->leads() && !one->leads() : etcd_.Value("tessera/leader").starts_with("one");
    }));
  }
  ASSERT_TRUE(two->leads());
  EXPECT_EQ(Hosts(*two), 1);
  grpc::Status refused;
  ASSERT_TRUE(Eventually([&] {
    refused = Add(*one, "beta");
    return refused.error_message() == "this control plane does not lead; the leader is two:7700";
  })) << refused.error_message();
  EXPECT_TRUE(two->End().ok());
  ASSERT_TRUE(Eventually([&] { return one->leads(); }));
  EXPECT_EQ(Hosts(*one), 1);
  EXPECT_TRUE(one->End().ok());
}

// Its own lease is not over yet, and yet another may lead by now: etcd may have revoked it early.
TEST_F(CandidateTest, ALeaderThatEtcdDoesNotAnswerRenewsNoWorkersLease) {
  const auto one = Start("one");
  ASSERT_TRUE(Eventually([&] { return one->leads(); }));
  v1::AddHostRequest add;
  add.set_name("alpha");
  v1::AddHostResponse added;
  ASSERT_TRUE(one->Hosts()->AddHost(&Context(), add, &added).ok());
  AskingAgent agent(one->Channel(), added.join_token());
  v1::CreateInstanceRequest create;
  *create.mutable_spec()->mutable_scene() = TestScene();
  create.mutable_spec()->set_regions(1);
  v1::CreateInstanceResponse created;
  const grpc::Status status =
      v1::InstanceService::NewStub(one->Channel())->CreateInstance(&Context(), create, &created);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_TRUE(agent.AwaitWorker());

  agent.Ask(1);
  EXPECT_EQ(agent.NextLease(), 1U);
  etcd_.FailReads(true);
  agent.Ask(2);
  EXPECT_EQ(agent.NextLease(), 0U) << "it steps down, and has given none until then";
  etcd_.FailReads(false);
}

TEST_F(CandidateTest, AFollowersDoorShowsTheClustersAuthority) {
  const std::string first = FreeLoopbackAddress(), second = FreeLoopbackAddress();
  const auto one = Start("one", first);
  ASSERT_TRUE(Eventually([&] { return one->leads(); }));
  const auto two = Start("two", second);
  ASSERT_TRUE(Eventually([&] { return two->ready(); }));
  const auto client = etcd_.Connect();
  const auto authority = ReadAuthority(*ReadEtcdValue(*client, "tessera", kAuthorityKey), folder_.path() + "/seal.key");
  ASSERT_TRUE(authority.ok()) << authority.status();
  const auto channel = trust::Dial(second + "#" + authority->fingerprint);
  ASSERT_TRUE(channel.ok()) << channel.status();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kCandidatePatience);
  v1::ListHostsResponse response;
  const grpc::Status status = v1::HostService::NewStub(*channel)->ListHosts(&context, {}, &response);
  EXPECT_THAT(status.error_message(), HasSubstr("this control plane does not lead"));
}

TEST_F(CandidateTest, AFollowerWithoutTheSealSaysWhatToDo) {
  const auto one = Start("one", FreeLoopbackAddress());
  ASSERT_TRUE(Eventually([&] { return one->leads(); }));
  std::filesystem::rename(folder_.path() + "/seal.key", folder_.path() + "/away");
  const auto two = Start("two", FreeLoopbackAddress());
  ASSERT_TRUE(Eventually([&] { return two->over(); }));
  const absl::Status ended = two->End();
  EXPECT_EQ(ended.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(ended.message()), HasSubstr("copy that of another control plane of this cluster"));
}

TEST_F(CandidateTest, AnEmptiedEtcdBesideCheckpointsIsRefused) {
  std::filesystem::create_directories(folder_.path() + "/shared/inst-3/1200");
  const auto one = Start("one");
  ASSERT_TRUE(Eventually([&] { return one->over(); }));
  EXPECT_THAT(std::string(one->End().message()), HasSubstr("but tessera in etcd is empty"));
  const std::vector<std::string> keys = etcd_.Keys();
  EXPECT_TRUE(keys.empty()) << keys.front();
}

}  // namespace
}  // namespace tessera::control
