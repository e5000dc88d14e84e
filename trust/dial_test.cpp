// Channels to a server whose certificate is of one authority, dialled by those who trust it, another one or nobody.
#include "trust/dial.h"

#include <gmock/gmock.h>
#include <grpcpp/health_check_service_interface.h>
#include <gtest/gtest.h>

#include "host/temporary_folder.h"
#include "tessera/v1/host.grpc.pb.h"
#include "trust/certificate.h"
#include "trust/fetch_authority.h"

namespace tessera::trust {
namespace {

using namespace std::chrono_literals;

class DialTest : public ::testing::Test {
 protected:
  void SetUp() override {
    authority_ = *MakeAuthority();
    fingerprint_ = ReadCertificate(authority_.certificate)->fingerprint;
    const KeyedCertificate own = *IssueServer(authority_, "10");
    grpc::SslServerCredentialsOptions options;
    options.pem_key_cert_pairs.push_back({own.key, own.certificate + authority_.certificate});
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::SslServerCredentials(options), &port_);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(port_, 0);
    address_ = "127.0.0.1:" + std::to_string(port_);
  }
  void TearDown() override {
    if (server_) server_->Shutdown(std::chrono::system_clock::now());
  }

  static bool Connects(const absl::StatusOr<std::shared_ptr<grpc::Channel>>& channel) {
    return channel.ok() && (*channel)->WaitForConnected(std::chrono::system_clock::now() + 10s);
  }
  // A channel that trusts somebody else fails at once and tries again; it does not come to connect.
  static bool Fails(const std::shared_ptr<grpc::Channel>& channel) {
    grpc_connectivity_state state = channel->GetState(true);
    while (state != GRPC_CHANNEL_TRANSIENT_FAILURE && state != GRPC_CHANNEL_READY) {
      if (!channel->WaitForStateChange(state, std::chrono::system_clock::now() + 10s)) return false;
      state = channel->GetState(true);
    }
    return state == GRPC_CHANNEL_TRANSIENT_FAILURE;
  }

  KeyedCertificate authority_;
  std::string fingerprint_, address_;
  int port_ = 0;
  v1::HostService::Service service_;  // a server has to serve something
  std::unique_ptr<grpc::Server> server_;
};

// Answers with hosts of so many bytes, twice gRPC's own limit.
class LongAnswers final : public v1::HostService::Service {
 public:
  static constexpr std::size_t kBytes = 8 << 20;
  grpc::Status ListHosts(grpc::ServerContext* /*context*/, const v1::ListHostsRequest* /*request*/,
                         v1::ListHostsResponse* response) override {
    response->add_hosts()->set_name(std::string(kBytes, 'h'));
    return grpc::Status::OK;
  }
};

TEST(DialMessagesTest, AnAnswerBeyondTheDefaultOfGrpcIsTakenUnlessTheCallerTakesLess) {
  const host::TemporaryFolder folder;
  const std::string address = "unix:" + folder.path() + "/control.sock";
  LongAnswers service;
  grpc::ServerBuilder builder;
  builder.AddListeningPort(address, grpc::InsecureServerCredentials());
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  ASSERT_NE(server, nullptr);
  const auto ask = [&](const grpc::ChannelArguments& arguments) {
    const auto channel = Dial(address, {}, arguments);
    EXPECT_TRUE(channel.ok()) << channel.status();
    grpc::ClientContext context;
    v1::ListHostsResponse response;
    const grpc::Status status = v1::HostService::NewStub(*channel)->ListHosts(&context, {}, &response);
    EXPECT_TRUE(!status.ok() || response.hosts(0).name().size() == LongAnswers::kBytes);
    return status.error_code();
  };
  grpc::ChannelArguments few;
  few.SetMaxReceiveMessageSize(1 << 20);
  EXPECT_EQ(ask({}), grpc::StatusCode::OK);
  EXPECT_EQ(ask(few), grpc::StatusCode::RESOURCE_EXHAUSTED);
  server->Shutdown(std::chrono::system_clock::now());
}

TEST_F(DialTest, OfSeveralTheOneThatServesIsFound) {
  // A second one of the same authority, which does not serve; and nobody listens at the third address.
  const KeyedCertificate own = *IssueServer(authority_, "11");
  grpc::SslServerCredentialsOptions options;
  options.pem_key_cert_pairs.push_back({own.key, own.certificate + authority_.certificate});
  grpc::EnableDefaultHealthCheckService(true);
  v1::HostService::Service follower_service, leader_service;
  const auto start = [&](v1::HostService::Service& service, int& port) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::SslServerCredentials(options), &port);
    builder.RegisterService(&service);
    return builder.BuildAndStart();
  };
  int follower_port = 0, leader_port = 0;
  const auto follower = start(follower_service, follower_port), leader = start(leader_service, leader_port);
  follower->GetHealthCheckService()->SetServingStatus(false);
  server_->Shutdown(std::chrono::system_clock::now());
  server_.reset();
  const auto list = [&](int last) {
    return address_ + "#" + fingerprint_ + ",127.0.0.1:" + std::to_string(follower_port) + "#" + fingerprint_ +
           ",127.0.0.1:" + std::to_string(last) + "#" + fingerprint_;
  };
  const auto found = Dial(list(leader_port));
  ASSERT_TRUE(found.ok()) << found.status();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 10s);
  v1::ListHostsResponse response;
  EXPECT_EQ(v1::HostService::NewStub(*found)->ListHosts(&context, {}, &response).error_code(),
            grpc::StatusCode::UNIMPLEMENTED)
      << "it is reached";

  leader->GetHealthCheckService()->SetServingStatus(false);
  const auto none = Dial(list(leader_port));
  EXPECT_EQ(none.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(none.status().message()),
              ::testing::HasSubstr("127.0.0.1:" + std::to_string(follower_port) + ": follows"));
}

