#include "control_plane/cluster/instance_players.h"

#include <sodium.h>

#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "core/world/limits.h"
#include "core/world/player_name.h"
#include "core/world/utf8.h"
#include "core/world/viewer_number.h"
#include "net/credential.h"

namespace tessera::control {
namespace {

constexpr net::Generation kFirstGeneration(1);

absl::Status CheckOpen(const records::Instance& record, bool viewer) {
  const v1::InstanceState state = record.state();
  if (IsFinal(state) || state == v1::INSTANCE_STATE_STOPPING) {
    const absl::string_view what = state == v1::INSTANCE_STATE_FAILED  ? " has failed"
                                   : state == v1::INSTANCE_STATE_ENDED ? " has ended"
                                                                       : " is stopping";
    return absl::FailedPreconditionError(
        absl::StrCat("instance_id: ", record.id(), what, record.reason().empty() ? "" : ": ", record.reason()));
  }
  if (viewer) return absl::OkStatus();
  if (record.spawn_points().empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("instance_id: ", record.id(), " cannot be joined: scene ", record.scene_name(), " has no player"));
  }
  return absl::OkStatus();
}

std::span<const std::uint8_t> BytesOf(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// The place among the record's players of the one with this number; -1: it is not among them.
int PlaceOf(const records::Instance& record, std::uint32_t number) {
  const auto& players = record.players();
  const auto player =
      std::find_if(players.begin(), players.end(), [&](const v1::Player& p) { return p.number() == number; });
  return player == players.end() ? -1 : static_cast<int>(player - players.begin());
}

void SetTicket(const trust::Ticket& ticket, v1::Player& player) {
  player.set_player_id(ticket.player_id);
  for (const auto& [name, value] : ticket.properties) {
    v1::Property& property = *player.add_properties();
    property.set_name(name);
    // Tickets have no others.
    if (const bool* flag = std::get_if<bool>(&value)) property.set_flag(*flag);
    if (const auto* number = std::get_if<std::int64_t>(&value)) property.set_number(*number);
    if (const auto* real = std::get_if<double>(&value)) property.set_real(*real);
    if (const auto* text = std::get_if<std::string>(&value)) property.set_text(*text);
  }
}

// A worker has had a connection of the player, or the player has left: it is no more one of those who never came.
void NoteSeen(std::uint32_t number, records::Instance& record) {
  auto& unseen = *record.mutable_unseen_players();
  unseen.erase(std::remove(unseen.begin(), unseen.end(), number), unseen.end());
}

// The player of the credential. Everybody on the way sees the credential when it is presented to a region; its key
// never travels there. Any that the player ever had will do: an answer with a newer one may have been lost.
absl::StatusOr<std::uint32_t> PlayerOf(const InstanceEntry& instance, const std::string& credential,
                                       const std::string& credential_key) {
  const auto read =
      net::ReadPlayerCredential(BytesOf(credential), instance.record.id(), instance.key.verification_key());
  if (!read.ok()) return absl::UnauthenticatedError(absl::StrCat("credential: ", read.status().message()));
  const auto key = net::SigningKey::FromSeed(credential_key, "credential_key");
  if (!key.ok() || key->verification_key() != read->key) {
    return absl::UnauthenticatedError("credential_key: is not that of the credential");
  }
  return read->player.value();
}

// The place among the record's players of one that comes back; -1: a new one joins.
absl::StatusOr<int> FindReturning(const InstanceEntry& instance, const v1::JoinInstanceRequest& request,
                                  const trust::Ticket* ticket) {
  if (ticket != nullptr) return PlaceOf(instance.record, FindPlayer(instance.record, ticket->player_id));
  if (request.credential().empty()) return -1;
  const auto number = PlayerOf(instance, request.credential(), request.credential_key());
  if (!number.ok()) return number.status();
  const auto& players = instance.record.players();
  const auto player =
      std::find_if(players.begin(), players.end(), [&](const v1::Player& p) { return p.number() == *number; });
  if (player != players.end() && !player->ended_because().empty()) {
    return absl::AbortedError(player->ended_because());
  }
  if (player == players.end() || player->left()) {
    return absl::FailedPreconditionError(absl::StrCat("credential: player ", *number, " has left for good"));
  }
  return static_cast<int>(player - players.begin());
}

v1::JoinInstanceResponse Admit(const InstanceEntry& instance, PlayerNumber player, net::Generation generation) {
  const records::Instance& record = instance.record;
  const net::Credentials credentials = net::IssuePlayer(record.id(), player, generation, instance.key);
  const net::Seed seed = credentials.key.seed();
  v1::JoinInstanceResponse response;
  response.set_player(player.value());
  response.set_credential(std::string(credentials.statement.begin(), credentials.statement.end()));
  response.set_credential_key(seed.data(), seed.size());
  response.set_instance_key(credentials.instance_key.data(), credentials.instance_key.size());
  *response.mutable_map() = record.map();
  for (const WorkerEntry& worker : instance.workers) {
    v1::RegionAddress& address = *response.add_regions();
    address = worker.report.address();
    address.clear_link_port();
    address.clear_metrics_port();
  }
  response.set_scene_hash(record.scene_hash());
  response.set_tick_rate_hz(record.tick_rate_hz());
  response.set_snapshot_rate_hz(record.snapshot_rate_hz());
  response.set_expected_players(record.expected_players());
  return response;
}

// Nothing is kept of it, so numbers are drawn: with so many, two viewers of one world never have the same.
PlayerNumber DrawViewer() { return PlayerNumber(kFirstViewer + randombytes_uniform(kFirstViewer)); }

// Players with a connection to any worker. A host that is silent may well serve its players still: its last report
// counts.
std::set<std::uint32_t> Connected(const InstanceEntry& instance) {
  std::set<std::uint32_t> connected;
  for (const WorkerEntry& worker : instance.workers) {
    const auto& players = worker.report.connected_players();
    if (!worker.gone) connected.insert(players.begin(), players.end());
  }
  return connected;
}

}  // namespace

// --- Joining.

absl::Status CheckRoom(const records::Instance& record) {
  const int present = PlayersPresent(record);
  if (present < static_cast<int>(kMaxPlayers)) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("instance_id: ", record.id(), " is full: ", present, " players"));
}

