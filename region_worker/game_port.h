// GamePort: the connections of a region's clients: who may enter, their inputs in, datagrams and messages out.
//
// A peer has shown its credential to the endpoint's acceptor and is welcomed at once. A player that the orders have not
// named yet waits for kOrderTimeout, because it may be faster than the order; then it is refused. A player that
// connects again replaces its older connection; of two processes that play one player, the one of the lower generation
// is refused with REPLACED. Who is refused so, has left, or is not known, and comes back all the same is soon not
// looked at for a while; a client that floods is ended with the reason (net/limits.h). A client that leaves datagrams
// unanswered for kSilence is dropped. A viewer (core/world/viewer_number.h) needs no order, may only look, and is no
// player.
//
//   GamePort port(*std::move(endpoint), metrics);
//   port.Open(rules, [&](PlayerNumber player, net::Generation generation) { return Admission::kWelcome; });
//   loop: for (const PlayerInput& input : port.Service(now, tick, started).inputs) ...
//         for (const auto& [peer, client] : port.clients()) port.SendDatagrams(peer, bytes);
//         port.Flush();
//
// Nothing that a client sends is trusted. Thread rule: one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/string_view.h"
#include "core/replication/scene_transfer.h"
#include "core/world/ids.h"
#include "core/world/player_input.h"
#include "net/credential.h"
#include "net/endpoint.h"
#include "region_worker/command_limit.h"
#include "region_worker/core/admission.h"
#include "region_worker/core/time.h"
#include "region_worker/worker_metrics.h"
#include "telemetry/log_throttle.h"
#include "tessera/v1/game.pb.h"

namespace tessera::worker {

struct GameRules {
  net::EndpointIdentity self;
  std::uint32_t tick_rate_hz = 0, snapshot_rate_hz = 0;
  v1::RegionMap map;
  bool quiet = false;  // no line about who comes and goes: the process is a game's
};

// A client that was welcomed.
struct ConnectedClient {
  PlayerNumber player;
  net::Generation generation{};
  std::optional<TimePoint> unanswered_since{};  // when the first datagram left after its last answer
  std::uint32_t newest_input = 0;               // number of the newest input that came
  std::int32_t input_margin_ticks = 0;          // how many ticks before its target that input came
  TimePoint may_refuse_at{};                    // earliest time of the next InputRefused
  std::uint32_t newest_command = 0;             // number of the newest one that was within the limit
  CommandLimit commands{};
  TimePoint may_refuse_command_at{};  // earliest time of the next CommandRefused
  bool waits_for_scene = false;       // until it has the scene it takes no snapshots
};

// Everything that came in one call of GamePort::Service.
struct ReceivedFromClients {
  struct Acknowledgement {
    net::PeerHandle from;
    net::Bytes bytes;  // for SnapshotSender::Acknowledge
  };
  struct Command {
    PlayerNumber player;
    std::uint32_t base = 0, number = 0;
    std::string bytes;
    std::uint64_t shown_at = 0;
    std::uint32_t with_input = 0;
  };
  struct EventAcknowledgement {
    PlayerNumber player;
    std::uint32_t last_event = 0;
  };
  struct SceneAsked {
    net::PeerHandle from;
    replication::SceneRequest request;
  };
  struct TilesAsked {
    net::PeerHandle from;
    replication::TileRequest request;
  };
  std::vector<PlayerInput> inputs;  // as the clients sent them, copies included
  std::vector<Acknowledgement> acknowledgements;
  std::vector<Command> commands;  // within the limits, copies included, in order
  std::vector<EventAcknowledgement> event_acknowledgements;
  std::vector<SceneAsked> scene_requests;
  std::vector<TilesAsked> tile_requests;
};

class GamePort {
 public:
  using Admit = std::function<Admission(PlayerNumber, net::Generation)>;
  // Why the game ended the session of a player that has left; empty where it did not.
  using EndedBecause = std::function<std::string(PlayerNumber)>;

  static constexpr Duration kOrderTimeout = std::chrono::seconds(3);
  static constexpr Duration kSilence = std::chrono::seconds(10);
  static constexpr Duration kRefusalDistance = std::chrono::milliseconds(100);

  GamePort(std::unique_ptr<net::Endpoint> endpoint, WorkerMetrics& metrics);

  std::uint16_t port() const { return endpoint_->port(); }
  int socket() const { return endpoint_->socket(); }
  bool flooded() const { return endpoint_->flooded(); }

  // From now on clients may come in. Once.
  void Open(GameRules rules, Admit admit, EndedBecause ended_because = nullptr);
  // Takes in what has come, without waiting; `tick` and `started` go into welcomes.
  ReceivedFromClients Service(TimePoint now, Tick tick, bool started);

