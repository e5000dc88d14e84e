// GamePort: the connections of clients: who may enter, what they are told, what they send.
//
// Whoever connects has shown its connect token to the endpoint's acceptor and is welcomed at once. A player that the
// orders have not named yet is kept waiting for kOrderTimeout, because its token may be faster than the order, then
// refused. A player that comes again takes the place of its older connection. One that stays has its token renewed. One
// that leaves snapshots unanswered for kSilence is dropped.
//
//   GamePort port(*std::move(endpoint), metrics);
//   port.Open(rules, [&](PlayerNumber player) { return Admission::kWelcome; });
//   loop: for (PlayerInput& input : port.Service(now, tick)) ...
//
// Nothing that a client sends is trusted. Thread rule: one thread.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "core/physics/world.h"
#include "core/region/region.h"
#include "core/replication/input.h"
#include "core/replication/snapshot.h"
#include "net/connect_token.h"
#include "net/endpoint.h"
#include "region_worker/core/admission.h"
#include "region_worker/core/identity.h"
#include "region_worker/core/time.h"
#include "region_worker/worker_metrics.h"
#include "tessera/v1/game.pb.h"

namespace tessera::worker {

struct GameRules {
  Identity self;
  net::InstanceKey key{};
  std::uint32_t tick_rate_hz = 0, snapshot_rate_hz = 0;
  v1::RegionMap map;
  replication::Settings replication;
};

// One that was welcomed.
struct Client {
  PlayerNumber player;
  replication::SnapshotSender sender;
  std::optional<TimePoint> unanswered_since{};  // the first datagram to it since its last
  std::uint32_t newest_input = 0;               // number of the newest input that came
  std::int32_t input_margin_ticks = 0;          // how many ticks before its target that input came
  TimePoint may_refuse_at{};                    // InputRefused are this rare
  TimePoint renew_at{};                         // its token
  bool knows_pairs = false;                     // that had begun before it came
};

class GamePort {
 public:
  using Admit = std::function<Admission(PlayerNumber)>;

  static constexpr Duration kOrderTimeout = std::chrono::seconds(3);
  static constexpr Duration kSilence = std::chrono::seconds(10);
  static constexpr Duration kRefusalDistance = std::chrono::milliseconds(100);
  // A token is renewed long before it expires, so that a client can come back at any time.
  static constexpr Duration kRenewInterval = std::chrono::hours(1);
  static constexpr std::chrono::seconds kTokenLifetime{24 * 3600};

  GamePort(std::unique_ptr<net::Endpoint> endpoint, WorkerMetrics& metrics);

  std::uint16_t port() const { return endpoint_->port(); }
  int socket() const { return endpoint_->socket(); }

  // From now on clients may come in. Once.
  void Open(GameRules rules, Admit admit);
  // Takes in what has come, without waiting; `tick` and `started` go into welcomes. True in `any` if anything had come.
  // The inputs are as the clients sent them, copies included.
  std::vector<PlayerInput> Service(TimePoint now, Tick tick, bool started, bool* any);

  const std::map<net::PeerHandle, Client>& clients() const { return clients_; }
  Client* Find(net::PeerHandle peer);
  std::vector<PlayerNumber> players() const;  // ascending
  bool Has(PlayerNumber player) const;

  // Calls `view` for each client, then `write`, neighbours in a row, and sends what it gives; the bytes sent.
  std::uint64_t Broadcast(TimePoint now, const std::function<replication::ClientView(const Client&)>& view,
                          const std::function<std::vector<net::Bytes>(Client&, const replication::ClientView&)>& write);
  void TellStarted(Tick tick);
  // What began and ended in the region's last step, of players' bodies and triggers, to all that are near enough; to
  // those that are new, all that touches.
  void TellPairs(const region::Region& region, std::span<const physics::PairEvent> events);
  // The map in force and the endpoints; sent to all if it is new.
  void SetMap(const v1::RegionMap& map);
  // Reports to its player that the region refused an input; no more often than each kRefusalDistance.
  void ReportRefused(const PlayerInput& input, absl::string_view why, TimePoint now);
  // The player has left: its connection is closed.
  void Expel(PlayerNumber player);
  // Tells all that the region ends, and ends their connections in order.
  void Close(const std::string& reason);
  // True while farewells are under way; Service carries them on.
  bool draining() const { return endpoint_->connections() > 0; }

 private:
  // Connected, not yet welcomed.
  struct PendingClient {
    PlayerNumber player;
    TimePoint until{};
  };

  void OnDatagram(const net::Event& event, TimePoint now, Tick tick, std::vector<PlayerInput>& inputs);
  // False: it has to wait.
  bool Answer(net::PeerHandle peer, const PendingClient& pending, TimePoint now, Tick tick, bool started);
  void AnswerPending(TimePoint now, Tick tick, bool started);
  void DropSilent(TimePoint now);
  void RenewTokens(TimePoint now);
  void Welcome(net::PeerHandle peer, PlayerNumber player, Tick tick, bool started);
  void Refuse(net::PeerHandle peer, v1::RefusalReason reason, std::string_view detail);
  void ReportRefused(net::PeerHandle peer, Client& client, const PlayerInput& input, absl::string_view why,
                     TimePoint now);
  void Tell(net::PeerHandle peer, const v1::RegionControl& message);
  void CountClients();

  std::unique_ptr<net::Endpoint> endpoint_;
  WorkerMetrics& metrics_;
  std::optional<GameRules> rules_;
  std::optional<std::string> closed_because_;
  Admit admit_;
  std::map<net::PeerHandle, PendingClient> pending_;
  std::map<net::PeerHandle, Client> clients_;
};

}  // namespace tessera::worker