absl::StatusOr<InstanceEntry*> InstancePlayers::BeginWait(const v1::JoinInstanceRequest& request) {
  if (absl::Status status = CheckPlayerName(request.player_name()); !status.ok()) return status;
  InstanceEntry* instance = state_.FindInstance(request.instance_id());
  if (instance == nullptr) return NoInstance("instance_id", request.instance_id());
  if (request.viewer() && !request.credential().empty()) {
    return absl::InvalidArgumentError("credential: a viewer joins anew each time");
  }
  if (absl::Status status = CheckOpen(instance->record, request.viewer()); !status.ok()) return status;
  if (!request.viewer() && request.credential().empty() && request.ticket().empty()) {
    if (absl::Status status = CheckRoom(instance->record); !status.ok()) return status;
  }
  if (!request.viewer()) ++known_[instance->number].waiting;
  return instance;
}

InstanceEntry* InstancePlayers::EndWait(const std::string& instance_id) {
  InstanceEntry* instance = state_.FindInstance(instance_id);
  if (instance != nullptr) --known_[instance->number].waiting;
  return instance;
}

int InstancePlayers::Waiting(const InstanceEntry& instance) const {
  const auto known = known_.find(instance.number);
  return known == known_.end() ? 0 : known->second.waiting;
}

absl::StatusOr<Joined> InstancePlayers::Join(const v1::JoinInstanceRequest& request, const trust::Ticket* ticket) {
  // Whoever calls has to check it; without, the request would pass for a guest's.
  if (ticket == nullptr && !request.ticket().empty()) return absl::InternalError("ticket: was not checked");
  if (const absl::StatusOr<bool> can = CanJoin(state_, request.instance_id(), request.viewer()); !can.ok()) {
    return can.status();
  }
  InstanceEntry& instance = *state_.FindInstance(request.instance_id());
  if (request.viewer()) return Joined{.response = Admit(instance, DrawViewer(), kFirstGeneration)};
  const absl::StatusOr<int> returns = FindReturning(instance, request, ticket);
  if (!returns.ok()) return returns.status();
  Joined joined;
  if (*returns < 0) joined.mark = state_.last_revision();  // any order made from here on names the player
  const std::string& name = ticket == nullptr ? request.player_name() : ticket->name;
  const absl::StatusOr<v1::Player> player = *returns < 0 ? Add(instance, name, ticket) : Return(instance, *returns);
  if (!player.ok()) return player.status();
  joined.response = Admit(instance, PlayerNumber(player->number()), net::Generation(player->generation()));
  return joined;
}

absl::StatusOr<v1::Player> InstancePlayers::Add(InstanceEntry& instance, const std::string& name,
                                                const trust::Ticket* ticket) {
  if (absl::Status status = CheckRoom(instance.record); !status.ok()) return status;
  records::Instance next = instance.record;
  const std::uint32_t number = next.last_player() + 1;
  next.set_last_player(number);
  v1::Player& player = *next.add_players();
  player.set_number(number);
  player.set_name(name);
  player.set_generation(kFirstGeneration.value());
  player.set_spawn_region(SpawnRegionOf(number, next, instance.map));
  if (ticket != nullptr) SetTicket(*ticket, player);
  next.add_unseen_players(number);
  if (absl::Status status = StorePlayers(instance, next); !status.ok()) return status;
  return player;
}