  const std::map<net::PeerHandle, ConnectedClient>& clients() const { return clients_; }
  std::vector<PlayerNumber> players() const;  // ascending, without viewers

  // Both queue for a client that is still connected. Datagrams may be lost and have to be answered, from the last
  // Service on; the result is the number of bytes queued.
  std::uint64_t SendDatagrams(net::PeerHandle peer, std::span<const net::Bytes> datagrams);
  void Send(net::PeerHandle peer, const v1::RegionControl& message);
  // A reliable message of core/replication/scene_transfer.h.
  void SendScene(net::PeerHandle peer, std::span<const std::uint8_t> message);
  // A datagram to all clients that none of them has to answer, and that may be lost.
  void SendToAll(std::span<const std::uint8_t> datagram);
  // Sends what is queued; Service does so too.
  void Flush() { endpoint_->Flush(); }
  void SendStarted(Tick tick);
  // The world pauses, goes on or goes at another pace: sent to all, and with welcomes from now on.
  void SetClock(const v1::WorldClock& clock);
  // The map in force and the endpoints; sent to all if it is new.
  void SetMap(const v1::RegionMap& map);
  // Reports to its player that the region refused an input; no more often than each kRefusalDistance.
  void ReportRefused(const PlayerInput& input, absl::string_view why, TimePoint now);
  // The same of a command that the region did not take, `for_good` or not now.
  void ReportRefused(PlayerNumber player, std::uint32_t command, absl::string_view why, bool for_good, TimePoint now);
  // The player has left: its connection is closed. `ended_because`: the game's reason; empty if it left by itself.
  void Expel(PlayerNumber player, const std::string& ended_because = "");
  // Another process has joined as the player, of this generation: those of a lower one are told so, and their
  // connections are closed.
  void Replace(PlayerNumber player, net::Generation generation);
  // Announces that the region ends, and ends all connections in order.
  // `goes_on`: the world need not end with this worker, so clients look for it elsewhere.
  void Close(const std::string& reason, bool goes_on = false);
  // True while farewells are under way; Service carries them on.
  bool draining() const { return endpoint_->connections() > 0; }

 private:
  // A peer that is connected and not yet welcomed.
  struct PendingClient {
    PlayerNumber player;
    net::Generation generation;
    TimePoint until{};
  };

  bool quiet() const { return rules_ && rules_->quiet; }
  // It is told why, and its credential opens nothing for a while.
  void OnFlood(net::PeerHandle peer);
  void OnDatagram(const net::Event& event, TimePoint now, Tick tick, ReceivedFromClients& received);
  void OnCommands(const net::Event& event, ConnectedClient& client, TimePoint now, ReceivedFromClients& received);
  void OnSceneRequest(const net::Event& event, ConnectedClient& client, TimePoint now, ReceivedFromClients& received);
  void ReportRefused(net::PeerHandle peer, ConnectedClient& client, std::uint32_t command, absl::string_view why,
                     bool for_good, TimePoint now);
  // False: the peer has to wait.
  // Why there is no place for this viewer; empty: there is one.
  std::string FullForViewer(PlayerNumber viewer) const;
  bool Answer(net::PeerHandle peer, const PendingClient& pending, TimePoint now, Tick tick, bool started);
  Admission AdmissionOf(const PendingClient& pending) const;
  void AnswerPending(TimePoint now, Tick tick, bool started);
  void DropSilent(TimePoint now);
  void Welcome(net::PeerHandle peer, const PendingClient& pending, Tick tick, bool started);
  void Refuse(net::PeerHandle peer, v1::RefusalReason reason, std::string_view detail);
  void ReportRefused(net::PeerHandle peer, ConnectedClient& client, const PlayerInput& input, absl::string_view why,
                     TimePoint now);
  void CountClients();

  std::unique_ptr<net::Endpoint> endpoint_;
  WorkerMetrics& metrics_;
  std::optional<GameRules> rules_;
  std::optional<v1::WorldClock> clock_;  // if it ever changed
  std::optional<std::string> closed_because_;
  Admit admit_;
  EndedBecause ended_because_;
  std::map<net::PeerHandle, PendingClient> pending_;
  std::map<net::PeerHandle, ConnectedClient> clients_;
  TimePoint serviced_at_{};  // by the caller's clock, which may be none of this machine's
  // Lines for which a client gives cause as often as it likes.
  telemetry::LogThrottle welcomes_, departures_;
  std::map<v1::RefusalReason, telemetry::LogThrottle> refusals_;
};

}  // namespace tessera::worker
