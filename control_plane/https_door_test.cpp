// The players' HTTPS door over real TLS: tickets exchanged for grants, and what strangers send.
#include "control_plane/https_door.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/pem.h>
#include <sodium.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <thread>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "control_plane/grpc_server.h"
#include "control_plane/memory_store.h"
#include "control_plane/testing/fake_backend.h"
#include "control_plane/testing/fake_workers.h"
#include "control_plane/testing/loaded_plane.h"
#include "control_plane/testing/test_plan.h"
#include "host/temporary_folder.h"
#include "net/join_grant.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "trust/certificate.h"
#include "trust/dial.h"
#include "trust/openssl_handles.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

// An agent without a stream, whose workers are played.
class PlayedAgent {
 public:
  explicit PlayedAgent(ControlPlane& plane) : plane_(plane) {
    v1::AddHostRequest add;
    add.set_name("alpha");
    v1::AgentHello hello;
    hello.set_join_token(plane.Call([&](Cluster& c, Now now) { return c.AddHost(now, add); })->join_token());
    hello.set_advertise_address("127.0.0.1");
    hello.mutable_resources()->set_region_capacity(8);
    stream_ = *plane.Attach(hello, [] {});
    thread_ = std::thread([this] { Play(); });
  }
  ~PlayedAgent() {
    plane_.Detach(*stream_);
    thread_.join();
  }

 private:
  void Play() {
    while (const auto message = plane_.NextMessage(*stream_)) {
      std::vector<v1::AgentMessage> out = fake_.Apply(message->desired());
      out.push_back(fake_.Heartbeat());
      for (v1::AgentMessage& sent : out) {
        if (sent.has_report()) Address(*sent.mutable_report());
        if (sent.has_heartbeat()) {
          for (v1::WorkerReport& report : *sent.mutable_heartbeat()->mutable_workers()) Address(report);
        }
        if (!plane_.HandleAgentMessage(*stream_, sent).ok()) return;
      }
    }
  }
  static void Address(v1::WorkerReport& report) {
    report.mutable_address()->set_host("127.0.0.1");
    report.mutable_address()->set_region(report.identity().region());
    report.mutable_address()->set_incarnation(report.identity().incarnation());
  }

  ControlPlane& plane_;
  std::shared_ptr<ControlPlane::AgentStream> stream_;
  FakeWorkers fake_;
  std::thread thread_;
};

class HttpsDoorTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_GE(sodium_init(), 0);
    plane_ = LoadPlane(store_);
    ASSERT_NE(plane_, nullptr);
    authority_ = *trust::MakeAuthority();
    const auto own = *trust::IssueServer(authority_, "01");
    settings_ = {.listen = {"127.0.0.1", 0}, .certificate = own.certificate, .key = own.key};
    agent_ = std::make_unique<PlayedAgent>(*plane_);
    const auto issuer = plane_->Call([&](Cluster& c, Now now) { return c.AddIssuer(now, game_.Registration("game")); });
    ASSERT_TRUE(issuer.ok()) << issuer.status();
    game_.SetCluster(issuer->cluster_id());
    Open();
  }
  void TearDown() override {
    plane_->Stop();
    door_.reset();
    agent_.reset();
    plane_.reset();
  }
  void Open() {
    door_.reset();
    auto door = HttpsDoor::Start(settings_, *plane_, metrics_);
    ASSERT_TRUE(door.ok()) << door.status();
    door_ = *std::move(door);
  }
  std::string Instance(bool guests = false, bool lazy = false) {
    InstancePlan plan = TestPlan(2, lazy ? 2 : 0);
    plan.scene_hash = std::string(64, 'a');
    plan.guests = guests;
    plan.lazy = lazy;
    const auto made = plane_->Call([&](Cluster& c, Now now) { return c.CreateInstance(now, plan, false); });
    EXPECT_TRUE(made.ok()) << made.status();
    return made->id();
  }

  // A connection to the door; closed with the object.
  struct Wire {
    explicit Wire(const std::string& address) : fd(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
      EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    }
    ~Wire() { close(fd); }
    Wire(const Wire&) = delete;
    Wire& operator=(const Wire&) = delete;
    // All that comes until the other side closes.
    std::string ReadAll() const {
      std::string all;
      char bytes[4096];
      for (ssize_t n = 0; (n = recv(fd, bytes, sizeof bytes, 0)) > 0;) all.append(bytes, static_cast<std::size_t>(n));
      return all;
    }
    int fd;
  };

  // The answer to the bytes, by TLS that trusts the authority alone; "" if there is no connection.
  std::string Exchange(const std::string& sent) const {
    const trust::TlsContextHandle context(SSL_CTX_new(TLS_client_method()));
    const trust::CertificateHandle root(
        PEM_read_bio_X509(trust::ReadFrom(authority_.certificate).get(), nullptr, nullptr, nullptr));
    X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), root.get());
    SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
    const Wire wire(door_->address());
    const std::unique_ptr<SSL, trust::Freed<SSL_free>> tls(SSL_new(context.get()));
    SSL_set_fd(tls.get(), wire.fd);
    SSL_set1_host(tls.get(), trust::kControlName);
    if (SSL_connect(tls.get()) != 1 || SSL_write(tls.get(), sent.data(), static_cast<int>(sent.size())) <= 0) return "";
    std::string all;
    char bytes[4096];
    for (int n = 0; (n = SSL_read(tls.get(), bytes, sizeof bytes)) > 0;) all.append(bytes, static_cast<std::size_t>(n));
    ERR_clear_error();
    return all;
  }
  struct HttpAnswer {
    int status = 0;
    std::string headers;
    nlohmann::json body;
  };
  HttpAnswer Send(const std::string& text) const {
    const std::string all = Exchange(text);
    const std::size_t end = all.find("\r\n\r\n");
    if (end == std::string::npos) return {};
    return {std::stoi(all.substr(9, 3)), all.substr(0, end),
            nlohmann::json::parse(all.substr(end + 4), nullptr, false)};
  }
  HttpAnswer Post(const std::string& path, const nlohmann::json& body) const {
    const std::string text = body.dump();
    return Send(absl::StrCat("POST ", path,
                             " HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: ", text.size(),
                             "\r\n\r\n", text));
  }
  static absl::StatusOr<net::JoinGrant> GrantIn(const HttpAnswer& answer) {
    std::string bytes;
    if (!answer.body.contains("grant") || !absl::Base64Unescape(answer.body["grant"].get<std::string>(), &bytes)) {
      return absl::NotFoundError("no grant: " + answer.body.dump());
    }
    return net::DecodeJoinGrant({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  }
  v1::Instance Get(const std::string& id) {
    return *plane_->Call([&](Cluster& c, Now) { return GetInstance(c.state(), id); });
  }

  MemoryStore store_;
  ControlMetrics metrics_;
  std::unique_ptr<ControlPlane> plane_;
  trust::KeyedCertificate authority_;
  HttpsSettings settings_;
  std::unique_ptr<PlayedAgent> agent_;
  std::unique_ptr<HttpsDoor> door_;
  FakeBackend game_{1};
};

TEST_F(HttpsDoorTest, ATicketIsExchangedForAGrantOnce) {
  const std::string id = Instance();
  const nlohmann::json body{{"ticket", game_.MakeText("ada", ControlPlane::ReadClocks())}, {"instance", id}};
  const HttpAnswer joined = Post("/v1/join", body);
  ASSERT_EQ(joined.status, 200) << joined.body;
  EXPECT_EQ(joined.body["player"], 1);
  const auto grant = GrantIn(joined);
  ASSERT_TRUE(grant.ok()) << grant.status();
  EXPECT_EQ(grant->player, PlayerNumber(1));
  EXPECT_EQ(grant->credentials.instance_id, id);
  EXPECT_EQ(grant->regions.size(), 2U);
  EXPECT_EQ(grant->regions[0].host, "127.0.0.1");
  EXPECT_EQ(Get(id).player_list(0).player_id(), "ada");
  const HttpAnswer copied = Post("/v1/join", body);
  EXPECT_EQ(copied.status, 401);
  EXPECT_EQ(copied.body["field"], "ticket");
  EXPECT_EQ(Get(id).players(), 1U);
}

TEST_F(HttpsDoorTest, WhoHasAGrantComesBackAndLeaves) {
  const std::string id = Instance();
  const HttpAnswer first =
      Post("/v1/join", {{"ticket", game_.MakeText("ada", ControlPlane::ReadClocks())}, {"instance", id}});
  ASSERT_EQ(first.status, 200) << first.body;
  const HttpAnswer again = Post("/v1/join", {{"grant", first.body["grant"]}});
  ASSERT_EQ(again.status, 200) << again.body;
  EXPECT_EQ(again.body["player"], 1);
  EXPECT_EQ(Get(id).player_list(0).generation(), 2U);
  EXPECT_EQ(Post("/v1/leave", {{"grant", again.body["grant"]}}).status, 200);
  EXPECT_EQ(Get(id).players(), 0U);
  EXPECT_EQ(Post("/v1/join", {{"grant", again.body["grant"]}}).status, 409);
}

TEST_F(HttpsDoorTest, AGuestIsLetInWhereGuestsAre) {
  const HttpAnswer refused = Post("/v1/join", {{"name", "Ann"}, {"instance", Instance()}});
  EXPECT_EQ(refused.status, 401);
  EXPECT_EQ(refused.body["error"], "ticket: this instance takes no guests: a ticket is needed");
  EXPECT_EQ(Post("/v1/join", {{"viewer", true}, {"instance", Instance()}}).status, 401);
  const std::string open = Instance(true);
  EXPECT_EQ(Post("/v1/join", {{"name", "Ann"}, {"instance", open}}).status, 200);
  EXPECT_EQ(Get(open).player_list(0).name(), "Ann");
}

TEST_F(HttpsDoorTest, ErrorsHaveAStatusAndAField) {
  const HttpAnswer none = Post("/v1/join", {{"instance", "inst-99"}});
  EXPECT_EQ(none.status, 404);
  EXPECT_EQ(none.body["field"], "instance");
  EXPECT_EQ(Post("/v1/join", {{"name", "Ann"}}).body["error"], "instance: missing");
  EXPECT_EQ(Post("/v1/join", "text").status, 400);
  EXPECT_EQ(Post("/v1/other", {}).status, 404);
  EXPECT_EQ(Send("GET /v1/join HTTP/1.1\r\nHost: x\r\n\r\n").status, 405);
  EXPECT_EQ(Send("POST /v1/join HTTP/1.1\r\nHost: x\r\n\r\n").status, 411);
  EXPECT_EQ(Send("POST /v1/join HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n").status, 400);
  EXPECT_EQ(Send("POST /v1/join HTTP/1.1\r\nHost: x\r\nContent-Length: 64000000\r\n\r\n{}").status, 413);
  const HttpAnswer preflight = Send("OPTIONS /v1/join HTTP/1.1\r\nHost: x\r\nOrigin: https://game.example\r\n\r\n");
  EXPECT_EQ(preflight.status, 204);
  EXPECT_THAT(preflight.headers, HasSubstr("access-control-allow-methods: POST"));
}

TEST_F(HttpsDoorTest, ListsTheWorldsWithWhoIsInWhereOneWaits) {
  const std::string open = Instance(true);
  const std::string waiting = Instance(true, /*lazy=*/true);
  ASSERT_EQ(Post("/v1/join", {{"name", "Ann"}, {"instance", open}}).status, 200);
  const HttpAnswer listed = Post("/v1/instances", nlohmann::json::object());
  ASSERT_EQ(listed.status, 200) << listed.body;
  ASSERT_EQ(listed.body["instances"].size(), 2U);
  for (const auto& one : listed.body["instances"]) {
    EXPECT_EQ(one["players"], one["id"] == open ? 1 : 0);
    EXPECT_EQ(one["regions"], 2);
  }
  EXPECT_EQ(listed.body["instances"][0]["id"], open);
  EXPECT_EQ(listed.body["instances"][1]["id"], waiting);
  EXPECT_EQ(Post("/v1/instances", {{"page", 1}}).body["error"], "page: is not a field of this request");
}

// At a socket of this machine: without TLS, and whoever may open the file is no stranger.
TEST_F(HttpsDoorTest, ASocketServesThisUserAlone) {
  const host::TemporaryFolder folder;
  const std::string path = folder.path() + "/control.sock.json";
  HttpsSettings settings;
  settings.socket_path = path;
  auto door = HttpsDoor::Start(settings, *plane_, metrics_);
  ASSERT_TRUE(door.ok()) << door.status();
  EXPECT_EQ((*door)->address(), path);
  struct stat found {};
  ASSERT_EQ(stat(path.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0600U);

  const std::string body = nlohmann::json{{"name", "Ann"}, {"instance", Instance(true)}}.dump();
  const std::string sent =
      absl::StrCat("POST /v1/join HTTP/1.1\r\nHost: x\r\nContent-Length: ", body.size(), "\r\n\r\n", body);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  ASSERT_LT(path.size(), sizeof to.sun_path);
  std::copy(path.begin(), path.end(), to.sun_path);
  ASSERT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  ASSERT_EQ(send(fd, sent.data(), sent.size(), MSG_NOSIGNAL), static_cast<ssize_t>(sent.size()));
  std::string all;
  char bytes[4096];
  for (ssize_t n = 0; (n = recv(fd, bytes, sizeof bytes, 0)) > 0;) all.append(bytes, static_cast<std::size_t>(n));
  close(fd);
  EXPECT_THAT(all, HasSubstr("HTTP/1.1 200"));
  EXPECT_THAT(all, HasSubstr("\"player\":1"));

  HttpsSettings second;
  second.socket_path = path;
  EXPECT_EQ(HttpsDoor::Start(second, *plane_, metrics_).status().code(), absl::StatusCode::kUnavailable);
  plane_->Stop();
  door->reset();
  EXPECT_NE(stat(path.c_str(), &found), 0) << "the socket goes with the door";
}

// As at the operators' socket: a worker that was taken over has this user's rights to the file, and gets no grant.
TEST_F(HttpsDoorTest, ASocketServesNobodyWhoHasGivenUpRights) {
  if (prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1) GTEST_SKIP() << "this process has given them up itself";
  const host::TemporaryFolder folder;
  const std::string path = folder.path() + "/control.sock.json";
  HttpsSettings settings;
  settings.socket_path = path;
  auto door = HttpsDoor::Start(settings, *plane_, metrics_);
  ASSERT_TRUE(door.ok()) << door.status();
  const std::string sent = "POST /v1/instances HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\n\r\n{}";
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  ASSERT_LT(path.size(), sizeof to.sun_path);
  std::copy(path.begin(), path.end(), to.sun_path);
  const auto answered = [&](bool restrained) {
    const pid_t child = fork();
    if (child == 0) {
      const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
      char byte = 0;
      const bool asked = (!restrained || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0) &&
                         connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
      if (asked) (void)!send(fd, sent.data(), sent.size(), MSG_NOSIGNAL);
      _exit(!asked ? 2 : recv(fd, &byte, 1, 0) == 1 ? 1 : 0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  EXPECT_EQ(answered(false), 1);
  EXPECT_EQ(answered(true), 0);
  EXPECT_EQ(answered(false), 1) << "others are, as before";
}

TEST_F(HttpsDoorTest, PlainTextAndRubbishGetNothing) {
  for (const std::string& sent : {std::string("POST /v1/join HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\n\r\n{}"),
                                  std::string(1000, '\0'), std::string("\x16\x03\x01 no hello")}) {
    const Wire wire(door_->address());
    ASSERT_GT(send(wire.fd, sent.data(), sent.size(), MSG_NOSIGNAL), 0);
    // Else the door waits for the rest of a hello, where it has not closed the connection already.
    if (shutdown(wire.fd, SHUT_WR) != 0) {
      ASSERT_EQ(errno, ENOTCONN);
    }
    EXPECT_THAT(wire.ReadAll(), ::testing::Not(HasSubstr("HTTP/1")));
  }
  EXPECT_EQ(Post("/v1/other", {}).status, 404) << "others are served";
}

TEST_F(HttpsDoorTest, AnAddressHasSoManyConnectionsAndGetsThemBack) {
  settings_.max_from_address = 4;
  Open();
  std::vector<std::unique_ptr<Wire>> silent;
  silent.reserve(4);
  for (int i = 0; i < 4; ++i) silent.push_back(std::make_unique<Wire>(door_->address()));
  // The loop accepts in order, so the fifth comes after those four.
  EXPECT_EQ(Wire(door_->address()).ReadAll(), "") << "closed at once";
  silent.clear();
  HttpAnswer answer;
  for (int i = 0; i < 1000 && answer.status == 0; ++i) answer = Post("/v1/other", {});
  EXPECT_EQ(answer.status, 404);
}

// The gRPC door for players shows whoever asks who plays: by name, not by account.
TEST_F(HttpsDoorTest, StrangersAreShownNoAccounts) {
  // Before there is another server: the fixture's host says nothing more, and is lost five seconds after it came.
  const std::string id = Instance();
  ASSERT_EQ(Post("/v1/join", {{"ticket", game_.MakeText("ada", ControlPlane::ReadClocks())}, {"instance", id}}).status,
            200);
  const host::TemporaryFolder folder;
  const std::string fingerprint = trust::ReadCertificate(authority_.certificate)->fingerprint;
  const auto server =
      GrpcServer::Start({.socket = folder.path() + "/control.sock", .operators = {}, .players = "127.0.0.1:0"},
                        Authority{.signer = authority_, .fingerprint = fingerprint}, *plane_, metrics_);
  ASSERT_TRUE(server.ok()) << server.status();
  v1::GetInstanceRequest request;
  request.set_id(id);
  const auto shown = [&](const std::string& address) {
    v1::GetInstanceResponse response;
    grpc::ClientContext context;
    const auto channel = trust::Dial(address, {}, grpc::ChannelArguments());
    EXPECT_TRUE(v1::InstanceService::NewStub(*channel)->GetInstance(&context, request, &response).ok());
    return response.instance().player_list(0);
  };
  EXPECT_EQ(shown((*server)->players() + "#" + fingerprint).name(), "name of ada");
  EXPECT_EQ(shown((*server)->players() + "#" + fingerprint).player_id(), "");
  EXPECT_EQ(shown((*server)->socket()).player_id(), "ada");
}

TEST_F(HttpsDoorTest, ItEndsWhileAJoinWaitsForItsWorld) {
  const std::string id = Instance(true, /*lazy=*/true);
  std::thread waiting([&] { EXPECT_NE(Post("/v1/join", {{"instance", id}}).status, 200); });
  while (!plane_->Call([&](Cluster& c, Now) { return c.WaitingPlayers(id) == 1; })) std::this_thread::yield();
  plane_->Stop();
  door_.reset();
  waiting.join();
}

TEST_F(HttpsDoorTest, ACertificateWithAnothersKeyIsRefused) {
  settings_.key = *trust::MakeKey();
  EXPECT_EQ(HttpsDoor::Start(settings_, *plane_, metrics_).status().code(), absl::StatusCode::kInvalidArgument);
  settings_.certificate = "no PEM";
  const absl::Status status = HttpsDoor::Start(settings_, *plane_, metrics_).status();
  EXPECT_THAT(std::string(status.message()), HasSubstr("players' certificate: the certificate cannot be read"));
}

}  // namespace
}  // namespace tessera::control