// It is the player that it was, of a higher generation: the regions end the connections of a lower one.
absl::StatusOr<v1::Player> InstancePlayers::Return(InstanceEntry& instance, int index) {
  records::Instance next = instance.record;
  v1::Player& player = *next.mutable_players(index);
  player.set_generation(player.generation() + 1);
  if (absl::Status status = StorePlayers(instance, next); !status.ok()) return status;
  return player;
}

absl::Status InstancePlayers::StorePlayers(InstanceEntry& instance, const records::Instance& next) {
  if (absl::Status status = state_.StoreInstance(instance, next); !status.ok()) return status;
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
  return absl::OkStatus();
}

// --- Leaving.

absl::Status InstancePlayers::Leave(const v1::LeaveInstanceRequest& request, Now now) {
  InstanceEntry* instance = state_.FindInstance(request.instance_id());
  if (instance == nullptr) return NoInstance("instance_id", request.instance_id());
  const auto number = PlayerOf(*instance, request.credential(), request.credential_key());
  if (!number.ok()) return number.status();
  records::Instance next = instance->record;
  auto& players = *next.mutable_players();
  const auto player =
      std::find_if(players.begin(), players.end(), [&](const v1::Player& p) { return p.number() == *number; });
  if (player == players.end() || player->left()) return absl::OkStatus();  // has left already
  player->set_left(true);
  NoteSeen(*number, next);
  if (absl::Status status = StorePlayers(*instance, next); !status.ok()) return status;
  known_[instance->number].left[*number] = {state_.last_revision(), now.steady};
  return absl::OkStatus();
}

absl::StatusOr<std::uint32_t> InstancePlayers::Kick(InstanceEntry& instance, std::uint32_t number,
                                                    const std::string& reason, Now now) {
  const int place = PlaceOf(instance.record, number);
  if (place < 0 || instance.record.players(place).left()) {
    return absl::NotFoundError(absl::StrCat("player: ", instance.record.id(), " has no player ", number));
  }
  records::Instance next = instance.record;
  v1::Player& player = *next.mutable_players(place);
  player.set_left(true);
  player.set_ended_because(reason);
  NoteSeen(number, next);
  if (absl::Status status = StorePlayers(instance, next); !status.ok()) return status;
  known_[instance.number].left[number] = {state_.last_revision(), now.steady};
  state_.Log(absl::StrCat("player kicked id=", instance.record.id(), " player=", number, " reason=", reason));
  return number;
}

void InstancePlayers::TakeEnded(InstanceEntry& instance, const v1::WorkerReport& report, Now now) {
  if (report.ended_players().empty()) return;
  std::optional<records::Instance> next;
  for (const v1::EndedPlayer& ended : report.ended_players()) {
    const auto& players = instance.record.players();
    const auto known =
        std::find_if(players.begin(), players.end(), [&](const v1::Player& p) { return p.number() == ended.player(); });
    if (known == players.end() || known->left()) continue;
    if (!next) next = instance.record;
    v1::Player& player = *next->mutable_players(static_cast<int>(known - players.begin()));
    player.set_left(true);
    player.set_ended_because(ValidUtf8(OneLine(ended.reason(), kMaxEndReasonBytes)));
    NoteSeen(ended.player(), *next);
    state_.Log(absl::StrCat("player ended by the game id=", instance.record.id(), " player=", ended.player(),
                            " reason=", player.ended_because()));
  }
  if (!next || !state_.StoreInstance(instance, *next).ok()) return;  // the next report says it again
  for (const v1::EndedPlayer& ended : report.ended_players()) {
    known_[instance.number].left.try_emplace(ended.player(), Left{state_.last_revision(), now.steady});
  }
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
}

std::optional<records::Instance> InstancePlayers::NextVanished(const InstanceEntry& instance, Now now) {
  const records::Instance& record = instance.record;
  const bool parks = record.leaver_policy() == v1::LEAVER_POLICY_PARK;
  const bool removes = record.leaver_policy() == v1::LEAVER_POLICY_REMOVE;
  if (!parks && !removes && record.unseen_players().empty()) return std::nullopt;
  const std::chrono::milliseconds grace(record.leaver_grace_ms());
  const std::set<std::uint32_t> connected = Connected(instance);
  const std::set<std::uint32_t> never_seen(record.unseen_players().begin(), record.unseen_players().end());
  Known& known = known_[instance.number];
  std::optional<records::Instance> next;
  const auto changed = [&]() -> records::Instance& { return next ? *next : next.emplace(record); };
  for (int i = 0; i < record.players_size(); ++i) {
    const v1::Player& player = record.players(i);
    const std::uint32_t number = player.number();
    const bool never = never_seen.contains(number);
    if (player.left() || connected.contains(number)) {
      known.unseen.erase(number);
      if (never) NoteSeen(number, changed());
      if (!player.left() && parks && player.parked()) {
        changed().mutable_players(i)->set_parked(false);
        LogFate(record, number, "back");
      }
      continue;
    }
    const Steady away = now.steady - known.unseen.try_emplace(number, now.steady).first->second;
    const bool let_go = (removes && away >= grace) || (never && away >= std::max(grace, kFirstConnectionGrace));
    if (let_go) {
      changed().mutable_players(i)->set_left(true);
      NoteSeen(number, changed());
      known.left[number] = {state_.last_revision(), now.steady};
      LogFate(record, number, never ? "never came" : "removed");
    } else if (parks && !player.parked() && away >= grace) {
      changed().mutable_players(i)->set_parked(true);
      LogFate(record, number, "parked");
    }
  }
  return next;
}

