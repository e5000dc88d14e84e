#include "region_worker/game_port.h"

#include <algorithm>
#include <ctime>

#include "absl/strings/str_cat.h"
#include "core/replication/datagram.h"
#include "net/protocol.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"

namespace tessera::worker {
namespace {

std::span<const std::uint8_t> AsBytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// Beyond this a margin tells nothing more.
constexpr std::int64_t kMaxMargin_ticks = 1000;

v1::RefusalReason ReasonOf(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kNotFound:
      return v1::REFUSAL_REASON_WRONG_INSTANCE;
    case absl::StatusCode::kDeadlineExceeded:
      return v1::REFUSAL_REASON_EXPIRED_TOKEN;
    default:
      return v1::REFUSAL_REASON_BAD_TOKEN;
  }
}

}  // namespace

GamePort::GamePort(std::unique_ptr<net::Endpoint> endpoint, WorkerMetrics& metrics)
    : endpoint_(std::move(endpoint)), metrics_(metrics) {}

void GamePort::Open(GameRules rules, Admit admit) {
  rules_ = std::move(rules);
  admit_ = std::move(admit);
}

std::vector<ClientInput> GamePort::Service(TimePoint now, Tick tick, bool started, bool* any) {
  std::vector<ClientInput> inputs;
  const std::vector<net::Event> events = endpoint_->Service(std::chrono::milliseconds(0));
  for (const net::Event& event : events) {
    switch (event.kind) {
      case net::Event::Kind::kConnected:
        guests_[event.peer].until = now + kHelloTimeout;
        break;
      case net::Event::Kind::kDisconnected:
        guests_.erase(event.peer);
        if (const auto gone = clients_.find(event.peer); gone != clients_.end()) {
          spdlog::info("client gone player={}", gone->second.player.value());
          clients_.erase(gone);
        }
        break;
      case net::Event::Kind::kMessage:
        OnMessage(event, now, tick, started, inputs);
        break;
    }
  }
  if (rules_) AnswerWaiting(now, tick, started);
  DropSilent(now);
  CountClients();
  *any = !events.empty();
  return inputs;
}

void GamePort::OnMessage(const net::Event& event, TimePoint now, Tick tick, bool started,
                         std::vector<ClientInput>& inputs) {
  if (event.delivery == net::Delivery::kReliable) {
    OnControl(event, now, tick, started);
  } else {
    OnDatagram(event, now, tick, inputs);
  }
}

void GamePort::OnControl(const net::Event& event, TimePoint now, Tick tick, bool started) {
  const auto guest = guests_.find(event.peer);
  if (guest == guests_.end() || guest->second.hello) return;  // says hello once more: nothing to change
  v1::ClientControl control;
  if (!control.ParseFromArray(event.bytes.data(), static_cast<int>(event.bytes.size())) || !control.has_hello()) {
    Refuse(event.peer, v1::REFUSAL_REASON_MALFORMED, "the first message is no hello");
    return;
  }
  guest->second.hello = std::move(*control.mutable_hello());
  if (rules_ && Answer(event.peer, *guest->second.hello, now, tick, started)) guests_.erase(event.peer);
}

void GamePort::OnDatagram(const net::Event& event, TimePoint now, Tick tick, std::vector<ClientInput>& inputs) {
  Client* client = Find(event.peer);
  if (client == nullptr) return;  // overtook its hello, or belongs to one that was dropped
  if (replication::KindOf(event.bytes) != replication::DatagramKind::kInput) return;
  const absl::StatusOr<replication::InputMessage> message = replication::DecodeInput(event.bytes);
  if (!message.ok()) {
    metrics_.inputs_refused.Increment();
    TellInputRefused(event.peer, {}, std::string(message.status().message()), now);
    return;
  }
  client->unanswered_since.reset();
  if (!message->ack.empty()) (void)client->sender.Acknowledge(message->ack);
  for (const replication::InputCommand& command : message->inputs) {
    if (command.number <= client->newest_input) continue;  // said again, in case the first was lost
    if (command.target != Tick()) {
      client->input_margin_ticks = static_cast<std::int32_t>(
          std::clamp<std::int64_t>(command.target - (tick + 1), -kMaxMargin_ticks, kMaxMargin_ticks));
    }
    inputs.push_back({event.peer, command});
  }
}

void GamePort::AnswerWaiting(TimePoint now, Tick tick, bool started) {
  for (auto it = guests_.begin(); it != guests_.end();) {
    const auto current = it++;
    if (!current->second.hello) continue;
    const net::PeerHandle peer = current->first;
    const v1::ClientHello hello = *current->second.hello;
    if (Answer(peer, hello, now, tick, started)) guests_.erase(peer);
  }
}

bool GamePort::Answer(net::PeerHandle peer, const v1::ClientHello& hello, TimePoint now, Tick tick, bool started) {
  if (closed_because_) {
    Refuse(peer, v1::REFUSAL_REASON_STOPPING, *closed_because_);
    return true;
  }
  if (hello.protocol_version() != net::kProtocolVersion) {
    Refuse(
        peer, v1::REFUSAL_REASON_PROTOCOL,
        absl::StrCat("the client speaks protocol ", hello.protocol_version(), ", this region ", net::kProtocolVersion));
    return true;
  }
  const absl::StatusOr<net::ConnectToken> token =
      net::Open(AsBytes(hello.connect_token()), rules_->self.instance_id, rules_->key,
                static_cast<std::uint64_t>(std::time(nullptr)));
  if (!token.ok()) {
    Refuse(peer, ReasonOf(token.status().code()), std::string(token.status().message()));
    return true;
  }
  switch (admit_(token->player)) {
    case Admission::kNotYet:
      if (now < guests_.at(peer).until) return false;
      Refuse(peer, v1::REFUSAL_REASON_UNKNOWN_PLAYER,
             absl::StrCat("player ", token->player.value(), " is not known to this instance"));
      return true;
    case Admission::kLeft:
      Refuse(peer, v1::REFUSAL_REASON_UNKNOWN_PLAYER, absl::StrCat("player ", token->player.value(), " has left"));
      return true;
    case Admission::kWelcome:
      Welcome(peer, token->player, tick, started);
      return true;
  }
  return true;
}

