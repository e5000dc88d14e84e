#include "region_worker/game_port.h"

#include <algorithm>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/replication/command.h"
#include "core/replication/datagram.h"
#include "core/replication/input.h"
#include "core/world/byte_view.h"
#include "core/world/viewer_number.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"

namespace tessera::worker {
namespace {

// Margins are clamped to this; a larger one means nothing more.
constexpr std::int64_t kMaxMargin_ticks = 1000;
constexpr char kJoinedAnew[] = " was joined by another process";

// The first copy of an input shows how early it came; later copies come later by themselves.
void NoteMargin(ConnectedClient& client, const PlayerInput& input, Tick tick) {
  client.newest_input = input.number;
  if (input.target == Tick()) return;
  client.input_margin_ticks = static_cast<std::int32_t>(
      std::clamp<std::int64_t>(input.target - (tick + 1), -kMaxMargin_ticks, kMaxMargin_ticks));
}

}  // namespace

GamePort::GamePort(std::unique_ptr<net::Endpoint> endpoint, WorkerMetrics& metrics)
    : endpoint_(std::move(endpoint)), metrics_(metrics) {}

void GamePort::Open(GameRules rules, Admit admit, EndedBecause ended_because) {
  endpoint_->Open(rules.self);
  rules_ = std::move(rules);
  admit_ = std::move(admit);
  ended_because_ = std::move(ended_because);
}

ReceivedFromClients GamePort::Service(TimePoint now, Tick tick, bool started) {
  serviced_at_ = now;
  ReceivedFromClients received;
  const std::vector<net::Event> events = endpoint_->Service(std::chrono::milliseconds(0));
  for (const net::Event& event : events) {
    switch (event.kind) {
      case net::Event::Kind::kConnected:
        pending_[event.peer] = {
            .player = event.who.player, .generation = event.who.generation, .until = now + kOrderTimeout};
        break;
      case net::Event::Kind::kDisconnected:
        pending_.erase(event.peer);
        if (const auto gone = clients_.find(event.peer); gone != clients_.end()) {
          if (const auto left_out = departures_.Take(Clock::now()); left_out && !quiet()) {
            spdlog::info("client gone player={} more={}", gone->second.player.value(), *left_out);
          }
          clients_.erase(gone);
        }
        break;
      case net::Event::Kind::kFloods:
        OnFlood(event.peer);
        break;
      case net::Event::Kind::kMessage:
        // Clients say nothing reliably.
        if (event.delivery == net::Delivery::kUnsequenced) OnDatagram(event, now, tick, received);
        break;
    }
  }
  AnswerPending(now, tick, started);
  DropSilent(now);
  CountClients();
  metrics_.game_acceptor.Take(endpoint_->acceptor_stats(), endpoint_->receive_stats());
  return received;
}

void GamePort::OnFlood(net::PeerHandle peer) {
  endpoint_->NoteRefused(peer, true);
  Refuse(peer, v1::REFUSAL_REASON_SESSION_ENDED,
         absl::StrCat("more than ", net::kPlayerLimits.datagrams.per_s, " datagrams or ",
                      net::kPlayerLimits.bytes.per_s / 1024, " KiB a second for ",
                      net::kPlayerLimits.patience.count() / 1000, " s"));
  clients_.erase(peer);
}

void GamePort::OnDatagram(const net::Event& event, TimePoint now, Tick tick, ReceivedFromClients& received) {
  const auto found = clients_.find(event.peer);
  if (found == clients_.end()) return;  // it overtook its hello, or its client was dropped
  ConnectedClient& client = found->second;
  if (replication::KindOf(event.bytes) == replication::DatagramKind::kCommands) {
    if (IsViewer(client.player)) return;
    return OnCommands(event, client, now, received);
  }
  if (replication::KindOf(event.bytes) == replication::DatagramKind::kSceneRequest) {
    return OnSceneRequest(event, client, now, received);
  }
  if (replication::KindOf(event.bytes) == replication::DatagramKind::kTileRequest) {
    absl::StatusOr<replication::TileRequest> request = replication::DecodeTileRequest(event.bytes);
    if (!request.ok()) return metrics_.inputs_refused.Increment();
    return received.tile_requests.push_back({event.peer, *std::move(request)});
  }
  if (replication::KindOf(event.bytes) != replication::DatagramKind::kInput) return;
  absl::StatusOr<replication::InputMessage> message = replication::DecodeInput(event.bytes);
  if (!message.ok()) {
    metrics_.inputs_refused.Increment();
    ReportRefused(event.peer, client, {}, message.status().message(), now);
    return;
  }
  client.unanswered_since.reset();
  if (!message->ack.empty()) received.acknowledgements.push_back({event.peer, std::move(message->ack)});
  if (IsViewer(client.player)) return;
  for (PlayerInput& input : message->inputs) {
    input.player = client.player;
    if (input.number > client.newest_input) NoteMargin(client, input, tick);
    received.inputs.push_back(input);
  }
}

// A client that waits for the scene answers no snapshots; its requests, which it repeats, count as its answers.
void GamePort::OnSceneRequest(const net::Event& event, ConnectedClient& client, TimePoint now,
                              ReceivedFromClients& received) {
  const absl::StatusOr<replication::SceneRequest> request = replication::DecodeSceneRequest(event.bytes);
  if (!request.ok()) return metrics_.inputs_refused.Increment();
  client.waits_for_scene = request->want != replication::SceneRequest::Want::kHave;
  client.unanswered_since = client.waits_for_scene ? std::optional(now) : std::nullopt;
  received.scene_requests.push_back({event.peer, *request});
}

// A command beyond the limit is not taken, nor is any after it; its client sends them again.
void GamePort::OnCommands(const net::Event& event, ConnectedClient& client, TimePoint now,
                          ReceivedFromClients& received) {
  const absl::StatusOr<replication::CommandMessage> message = replication::DecodeCommands(event.bytes);
  if (!message.ok()) {
    metrics_.commands_refused.Increment();
    return ReportRefused(event.peer, client, 0, message.status().message(), true, now);
  }
  if (message->last_event > 0) received.event_acknowledgements.push_back({client.player, message->last_event});
  std::uint32_t number = message->base;
  for (const replication::Command& command : message->commands) {
    if (number > client.newest_command) {
      if (!client.commands.Take(now, command.bytes.size())) {
        metrics_.commands_limited.Increment();
        return ReportRefused(event.peer, client, number, "more commands than a region takes in a second", false, now);
      }
      client.newest_command = number;
    }
    received.commands.push_back(
        {client.player, message->base, number, std::string(command.bytes), command.shown_at, command.with_input});
    ++number;
  }
}

void GamePort::AnswerPending(TimePoint now, Tick tick, bool started) {
  for (auto it = pending_.begin(); it != pending_.end();) {
    const auto [peer, pending] = *it++;
    if (Answer(peer, pending, now, tick, started)) pending_.erase(peer);
  }
}

bool GamePort::Answer(net::PeerHandle peer, const PendingClient& pending, TimePoint now, Tick tick, bool started) {
  if (closed_because_) {
    Refuse(peer, v1::REFUSAL_REASON_STOPPING, *closed_because_);
    return true;
  }
  if (IsViewer(pending.player)) {
    if (const std::string full = FullForViewer(pending.player); !full.empty()) {
      Refuse(peer, v1::REFUSAL_REASON_FULL, full);
    } else {
      Welcome(peer, pending, tick, started);
    }
    return true;
  }
  const std::uint32_t number = pending.player.value();
  switch (AdmissionOf(pending)) {
    case Admission::kNotYet:
      if (now < pending.until) return false;
      endpoint_->NoteRefused(peer, false);
      Refuse(peer, v1::REFUSAL_REASON_UNKNOWN_PLAYER,
             absl::StrCat("player ", number, " is not known to this instance"));
      return true;
    case Admission::kLeft:
      endpoint_->NoteRefused(peer, false);
      if (const std::string why = ended_because_ ? ended_because_(pending.player) : ""; !why.empty()) {
        Refuse(peer, v1::REFUSAL_REASON_SESSION_ENDED, why);
        return true;
      }
      Refuse(peer, v1::REFUSAL_REASON_UNKNOWN_PLAYER, absl::StrCat("player ", number, " has left"));
      return true;
    case Admission::kReplaced:
      endpoint_->NoteRefused(peer, false);
      Refuse(peer, v1::REFUSAL_REASON_REPLACED, absl::StrCat("player ", number, kJoinedAnew));
      return true;
    case Admission::kWelcome:
      Welcome(peer, pending, tick, started);
      return true;
  }
  return true;
}

std::string GamePort::FullForViewer(PlayerNumber viewer) const {
  std::size_t viewers = 0, strangers = 0;
  for (const auto& [peer, client] : clients_) {
    if (!IsViewer(client.player) || client.player == viewer) continue;
    ++viewers;
    if (IsStrangersViewer(client.player)) ++strangers;
  }
  if (viewers >= kMaxViewers) return absl::StrCat(viewers, " viewers watch this region already");
  if (!IsStrangersViewer(viewer) || strangers < kMaxStrangersViewers) return "";
  return absl::StrCat(strangers, " viewers from the players' door watch this region already");
}

// A newer process may be here already, before any order has named its generation.
Admission GamePort::AdmissionOf(const PendingClient& pending) const {
  const bool newer_here = std::ranges::any_of(clients_, [&](const auto& client) {
    return client.second.player == pending.player && client.second.generation > pending.generation;
  });
  return newer_here ? Admission::kReplaced : admit_(pending.player, pending.generation);
}

void GamePort::Welcome(net::PeerHandle peer, const PendingClient& pending, Tick tick, bool started) {
  const PlayerNumber player = pending.player;
  Replace(player, pending.generation);
  Expel(player);  // an older connection of the same process
  clients_.emplace(peer, ConnectedClient{.player = player, .generation = pending.generation});
  v1::RegionControl message;
  v1::RegionWelcome& welcome = *message.mutable_welcome();
  welcome.set_region(rules_->self.region.value());
  welcome.set_incarnation(rules_->self.incarnation.value());
  welcome.set_player(player.value());
  welcome.set_tick(tick.value());
  welcome.set_tick_rate_hz(rules_->tick_rate_hz);
  welcome.set_snapshot_rate_hz(rules_->snapshot_rate_hz);
  welcome.set_started(started);
  *welcome.mutable_map() = rules_->map.map();
  *welcome.mutable_endpoints() = rules_->map.endpoints();
  if (clock_) *welcome.mutable_clock() = *clock_;
  Send(peer, message);
  if (const auto left_out = welcomes_.Take(Clock::now()); left_out && !quiet()) {
    spdlog::info("client welcome player={} from={} more={}", player.value(), endpoint_->AddressOf(peer), *left_out);
  }
}

void GamePort::Refuse(net::PeerHandle peer, v1::RefusalReason reason, std::string_view detail) {
  if (const auto left_out = refusals_[reason].Take(Clock::now()); left_out && !quiet()) {
    spdlog::warn("client refused from={} reason={} detail={} more={}", endpoint_->AddressOf(peer),
                 v1::RefusalReason_Name(reason), telemetry::LogValue(detail), *left_out);
  }
  v1::RegionControl message;
  message.mutable_refusal()->set_reason(reason);
  message.mutable_refusal()->set_detail(std::string(detail));
  Send(peer, message);
  endpoint_->Disconnect(peer);
  pending_.erase(peer);
}

void GamePort::DropSilent(TimePoint now) {
  for (auto it = clients_.begin(); it != clients_.end();) {
    const ConnectedClient& client = it->second;
    if (!client.unanswered_since || now < *client.unanswered_since + kSilence) {
      ++it;
      continue;
    }
    if (!quiet()) spdlog::warn("client dropped player={} reason=silent", client.player.value());
    endpoint_->Disconnect(it->first);
    it = clients_.erase(it);
  }
}

std::vector<PlayerNumber> GamePort::players() const {
  std::vector<PlayerNumber> players;
  for (const auto& [peer, client] : clients_) {
    if (!IsViewer(client.player)) players.push_back(client.player);
  }
  std::sort(players.begin(), players.end());
  return players;
}

std::uint64_t GamePort::SendDatagrams(net::PeerHandle peer, std::span<const net::Bytes> datagrams) {
  const auto found = clients_.find(peer);
  if (found == clients_.end() || datagrams.empty()) return 0;
  if (!found->second.unanswered_since) found->second.unanswered_since = serviced_at_;
  std::uint64_t bytes = 0;
  for (const net::Bytes& datagram : datagrams) {
    if (endpoint_->Send(peer, net::Delivery::kUnsequenced, datagram).ok()) bytes += datagram.size();
  }
  return bytes;
}

void GamePort::SendToAll(std::span<const std::uint8_t> datagram) {
  for (const auto& [peer, client] : clients_) (void)endpoint_->Send(peer, net::Delivery::kUnsequenced, datagram);
}

void GamePort::Send(net::PeerHandle peer, const v1::RegionControl& message) {
  (void)endpoint_->Send(peer, net::Delivery::kReliable, AsBytes(message.SerializeAsString()));
}

void GamePort::SendScene(net::PeerHandle peer, std::span<const std::uint8_t> message) {
  (void)endpoint_->Send(peer, net::Delivery::kReliable, message);
}

void GamePort::SetMap(const v1::RegionMap& map) {
  const std::string before = rules_->map.SerializeAsString();
  rules_->map = map;
  if (rules_->map.SerializeAsString() == before) return;
  v1::RegionControl message;
  *message.mutable_map() = map;
  for (const auto& [peer, client] : clients_) Send(peer, message);
}

void GamePort::SendStarted(Tick tick) {
  v1::RegionControl message;
  message.mutable_started()->set_tick(tick.value());
  for (const auto& [peer, client] : clients_) Send(peer, message);
  endpoint_->Flush();
}

void GamePort::SetClock(const v1::WorldClock& clock) {
  clock_ = clock;
  v1::RegionControl message;
  *message.mutable_clock() = clock;
  for (const auto& [peer, client] : clients_) Send(peer, message);
  endpoint_->Flush();
}

void GamePort::ReportRefused(const PlayerInput& input, absl::string_view why, TimePoint now) {
  for (auto& [peer, client] : clients_) {
    if (client.player == input.player) return ReportRefused(peer, client, input, why, now);
  }
}

void GamePort::ReportRefused(net::PeerHandle peer, ConnectedClient& client, const PlayerInput& input,
                             absl::string_view why, TimePoint now) {
  if (now < client.may_refuse_at) return;
  client.may_refuse_at = now + kRefusalDistance;
  v1::RegionControl message;
  v1::InputRefused& refused = *message.mutable_input_refused();
  refused.set_body(input.body.value());
  refused.set_input_number(input.number);
  refused.set_detail(std::string(why));
  Send(peer, message);
}

void GamePort::Expel(PlayerNumber player, const std::string& ended_because) {
  for (auto it = clients_.begin(); it != clients_.end();) {
    if (it->second.player != player) {
      ++it;
      continue;
    }
    if (!ended_because.empty()) {
      v1::RegionControl message;
      message.mutable_session_ended()->set_reason(ended_because);
      Send(it->first, message);
    }
    endpoint_->Disconnect(it->first);
    it = clients_.erase(it);
  }
}

void GamePort::Replace(PlayerNumber player, net::Generation generation) {
  for (auto it = clients_.begin(); it != clients_.end();) {
    const net::PeerHandle peer = it->first;
    const ConnectedClient& client = (it++)->second;
    if (client.player != player || client.generation >= generation) continue;
    Refuse(peer, v1::REFUSAL_REASON_REPLACED, absl::StrCat("player ", player.value(), kJoinedAnew));
    clients_.erase(peer);
  }
}

void GamePort::ReportRefused(PlayerNumber player, std::uint32_t command, absl::string_view why, bool for_good,
                             TimePoint now) {
  for (auto& [peer, client] : clients_) {
    if (client.player == player) return ReportRefused(peer, client, command, why, for_good, now);
  }
}

void GamePort::ReportRefused(net::PeerHandle peer, ConnectedClient& client, std::uint32_t command,
                             absl::string_view why, bool for_good, TimePoint now) {
  if (now < client.may_refuse_command_at) return;
  client.may_refuse_command_at = now + kRefusalDistance;
  v1::RegionControl message;
  v1::CommandRefused& refused = *message.mutable_command_refused();
  refused.set_number(command);
  refused.set_detail(std::string(why));
  refused.set_for_good(for_good);
  Send(peer, message);
}

void GamePort::Close(const std::string& reason, bool goes_on) {
  closed_because_ = reason;
  endpoint_->Close(reason);
  v1::RegionControl stopping;
  stopping.mutable_stopping()->set_reason(reason);
  stopping.mutable_stopping()->set_goes_on(goes_on);
  for (const auto& [peer, client] : clients_) {
    Send(peer, stopping);
    endpoint_->Disconnect(peer);
  }
  for (auto it = pending_.begin(); it != pending_.end();) {
    const net::PeerHandle peer = (it++)->first;
    Refuse(peer, v1::REFUSAL_REASON_STOPPING, reason);
  }
  clients_.clear();
  CountClients();
  endpoint_->Flush();
}

void GamePort::CountClients() { metrics_.clients.Set(static_cast<double>(clients_.size())); }

}  // namespace tessera::worker