void InstancePlayers::LogFate(const records::Instance& record, std::uint32_t player, const char* fate) {
  state_.Log(absl::StrCat("player ", fate, " id=", record.id(), " player=", player));
}

void InstancePlayers::Prune(InstanceEntry& instance, Now now) {
  Known& known = known_[instance.number];
  std::set<std::uint32_t> forgotten;
  for (const v1::Player& player : instance.record.players()) {
    if (!player.left()) continue;
    // After a restart it is not known since when: from now on, then.
    const Left& left = known.left.try_emplace(player.number(), Left{state_.last_revision(), now.steady}).first->second;
    if (now.steady - left.since > settings_.keep_left_players && AllKnow(state_, instance.record.id(), left.mark)) {
      forgotten.insert(player.number());
    }
  }
  if (forgotten.empty()) return;
  records::Instance next = instance.record;
  auto& players = *next.mutable_players();
  players.erase(std::remove_if(players.begin(), players.end(),
                               [&](const v1::Player& p) { return forgotten.contains(p.number()); }),
                players.end());
  if (!state_.StoreInstance(instance, next).ok()) return;
  for (const std::uint32_t number : forgotten) known.left.erase(number);
  state_.MarkOrders(instance);
}

// --- Reading.

absl::StatusOr<std::string> PlayerIdOf(const records::Instance& record, std::uint32_t number) {
  const int place = PlaceOf(record, number);
  if (place < 0) return absl::NotFoundError(absl::StrCat("player: ", record.id(), " has no player ", number));
  const std::string& id = record.players(place).player_id();
  if (!id.empty()) return id;
  return absl::FailedPreconditionError(
      absl::StrCat("player: ", number, " of ", record.id(), " is a guest, who has no id; kick it, or take no guests"));
}

absl::Status CheckGuest(const records::Instance& record, const v1::JoinInstanceRequest& request, bool stranger) {
  if (!request.ticket().empty()) {
    if (request.credential().empty() && request.player_name().empty()) return absl::OkStatus();
    return absl::InvalidArgumentError("ticket: says who the player is, so there is no name or credential beside it");
  }
  if (!record.no_guests() || !request.credential().empty() || (request.viewer() && !stranger)) return absl::OkStatus();
  return absl::UnauthenticatedError("ticket: this instance takes no guests: a ticket is needed");
}

std::uint32_t FindPlayer(const records::Instance& record, const std::string& player_id) {
  for (const v1::Player& player : record.players()) {
    if (!player.left() && !player_id.empty() && player.player_id() == player_id) return player.number();
  }
  return 0;
}

absl::StatusOr<bool> CanJoin(const ClusterState& state, const std::string& instance_id, bool viewer) {
  const InstanceEntry* instance = state.FindInstance(instance_id);
  if (instance == nullptr) return NoInstance("instance_id", instance_id);
  if (absl::Status status = CheckOpen(instance->record, viewer); !status.ok()) return status;
  return std::all_of(instance->workers.begin(), instance->workers.end(),
                     [](const WorkerEntry& worker) { return worker.bound(); });
}

bool AllKnow(const ClusterState& state, const std::string& instance_id, std::uint64_t mark) {
  const InstanceEntry* instance = state.FindInstance(instance_id);
  return instance == nullptr ||
         std::all_of(instance->workers.begin(), instance->workers.end(), [mark](const WorkerEntry& worker) {
           return worker.gone || worker.report.order_revision() > mark;
         });
}

int ConnectedEverywhere(const InstanceEntry& instance) {
  const auto everywhere = [&instance](const v1::Player& player) {
    return !player.left() &&
           std::all_of(instance.workers.begin(), instance.workers.end(), [&player](const WorkerEntry& worker) {
             const auto& connected = worker.report.connected_players();
             return std::find(connected.begin(), connected.end(), player.number()) != connected.end();
           });
  };
  const auto& players = instance.record.players();
  return static_cast<int>(std::count_if(players.begin(), players.end(), everywhere));
}

}  // namespace tessera::control