void GamePort::Welcome(net::PeerHandle peer, PlayerNumber player, Tick tick, bool started) {
  Expel(player);  // an older connection of the same player
  clients_.emplace(peer, Client{.player = player, .sender = replication::SnapshotSender(rules_->replication)});
  v1::RegionControl message;
  v1::RegionWelcome& welcome = *message.mutable_welcome();
  welcome.set_region(rules_->self.region.value());
  welcome.set_incarnation(rules_->self.incarnation.value());
  welcome.set_player(player.value());
  welcome.set_tick(tick.value());
  welcome.set_tick_rate_hz(rules_->tick_rate_hz);
  welcome.set_snapshot_rate_hz(rules_->snapshot_rate_hz);
  welcome.set_started(started);
  *welcome.mutable_map() = rules_->map;
  Tell(peer, message);
  spdlog::info("client welcome player={} from={}", player.value(), endpoint_->AddressOf(peer));
}

void GamePort::Refuse(net::PeerHandle peer, v1::RefusalReason reason, std::string_view detail) {
  spdlog::warn("client refused from={} reason={} detail={}", endpoint_->AddressOf(peer), v1::RefusalReason_Name(reason),
               telemetry::LogValue(detail));
  v1::RegionControl message;
  message.mutable_refusal()->set_reason(reason);
  message.mutable_refusal()->set_detail(std::string(detail));
  Tell(peer, message);
  endpoint_->Disconnect(peer);
  guests_.erase(peer);
}

void GamePort::DropSilent(TimePoint now) {
  for (auto it = guests_.begin(); it != guests_.end();) {
    const auto [peer, guest] = *it++;
    if (now >= guest.until && !guest.hello) Refuse(peer, v1::REFUSAL_REASON_MALFORMED, "it said no hello");
  }
  for (auto it = clients_.begin(); it != clients_.end();) {
    const Client& client = it->second;
    if (!client.unanswered_since || now < *client.unanswered_since + kSilence) {
      ++it;
      continue;
    }
    spdlog::warn("client dropped player={} reason=silent", client.player.value());
    endpoint_->Disconnect(it->first);
    it = clients_.erase(it);
  }
}

Client* GamePort::Find(net::PeerHandle peer) {
  const auto found = clients_.find(peer);
  return found == clients_.end() ? nullptr : &found->second;
}

std::vector<PlayerNumber> GamePort::players() const {
  std::vector<PlayerNumber> players;
  for (const auto& [peer, client] : clients_) players.push_back(client.player);
  std::sort(players.begin(), players.end());
  return players;
}

bool GamePort::Has(PlayerNumber player) const {
  return std::any_of(clients_.begin(), clients_.end(),
                     [&](const auto& client) { return client.second.player == player; });
}

std::uint64_t GamePort::Broadcast(TimePoint now, const std::function<std::vector<net::Bytes>(Client&)>& write) {
  std::uint64_t bytes = 0;
  for (auto& [peer, client] : clients_) {
    const std::vector<net::Bytes> datagrams = write(client);
    if (!datagrams.empty() && !client.unanswered_since) client.unanswered_since = now;
    for (const net::Bytes& datagram : datagrams) {
      if (endpoint_->Send(peer, net::Delivery::kUnsequenced, datagram).ok()) bytes += datagram.size();
    }
  }
  endpoint_->Flush();
  return bytes;
}

void GamePort::TellStarted(Tick tick) {
  v1::RegionControl message;
  message.mutable_started()->set_tick(tick.value());
  for (const auto& [peer, client] : clients_) Tell(peer, message);
  endpoint_->Flush();
}

void GamePort::TellInputRefused(net::PeerHandle peer, const replication::InputCommand& input, std::string_view why,
                                TimePoint now) {
  Client* client = Find(peer);
  if (client == nullptr || now < client->may_refuse_at) return;
  client->may_refuse_at = now + kRefusalDistance;
  v1::RegionControl message;
  v1::InputRefused& refused = *message.mutable_input_refused();
  refused.set_body(input.body.value());
  refused.set_input_number(input.number);
  refused.set_detail(std::string(why));
  Tell(peer, message);
}

void GamePort::Expel(PlayerNumber player) {
  for (auto it = clients_.begin(); it != clients_.end();) {
    if (it->second.player != player) {
      ++it;
      continue;
    }
    endpoint_->Disconnect(it->first);
    it = clients_.erase(it);
  }
}

void GamePort::Close(const std::string& reason) {
  closed_because_ = reason;
  v1::RegionControl stopping;
  stopping.mutable_stopping()->set_reason(reason);
  for (const auto& [peer, client] : clients_) {
    Tell(peer, stopping);
    endpoint_->Disconnect(peer);
  }
  for (auto it = guests_.begin(); it != guests_.end();) {
    const net::PeerHandle peer = (it++)->first;
    Refuse(peer, v1::REFUSAL_REASON_STOPPING, reason);
  }
  clients_.clear();
  CountClients();
  endpoint_->Flush();
}

void GamePort::Tell(net::PeerHandle peer, const v1::RegionControl& message) {
  (void)endpoint_->Send(peer, net::Delivery::kReliable, AsBytes(message.SerializeAsString()));
}

void GamePort::CountClients() { metrics_.clients.Set(static_cast<double>(clients_.size())); }

}  // namespace tessera::worker
