#include "bench/acceptor.h"
#include "bench/thread_cpu.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "net/acceptor.h"
#include "net/endpoint.h"
#include "net/testing/spoofed_flood.h"
#include "net/testing/test_identity.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Bytes = std::vector<std::uint8_t>;
using std::chrono::milliseconds;

constexpr char kScene[] = "acceptor", kEngine[] = "tessera", kInstance[] = "bench-1";
constexpr double kFloodPerSecond = 20'000;
constexpr std::size_t kFloodAddresses = 256;
constexpr milliseconds kPatience{10'000};
constexpr std::size_t kPayloadBytes = 1200 - net::kSealHeaderBytes - net::kSealTagBytes;
const net::Address kServer{.host = 0x0100007f, .port = 7777}, kDialler{.host = 0x0200007f, .port = 5000};

double Seconds(Clock::duration span) { return std::chrono::duration<double>(span).count(); }

net::EndpointIdentity IdentityOf(const net::SigningKey& key) {
  return net::TestWorker(key, kInstance, RegionId(1), Incarnation(1));
}

net::Credentials CredentialsOf(const net::SigningKey& key, std::uint32_t player) {
  return net::IssuePlayer(kInstance, PlayerNumber(player), net::Generation(1), key);
}

constexpr net::Rate kNoLimit{.per_s = 1e12, .burst = 1e12};

// Two acceptors in one process, and a session between them.
struct Ends {
  Ends() {
    server.Open(IdentityOf(key));
    dial = *dialler.Dial(now, kServer, RegionId(1), Incarnation(1), CredentialsOf(key, 1));
    Bytes bytes = dialler.Due(now).at(0).bytes;
    for (net::Acceptor* at = &server; !bytes.empty(); at = at == &server ? &dialler : &server) {
      const auto received = at->Receive(now, at == &server ? kDialler : kServer, bytes);
      if (received.kind != net::Acceptor::Received::Kind::kReply) break;
      Bytes next(received.bytes.begin(), received.bytes.end());
      if (at == &dialler) login = next;
      bytes = std::move(next);
    }
  }
  Bytes Sealed(std::size_t payload) {
    Bytes datagram(net::kSealHeaderBytes + payload + net::kSealTagBytes, 0x55);
    dialler.Seal(dial, net::DatagramKind::kSealed, datagram, payload);
    return datagram;
  }
  bool AtServer(Bytes& bytes) {
    return server.Receive(now, kDialler, bytes).kind == net::Acceptor::Received::Kind::kPayload;
  }

  net::SigningKey key = net::SigningKey::Make();
  Clock::time_point now = Clock::now();
  // Without a limit on logins, so that forged ones are looked at as closely as can be.
  net::Acceptor server{
      {.max_sessions = 64, .hellos = kNoLimit, .hellos_of_an_address = kNoLimit, .logins_of_an_address = kNoLimit}},
      dialler{{.max_sessions = 64}};
  net::SessionNumber dial;
  Bytes login;
};

absl::Status MeasureSealing(bool quick, Report& report) {
  Ends ends;
  const int rounds = quick ? 20'000 : 300'000;
  std::vector<Bytes> sealed;
  double sealing_s = 0, opening_s = 0;
  constexpr std::size_t kBatch = 500;
  for (int done = 0; done < rounds; done += static_cast<int>(kBatch)) {
    sealed.assign(kBatch, Bytes(1200, 0x55));
    double begin = ThreadCpuSeconds();
    for (Bytes& bytes : sealed) ends.dialler.Seal(ends.dial, net::DatagramKind::kSealed, bytes, kPayloadBytes);
    sealing_s += ThreadCpuSeconds() - begin;
    begin = ThreadCpuSeconds();
    for (Bytes& bytes : sealed) {
      if (!ends.AtServer(bytes)) return absl::InternalError("a genuine datagram was not taken");
    }
    opening_s += ThreadCpuSeconds() - begin;
  }
  report.Add(kScene, kEngine, "1200 B", "seal_ns", sealing_s * 1e9 / rounds, "ns");
  report.Add(kScene, kEngine, "1200 B", "open_ns", opening_s * 1e9 / rounds, "ns");
  return absl::OkStatus();
}

// Measures the cost of a whole handshake to each side: hello, challenge, login, acceptance.
absl::Status MeasureLogins(bool quick, Report& report) {
  Ends ends;
  const net::Credentials credentials = CredentialsOf(ends.key, 2);
  const int rounds = quick ? 500 : 5'000;
  double dialler_s = 0, server_s = 0;
  for (int i = 0; i < rounds; ++i) {
    double begin = ThreadCpuSeconds();
    const net::SessionNumber dial = *ends.dialler.Dial(ends.now, kServer, RegionId(1), Incarnation(1), credentials);
    Bytes bytes = ends.dialler.Due(ends.now).at(0).bytes;
    dialler_s += ThreadCpuSeconds() - begin;
    for (net::Acceptor* at = &ends.server; !bytes.empty(); at = at == &ends.server ? &ends.dialler : &ends.server) {
      begin = ThreadCpuSeconds();
      const auto received = at->Receive(ends.now, at == &ends.server ? kDialler : kServer, bytes);
      (at == &ends.server ? server_s : dialler_s) += ThreadCpuSeconds() - begin;
      const bool reply = received.kind == net::Acceptor::Received::Kind::kReply;
      bytes = reply ? Bytes(received.bytes.begin(), received.bytes.end()) : Bytes();
    }
    if (!ends.dialler.IsOpen(dial)) return absl::InternalError("a player with a good credential did not come in");
    ends.dialler.Forget(dial);
  }
  report.Add(kScene, kEngine, "memory", "login_acceptor_us", server_s * 1e6 / rounds, "us");
  report.Add(kScene, kEngine, "memory", "login_dialler_us", dialler_s * 1e6 / rounds, "us");
  return absl::OkStatus();
}

// One datagram that nobody sealed for the server, made of bytes that somebody could see on the wire.
Bytes Forge(std::mt19937_64& random, const std::vector<Bytes>& seen) {
  const Bytes& genuine = seen[random() % seen.size()];
  switch (random() % 4) {
    case 0: {  // rubbish, with a first byte that is looked at
      Bytes bytes(1 + random() % 200);
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
      bytes[0] = static_cast<std::uint8_t>(0xd1 + random() % 6);
      return bytes;
    }
    case 1:  // as it was, the login too: the session is there already
      return genuine;
    case 2:
      return {genuine.begin(), genuine.begin() + static_cast<std::ptrdiff_t>(random() % genuine.size())};
    default: {  // damaged, or with a new number
      Bytes bytes = genuine;
      bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
      if (random() % 2 == 0) bytes[4] = static_cast<std::uint8_t>(bytes[4] + 1 + random() % 255);
      return bytes;
    }
  }
}

absl::Status ForgeInMemory(bool quick, Report& report) {
  Ends ends;
  std::vector<Bytes> seen = {ends.login};
  for (int i = 0; i < 64; ++i) {
    seen.push_back(ends.Sealed(static_cast<std::size_t>(i % 2 == 0 ? 40 : 400)));
    Bytes bytes = seen.back();
    if (!ends.AtServer(bytes)) return absl::InternalError("a genuine datagram was not taken");
  }
  const net::AcceptorStats before = ends.server.stats();
  std::mt19937_64 random(1);
  const std::uint64_t count = quick ? 300'000 : 10'000'000;
  const double begin = ThreadCpuSeconds();
  for (std::uint64_t i = 0; i < count; ++i) {
    Bytes bytes = Forge(random, seen);
    ends.AtServer(bytes);
  }
  const net::AcceptorStats& after = ends.server.stats();
  const std::uint64_t taken = after.payloads - before.payloads + after.accepted - before.accepted;
  report.Add(kScene, kEngine, "memory", "forged", static_cast<double>(count), "1");
  report.Add(kScene, kEngine, "memory", "forged_accepted", static_cast<double>(taken), "1");
  report.Add(kScene, kEngine, "memory", "forged_ns", (ThreadCpuSeconds() - begin) * 1e9 / static_cast<double>(count),
             "ns");
  return taken == 0 ? absl::OkStatus() : absl::InternalError(absl::StrCat(taken, " forged datagrams were accepted"));
}

// A port with a thread that serves it, as a worker's loop does.
class House {
 public:
  static absl::StatusOr<std::unique_ptr<House>> Start() {
    auto endpoint = net::Endpoint::Create({.bind_address = "127.0.0.1", .max_peers = 64});
    if (!endpoint.ok()) return endpoint.status();
    return std::unique_ptr<House>(new House(*std::move(endpoint)));
  }
  ~House() { Stop(); }
  void Stop() {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
  }
  std::uint16_t port() const { return port_; }
  const net::SigningKey& key() const { return key_; }
  std::uint64_t events() const { return events_; }
  const net::AcceptorStats& stats() const { return endpoint_->acceptor_stats(); }  // after Stop

 private:
  explicit House(std::unique_ptr<net::Endpoint> endpoint) : endpoint_(std::move(endpoint)), port_(endpoint_->port()) {
    endpoint_->Open(IdentityOf(key_));
    thread_ = std::thread([this] {
      while (!stopped_) events_ += endpoint_->Service(milliseconds(2)).size();
    });
  }

  net::SigningKey key_ = net::SigningKey::Make();
  std::unique_ptr<net::Endpoint> endpoint_;
  std::uint16_t port_;
  std::atomic<bool> stopped_ = false;
  std::atomic<std::uint64_t> events_ = 0;
  std::thread thread_;
};

class Flood {
 public:
  Flood(std::uint16_t port, bool hellos) : thread_([this, port, hellos] { Run(port, hellos); }) {}
  void Stop() {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
  }
  ~Flood() { Stop(); }
  double per_second() const { return static_cast<double>(flood_.datagrams()) / Seconds(span_); }
  double amplification() const {
    return static_cast<double>(flood_.bytes_received()) / static_cast<double>(flood_.bytes_sent());
  }

 private:
  void Run(std::uint16_t port, bool hellos) {
    const Clock::time_point begin = Clock::now();
    std::uint32_t sent = 0;
    while (!stopped_) {
      const auto due = static_cast<std::uint32_t>(Seconds(Clock::now() - begin) * kFloodPerSecond);
      for (; sent < due; ++sent) flood_.Send(port, hellos ? net::BlindHello(sent) : net::BlindConnect(sent));
      flood_.Drain();
      std::this_thread::sleep_for(milliseconds(1));
    }
    span_ = Clock::now() - begin;
    std::this_thread::sleep_for(milliseconds(50));  // answers that are still under way
    flood_.Drain();
  }

  net::SpoofedFlood flood_{kFloodAddresses};
  std::atomic<bool> stopped_ = false;
  Clock::duration span_{};
  std::thread thread_;
};

absl::StatusOr<double> JoinSeconds(const House& server, std::uint32_t player) {
  auto client = net::Endpoint::Create({.bind_address = "127.0.0.1", .max_peers = 2, .peer_timeout = kPatience});
  if (!client.ok()) return client.status();
  const Clock::time_point begin = Clock::now();
  const auto peer =
      (*client)->Connect("127.0.0.1", server.port(), RegionId(1), Incarnation(1), CredentialsOf(server.key(), player));
  if (!peer.ok()) return peer.status();
  while (Clock::now() - begin < kPatience) {
    for (const net::Event& event : (*client)->Service(milliseconds(5))) {
      if (event.kind == net::Event::Kind::kConnected) return Seconds(Clock::now() - begin);
    }
  }
  return absl::DeadlineExceededError("a client with a good credential could not join");
}

absl::Status MeasureJoins(const std::string& config, bool quick, Report& report) {
  auto server = House::Start();
  if (!server.ok()) return server.status();
  std::unique_ptr<Flood> flood;
  if (config != "quiet") flood = std::make_unique<Flood>((*server)->port(), config == "hellos");
  std::this_thread::sleep_for(milliseconds(200));  // the flood is at its height
  std::vector<double> joins;
  for (std::uint32_t i = 0; i < (quick ? 5u : 40u); ++i) {
    const absl::StatusOr<double> join = JoinSeconds(**server, i + 1);
    if (!join.ok()) return join.status();
    joins.push_back(*join * 1e3);
    std::this_thread::sleep_for(milliseconds(20));
  }
  std::sort(joins.begin(), joins.end());
  report.Add(kScene, kEngine, config, "join_under_flood_ms", joins.back(), "ms");  // the slowest of all
  report.Add(kScene, kEngine, config, "join_ms_p50", joins[joins.size() / 2], "ms");
  if (flood == nullptr) return absl::OkStatus();
  flood->Stop();
  (*server)->Stop();
  report.Add(kScene, kEngine, config, "flood_per_s", flood->per_second(), "1");
  report.Add(kScene, kEngine, config, "reply_amplification", flood->amplification(), "1");
  return absl::OkStatus();
}

absl::Status ForgeOverSockets(bool quick, Report& report) {
  auto server = House::Start();
  if (!server.ok()) return server.status();
  Ends elsewhere;  // genuine datagrams of another server
  std::vector<Bytes> seen = {elsewhere.login};
  for (int i = 0; i < 16; ++i) seen.push_back(elsewhere.Sealed(100));
  net::SpoofedFlood flood(kFloodAddresses);
  std::mt19937_64 random(2);
  const std::uint64_t count = quick ? 20'000 : 300'000;
  for (std::uint64_t i = 0; i < count; ++i) {
    flood.Send((*server)->port(), Forge(random, seen));
    if (i % 64 == 0) flood.Drain();
  }
  const absl::StatusOr<double> join = JoinSeconds(**server, 1);  // it still serves
  if (!join.ok()) return join.status();
  (*server)->Stop();
  const net::AcceptorStats& stats = (*server)->stats();
  const std::uint64_t taken = stats.accepted - 1;  // but the one that joined
  report.Add(kScene, kEngine, "sockets", "forged", static_cast<double>(flood.datagrams()), "1");
  report.Add(kScene, kEngine, "sockets", "forged_accepted", static_cast<double>(taken), "1");
  return taken == 0 ? absl::OkStatus() : absl::InternalError(absl::StrCat(taken, " forged datagrams were accepted"));
}

}  // namespace

absl::Status RunAcceptor(const SuiteOptions& options, Report& report) {
  if (absl::Status status = MeasureSealing(options.quick, report); !status.ok()) return status;
  if (absl::Status status = MeasureLogins(options.quick, report); !status.ok()) return status;
  for (const char* config : {"quiet", "connects", "hellos"}) {
    if (absl::Status status = MeasureJoins(config, options.quick, report); !status.ok()) return status;
  }
  if (absl::Status status = ForgeInMemory(options.quick, report); !status.ok()) return status;
  return ForgeOverSockets(options.quick, report);
}

}  // namespace tessera::bench