// Says who it is.
class NamedMember final : public v1::HostService::Service {
 public:
  NamedMember(const KeyedCertificate& authority, const std::string& name) : name_(name) {
    const KeyedCertificate own = *IssueServer(authority, "12");
    grpc::SslServerCredentialsOptions options;
    options.pem_key_cert_pairs.push_back({own.key, own.certificate + authority.certificate});
    grpc::EnableDefaultHealthCheckService(true);
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::SslServerCredentials(options), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~NamedMember() override { server_->Shutdown(std::chrono::system_clock::now()); }
  void Serve(bool serves) { server_->GetHealthCheckService()->SetServingStatus(serves); }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  grpc::Status ListHosts(grpc::ServerContext*, const v1::ListHostsRequest*, v1::ListHostsResponse* response) override {
    response->add_hosts()->set_name(name_);
    return grpc::Status::OK;
  }

 private:
  const std::string name_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

// Empty: the call failed.
std::string WhoAnswers(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 10s);
  v1::ListHostsResponse response;
  const grpc::Status status = v1::HostService::NewStub(channel)->ListHosts(&context, {}, &response);
  return status.ok() ? response.hosts(0).name() : "";
}

TEST_F(DialTest, OneChannelFollowsTheLeader) {
  NamedMember first(authority_, "first"), second(authority_, "second");
  second.Serve(false);
  const auto channel = Dial(first.address() + "#" + fingerprint_ + "," + second.address() + "#" + fingerprint_);
  ASSERT_TRUE(channel.ok()) << channel.status();
  const auto until = [&](const std::string& name) {
    const auto end = std::chrono::steady_clock::now() + 30s;
    std::string answered;
    while (answered != name && std::chrono::steady_clock::now() < end) answered = WhoAnswers(*channel);
    return answered;
  };
  EXPECT_EQ(until("first"), "first");
  for (int i = 0; i < 20; ++i) EXPECT_EQ(WhoAnswers(*channel), "first") << "who follows gets no calls";
  first.Serve(false);
  EXPECT_EQ(until(""), "") << "while nobody leads calls fail";
  second.Serve(true);
  EXPECT_EQ(until("second"), "second");
  for (int i = 0; i < 20; ++i) EXPECT_EQ(WhoAnswers(*channel), "second");
}

TEST_F(DialTest, SeveralOfDifferentAuthoritiesAreRefused) {
  const auto channel = Dial(address_ + "#" + fingerprint_ + ",127.0.0.1:1#" + std::string(64, 'a'));
  EXPECT_EQ(channel.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(channel.status().message()), ::testing::HasSubstr("the same fingerprint for each"));
}

TEST_F(DialTest, WhoKnowsTheAuthorityOrItsFingerprintConnects) {
  EXPECT_TRUE(Connects(
      Dial(address_, {.authority = authority_.certificate, .certificate = {}, .key = {}, .bearer_token = {}})));
  EXPECT_TRUE(Connects(Dial(address_ + "#" + fingerprint_)));
  const auto fetched = FetchAuthority({"127.0.0.1", static_cast<std::uint16_t>(port_)}, fingerprint_, 10s);
  ASSERT_TRUE(fetched.ok()) << fetched.status();
  EXPECT_EQ(ReadCertificate(*fetched)->fingerprint, fingerprint_);
}

TEST_F(DialTest, WhoTrustsAnotherAuthorityDoesNot) {
  const KeyedCertificate other = *MakeAuthority();
  const auto channel =
      Dial(address_, {.authority = other.certificate, .certificate = {}, .key = {}, .bearer_token = {}});
  ASSERT_TRUE(channel.ok()) << channel.status();
  EXPECT_TRUE(Fails(*channel));
  const std::string others = ReadCertificate(other.certificate)->fingerprint;
  EXPECT_EQ(Dial(address_ + "#" + others).status().code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(DialTest, TheFingerprintAndTheKnownAuthorityMustAgree) {
  const KeyedCertificate other = *MakeAuthority();
  const Credentials credentials{.authority = other.certificate, .certificate = {}, .key = {}, .bearer_token = {}};
  EXPECT_EQ(Dial(address_ + "#" + fingerprint_, credentials).status().code(), absl::StatusCode::kUnauthenticated);
}

// A host's certificate is of the same authority. It must not do to stand in for the control plane.
TEST_F(DialTest, AHostCannotStandInForTheControlPlane) {
  const std::string key = *MakeKey();
  const std::string certificate = *IssueClient(authority_, *MakeRequest(key), kControlName, "20");
  grpc::SslServerCredentialsOptions options;
  options.pem_key_cert_pairs.push_back({key, certificate + authority_.certificate});
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::SslServerCredentials(options), &port);
  builder.RegisterService(&service_);
  const auto impostor = builder.BuildAndStart();
  ASSERT_NE(port, 0);
  const auto channel = Dial("127.0.0.1:" + std::to_string(port),
                            {.authority = authority_.certificate, .certificate = {}, .key = {}, .bearer_token = {}});
  ASSERT_TRUE(channel.ok()) << channel.status();
  EXPECT_TRUE(Fails(*channel));
  impostor->Shutdown(std::chrono::system_clock::now());
}

TEST_F(DialTest, NobodyIsTrustedUnasked) {
  EXPECT_EQ(Dial(address_).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(Dial("nowhere").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Dial(address_, {.authority = authority_.certificate, .certificate = {}, .key = {}, .bearer_token = "a b"})
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(DialTest, WhereNobodyAnswersByTlsTheFetchEnds) {
  EXPECT_EQ(FetchAuthority({"127.0.0.1", 1}, fingerprint_, 10s).status().code(), absl::StatusCode::kUnavailable);
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service_);
  const auto plain = builder.BuildAndStart();
  EXPECT_EQ(FetchAuthority({"127.0.0.1", static_cast<std::uint16_t>(port)}, fingerprint_, 500ms).status().code(),
            absl::StatusCode::kUnavailable);
  plain->Shutdown(std::chrono::system_clock::now());
}

}  // namespace
}  // namespace tessera::trust
