#include "bench/snapshots_scale.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <random>

#include "absl/strings/str_cat.h"
#include "bench/acknowledger.h"
#include "bench/thread_cpu.h"
#include "core/replication/input.h"
#include "core/replication/interest.h"
#include "core/replication/quantize.h"
#include "core/replication/snapshot.h"
#include "core/replication/testing/moving_bodies.h"
#include "net/endpoint.h"
#include "net/testing/test_identity.h"

namespace tessera::bench {
namespace {

using namespace replication;
using std::chrono::milliseconds;

constexpr double kSnapshotRate_hz = 30, kWorld_m = 300, kRadius_m = 38, kWalk_m_s = 3, kLoss = 0.02;
constexpr std::size_t kBodies = 20'000;  // so many within the radius: kBodies / kWorld_m^2 * pi kRadius_m^2 = 1008
constexpr std::uint64_t kTicks = 2;      // a snapshot
// All take turns on one core, so seconds may pass between two words of a client.
constexpr milliseconds kPatience{60'000};
constexpr char kInstance[] = "scale-1";

SnapshotSettings ScaleSettings() {
  SnapshotSettings settings;
  settings.interest_radius_m = kRadius_m;
  return settings;
}

// Bodies that are kicked now and then, fly, roll and come to rest: about a tenth of them moves.
class Field {
 public:
  Field()
      : bodies_({.count = kBodies,
                 .seed = 7,
                 .world_m = kWorld_m,
                 .kicks_per_s = 0.02,
                 .ground_drag_per_s = 0.4,
                 .rest_speed_m_s = 0.8}) {
    for (int n = 0; n < 600; ++n) Step();
  }
  void Step() {
    changed_.clear();
    const std::vector<BodyRecord>& all = bodies_.bodies();
    for (const BodyRecord& body : all) was_asleep_[body.id.value() - 1] = body.state.asleep;
    for (std::uint64_t i = 0; i < kTicks; ++i) bodies_.Step(1.0 / (kSnapshotRate_hz * kTicks));
    for (const BodyRecord& body : all) {
      if (!body.state.asleep || !was_asleep_[body.id.value() - 1]) changed_.push_back(body);
    }
  }
  const std::vector<BodyRecord>& all() { return bodies_.bodies(); }
  const std::vector<BodyRecord>& changed() const { return changed_; }
  Aabb bounds() const { return bodies_.bounds(); }

 private:
  MovingBodies bodies_;
  std::vector<bool> was_asleep_ = std::vector<bool>(kBodies);
  std::vector<BodyRecord> changed_;
};

// The far side: a socket, what it got, and its answers, late.
class FarClient {
 public:
  FarClient(std::uint32_t number, const net::SigningKey& key, std::uint16_t port, const Aabb& bounds)
      : random_(number), delay_(1 + number % 4) {
    auto endpoint = net::Endpoint::Create({.bind_address = "127.0.0.1", .max_peers = 1, .peer_timeout = kPatience});
    if (!endpoint.ok()) throw std::runtime_error(std::string(endpoint.status().message()));
    endpoint_ = *std::move(endpoint);
    const net::Credentials pass = net::IssuePlayer(kInstance, PlayerNumber(number), net::Generation(1), key);
    peer_ = *endpoint_->Connect("127.0.0.1", port, RegionId(1), Incarnation(1), pass);
    if (number % 20 == 0) receiver_.emplace(bounds, ScaleSettings());
    place_ = {Uniform(-120, 120), 1, Uniform(-120, 120)};
    heading_ = Uniform(0, 6.28);
  }

  void Service() {
    for (const net::Event& event : endpoint_->Service(milliseconds(0))) {
      if (event.kind == net::Event::Kind::kConnected) connected = true;
      if (event.kind == net::Event::Kind::kMessage && Uniform(0, 1) >= kLoss) Take(event.bytes);
    }
  }
  void Answer() {
    answers_.push_back(Ack());
    if (answers_.size() <= delay_) return;
    const Bytes ack = std::exchange(answers_.front(), {});
    answers_.pop_front();
    if (ack.empty() || Uniform(0, 1) < kLoss) return;
    (void)endpoint_->Send(peer_, net::Delivery::kUnsequenced, EncodeInput({.ack = ack, .inputs = {}}));
    endpoint_->Flush();
  }
  Vec3d Walk() {
    if (std::abs(place_.x) > 110 || std::abs(place_.z) > 110) heading_ = std::atan2(-place_.z, -place_.x);
    place_ += Vec3d(std::cos(heading_), 0, std::sin(heading_)) * (kWalk_m_s / kSnapshotRate_hz);
    return place_;
  }

  bool connected = false;
  std::size_t datagrams = 0, refused = 0;

 private:
  double Uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  void Take(const Bytes& bytes) {
    ++datagrams;
    if (receiver_) {
      const auto got = receiver_->Read(bytes);
      if (!got.ok()) ++refused;
      return;
    }
    acknowledger_.Take(bytes);
  }
  Bytes Ack() const { return receiver_ ? receiver_->WriteAck() : acknowledger_.Answer(); }

  std::mt19937 random_;
  std::size_t delay_;  // snapshots
  std::unique_ptr<net::Endpoint> endpoint_;
  net::PeerHandle peer_;
  std::optional<SnapshotReceiver> receiver_;
  Acknowledger acknowledger_;
  std::deque<Bytes> answers_;
  Vec3d place_;
  double heading_ = 0;
};

struct Parts {
  double push_s = 0, write_s = 0, send_s = 0, receive_s = 0;
  std::size_t datagrams = 0, bytes = 0, records = 0, deferred = 0;
  double total_s() const { return push_s + write_s + send_s + receive_s; }
};

class Scale {
 public:
  explicit Scale(std::size_t clients) : history_(field_.bounds(), ScaleSettings()) {
    auto endpoint =
        net::Endpoint::Create({.bind_address = "127.0.0.1", .max_peers = clients + 8, .peer_timeout = kPatience});
    if (!endpoint.ok()) throw std::runtime_error(std::string(endpoint.status().message()));
    endpoint_ = *std::move(endpoint);
    const net::SigningKey key = net::SigningKey::Make();
    endpoint_->Open(net::TestWorker(key, kInstance, RegionId(1), Incarnation(1)));
    for (std::uint32_t n = 1; n <= clients; ++n) {
      far_.push_back(std::make_unique<FarClient>(n, key, endpoint_->port(), field_.bounds()));
      while (!far_.back()->connected || near_.size() < n) {
        Receive();
        far_.back()->Service();
      }
      if (n % 50 == 0) {
        for (const auto& far : far_) far->Service();
      }
    }
    history_.Push(Tick(tick_ += kTicks), field_.all(), {});
  }

  // One snapshot of all clients.
  void Round(Parts& parts) {
    field_.Step();
    std::vector<std::optional<Vec3d>> places;
    places.reserve(near_.size());
    for (const Near& client : near_) places.push_back(far_[client.number]->Walk());
    const double begin = ThreadCpuSeconds();
    history_.Push(Tick(tick_ += kTicks), field_.changed(), {});
    double mark = ThreadCpuSeconds();
    parts.push_s += mark - begin;
    const std::vector<std::uint32_t> order = NeighboursInARow(places, kRadius_m);
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (i + 1 < order.size()) near_[order[i + 1]].sender.Prefetch();
      const std::uint32_t at = order[i];
      Near& client = near_[at];
      const WrittenSnapshot written = client.sender.Write(history_, {.centre = places[at]}, 0, 0);
      const double wrote = ThreadCpuSeconds();
      parts.write_s += wrote - mark;
      for (const Bytes& bytes : written.datagrams) {
        if (endpoint_->Send(client.peer, net::Delivery::kUnsequenced, bytes).ok()) parts.bytes += bytes.size();
      }
      mark = ThreadCpuSeconds();
      parts.send_s += mark - wrote;
      parts.datagrams += written.datagrams.size();
      parts.records += written.bodies;
      parts.deferred += written.deferred;
    }
    endpoint_->Flush();
    parts.send_s += ThreadCpuSeconds() - mark;
    for (const auto& far : far_) {
      far->Service();
      far->Answer();
    }
    const double before = ThreadCpuSeconds();
    Receive();
    parts.receive_s += ThreadCpuSeconds() - before;
  }

  double moving_share() {
    const auto& all = field_.all();
    return static_cast<double>(std::count_if(all.begin(), all.end(), [](const auto& b) { return !b.state.asleep; })) /
           static_cast<double>(all.size());
  }
  std::size_t refused() const {
    std::size_t sum = 0;
    for (const auto& far : far_) sum += far->refused;
    return sum;
  }
  std::size_t received() const {
    std::size_t sum = 0;
    for (const auto& far : far_) sum += far->datagrams;
    return sum;
  }

 private:
  struct Near {
    net::PeerHandle peer;
    std::size_t number;
    SnapshotSender sender;
  };

  void Receive() {
    for (const net::Event& event : endpoint_->Service(milliseconds(0))) {
      if (event.kind == net::Event::Kind::kConnected) {
        number_of_.emplace(event.peer, near_.size());
        near_.push_back({event.peer, event.who.player.value() - 1, SnapshotSender(ScaleSettings())});
      } else if (event.kind == net::Event::Kind::kMessage) {
        const auto input = DecodeInput(event.bytes);
        const auto client = number_of_.find(event.peer);
        if (!input.ok() || client == number_of_.end()) continue;
        if (const absl::Status status = near_[client->second].sender.Acknowledge(input->ack); !status.ok()) {
          throw std::runtime_error(status.ToString());
        }
      }
    }
  }

  Field field_;
  SnapshotHistory history_;
  std::unique_ptr<net::Endpoint> endpoint_;
  std::vector<std::unique_ptr<FarClient>> far_;
  std::vector<Near> near_;
  std::map<net::PeerHandle, std::size_t> number_of_;
  std::uint64_t tick_ = 0;
};

}  // namespace

absl::Status RunScale(const SuiteOptions& options, Report& report) {
  const std::size_t clients = options.quick ? 100 : 1000;
  const int rounds = options.quick ? 30 : 60;
  Scale scale(clients);
  Parts joining, parts;
  for (int n = 0; n < 45; ++n) scale.Round(joining);
  const std::size_t received = scale.received();
  for (int n = 0; n < rounds; ++n) scale.Round(parts);
  const auto add = [&](const char* metric, double value, const char* unit) {
    report.Add("scale", "tessera", absl::StrCat(clients, " clients"), metric, value, unit);
  };
  if (scale.refused() > 0) return absl::InternalError(absl::StrCat("scale: ", scale.refused(), " datagrams refused"));
  const double snapshots = static_cast<double>(clients) * rounds;
  add("clients_per_core", snapshots / kSnapshotRate_hz / parts.total_s(), "1");
  add("moving_share", scale.moving_share(), "1");
  add("records_a_snapshot", static_cast<double>(parts.records) / snapshots, "1");
  add("bytes_a_snapshot", static_cast<double>(parts.bytes) / snapshots, "bytes");
  add("datagrams_received_share",
      static_cast<double>(scale.received() - received) / static_cast<double>(parts.datagrams), "1");
  add("push_us", parts.push_s / snapshots * 1e6, "us");
  add("write_us", parts.write_s / snapshots * 1e6, "us");
  add("send_us", parts.send_s / snapshots * 1e6, "us");
  add("receive_us", parts.receive_s / snapshots * 1e6, "us");
  return absl::OkStatus();
}

}  // namespace tessera::bench
