#include "control_plane/cluster/instance_players.h"

#include <sodium.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "control_plane/retry_after.h"
#include "core/world/limits.h"
#include "core/world/player_name.h"
#include "core/world/utf8.h"
#include "core/world/viewer_number.h"
#include "net/credential.h"

namespace tessera::control {
namespace {

constexpr net::Generation kFirstGeneration(1);
// How often one player comes back: a client whose link is bad does so every few seconds.
constexpr net::Rate kReturnRate{.per_s = 1, .burst = 5};
constexpr std::size_t kReturnsKept = 1024;     // beyond those of all who are there, before any are looked through
constexpr std::size_t kMostFatesInLines = 10;  // so many of one kind and moment have a line each

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

// The player has left: it is no more one of those who never came.
void SetLeft(std::uint32_t number, const std::string& because, Players& players) {
  players.Change(number, [&](records::StoredPlayer& known) {
    known.mutable_player()->set_left(true);
    if (!because.empty()) known.mutable_player()->set_ended_because(because);
    known.set_unseen(false);
  });
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

// The number of one that comes back; 0: a new one joins.
absl::StatusOr<std::uint32_t> FindReturning(const InstanceEntry& instance, const v1::JoinInstanceRequest& request,
                                            const trust::Ticket* ticket) {
  if (ticket != nullptr) return instance.players.FindId(ticket->player_id);
  if (request.credential().empty()) return 0;
  const auto number = PlayerOf(instance, request.credential(), request.credential_key());
  if (!number.ok()) return number.status();
  const records::StoredPlayer* known = instance.players.Find(*number);
  if (known != nullptr && !known->player().ended_because().empty()) {
    return absl::AbortedError(known->player().ended_because());
  }
  if (known == nullptr || known->player().left()) {
    return absl::FailedPreconditionError(absl::StrCat("credential: player ", *number, " has left for good"));
  }
  return *number;
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
  const auto in_force = [&record](std::uint32_t region) {
    return std::ranges::any_of(record.map().regions(), [region](const auto& known) { return known.id() == region; });
  };
  for (const WorkerEntry& worker : instance.workers) {
    if (!in_force(worker.region)) continue;  // it is to join; clients hear of it with the map that it is in
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
PlayerNumber DrawViewer(bool stranger) {
  return PlayerNumber((stranger ? kFirstViewer : kFirstTrustedViewer) + randombytes_uniform(kFirstViewer / 2));
}

// Players with a connection to any worker, ascending. A host that is silent may well serve its players still: its last
// report counts.
std::vector<std::uint32_t> Connected(const InstanceEntry& instance) {
  std::vector<std::uint32_t> connected;
  for (const WorkerEntry& worker : instance.workers) {
    const auto& players = worker.report.connected_players();
    if (!worker.gone) connected.insert(connected.end(), players.begin(), players.end());
  }
  std::sort(connected.begin(), connected.end());
  return connected;
}

}  // namespace

// --- Joining.

absl::Status CheckRoom(const InstanceEntry& instance) {
  const std::size_t present = instance.players.present();
  if (present < MaxPlayersOf(instance.record)) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("instance_id: ", instance.record.id(), " is full: ", present, " players"));
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
    if (absl::Status status = CheckRoom(*instance); !status.ok()) return status;
  }
  if (!request.viewer()) ++known_[instance->number].waiting;
  return instance;
}

absl::Status InstancePlayers::TakeGuest(const InstanceEntry& instance, bool viewer, const std::string& address,
                                        Now now) {
  if (!viewer && !CheckRoom(instance).ok()) return absl::OkStatus();
  return guests_.Take(instance.number, address, now);
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

absl::StatusOr<Joined> InstancePlayers::Join(const v1::JoinInstanceRequest& request, const trust::Ticket* ticket,
                                             Now now, bool stranger) {
  // Whoever calls has to check it; without, the request would pass for a guest's.
  if (ticket == nullptr && !request.ticket().empty()) return absl::InternalError("ticket: was not checked");
  if (const absl::StatusOr<bool> can = CanJoin(state_, request.instance_id(), request.viewer()); !can.ok()) {
    return can.status();
  }
  InstanceEntry& instance = *state_.FindInstance(request.instance_id());
  if (request.viewer()) return Joined{.response = Admit(instance, DrawViewer(stranger), kFirstGeneration)};
  const absl::StatusOr<std::uint32_t> returns = FindReturning(instance, request, ticket);
  if (!returns.ok()) return returns.status();
  Joined joined;
  if (*returns == 0) joined.mark = state_.last_revision();  // any order made from here on names the player
  const std::string& name = ticket == nullptr ? request.player_name() : ticket->name;
  const absl::StatusOr<v1::Player> player =
      *returns == 0 ? Add(instance, name, ticket, now) : Return(instance, *returns, now);
  if (!player.ok()) return player.status();
  joined.response = Admit(instance, PlayerNumber(player->number()), net::Generation(player->generation()));
  return joined;
}

absl::StatusOr<v1::Player> InstancePlayers::Add(InstanceEntry& instance, const std::string& name,
                                                const trust::Ticket* ticket, Now now) {
  if (absl::Status status = CheckRoom(instance); !status.ok()) return status;
  const std::uint32_t number = instance.last_player + 1;
  records::StoredPlayer joins;
  joins.set_unseen(true);
  v1::Player& player = *joins.mutable_player();
  player.set_number(number);
  player.set_name(name);
  player.set_generation(kFirstGeneration.value());
  player.set_spawn_region(SpawnRegionOf(number, instance.record, instance.map));
  if (ticket != nullptr) SetTicket(*ticket, player);
  Players players = instance.players;
  players.Put(joins);
  if (absl::Status status = StoreJoined(instance, number, players); !status.ok()) return status;
  instance.last_player = number;
  known_[instance.number].unseen[number] = now.steady;
  return player;
}

// It is the player that it was, of a higher generation: the regions end the connections of a lower one.
absl::StatusOr<v1::Player> InstancePlayers::Return(InstanceEntry& instance, std::uint32_t number, Now now) {
  if (absl::Status status = TakeReturn(instance, number, now); !status.ok()) return status;
  Players players = instance.players;
  players.Change(number, [](records::StoredPlayer& known) {
    known.mutable_player()->set_generation(known.player().generation() + 1);
  });
  if (absl::Status status = Store(instance, players); !status.ok()) return status;
  return instance.players.Find(number)->player();
}

// Each time is a write and orders to all hosts of the world, and whoever has a return token may come by it for ever.
absl::Status InstancePlayers::TakeReturn(const InstanceEntry& instance, std::uint32_t number, Now now) {
  const net::TokenBucket::TimePoint at(std::chrono::duration_cast<net::TokenBucket::TimePoint::duration>(now.steady));
  auto& returns = known_[instance.number].returns;
  if (returns.size() > 2 * instance.players.present() + kReturnsKept) {
    std::erase_if(returns, [&](const auto& known) {
      net::TokenBucket bucket = known.second;
      bucket.Fill(at, kReturnRate);
      return bucket.left() >= kReturnRate.burst;
    });
  }
  net::TokenBucket& bucket = returns[number];
  if (bucket.Take(at, kReturnRate)) return absl::OkStatus();
  const double wait_ms = std::ceil(1000 * (1 - bucket.left()) / kReturnRate.per_s);
  const std::chrono::milliseconds wait(static_cast<std::int64_t>(wait_ms));
  return WithRetryAfter(
      absl::ResourceExhaustedError(absl::StrCat("credential: player ", number, " comes back too often: ask again in ",
                                                std::chrono::ceil<std::chrono::seconds>(wait).count(), " s")),
      wait);
}

// The record, which has all spawn points of a large world, is written for the first of many numbers.
absl::Status InstancePlayers::StoreJoined(InstanceEntry& instance, std::uint32_t number, const Players& players) {
  if (number <= instance.record.last_player()) return Store(instance, players);
  records::Instance next = instance.record;
  next.set_last_player(number + kNumbersAtOnce - 1);
  if (absl::Status status = state_.StoreWithPlayers(instance, next, players); !status.ok()) return status;
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
  return absl::OkStatus();
}

absl::Status InstancePlayers::Store(InstanceEntry& instance, const Players& players) {
  if (absl::Status status = state_.StorePlayers(instance, players); !status.ok()) return status;
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
  const records::StoredPlayer* known = instance->players.Find(*number);
  if (known == nullptr || known->player().left()) return absl::OkStatus();  // has left already
  Players players = instance->players;
  SetLeft(*number, "", players);
  if (absl::Status status = Store(*instance, players); !status.ok()) return status;
  known_[instance->number].left[*number] = {state_.last_revision(), now.steady};
  return absl::OkStatus();
}

absl::StatusOr<std::uint32_t> InstancePlayers::Kick(InstanceEntry& instance, std::uint32_t number,
                                                    const std::string& reason, Now now) {
  const records::StoredPlayer* known = instance.players.Find(number);
  if (known == nullptr || known->player().left()) {
    return absl::NotFoundError(absl::StrCat("player: ", instance.record.id(), " has no player ", number));
  }
  Players players = instance.players;
  SetLeft(number, reason, players);
  if (absl::Status status = Store(instance, players); !status.ok()) return status;
  known_[instance.number].left[number] = {state_.last_revision(), now.steady};
  state_.Log(absl::StrCat("player kicked id=", instance.record.id(), " player=", number, " reason=", reason));
  return number;
}

void InstancePlayers::TakeEnded(InstanceEntry& instance, const v1::WorkerReport& report, Now now) {
  if (report.ended_players().empty()) return;
  Players players = instance.players;
  for (const v1::EndedPlayer& ended : report.ended_players()) {
    const records::StoredPlayer* known = players.Find(ended.player());
    if (known == nullptr || known->player().left()) continue;
    const std::string reason = ValidUtf8(OneLine(ended.reason(), kMaxEndReasonBytes));
    SetLeft(ended.player(), reason, players);
    state_.Log(absl::StrCat("player ended by the game id=", instance.record.id(), " player=", ended.player(),
                            " reason=", reason));
  }
  if (players.BucketsUnlike(instance.players).empty()) return;
  if (!state_.StorePlayers(instance, players).ok()) return;  // the next report says it again
  for (const v1::EndedPlayer& ended : report.ended_players()) {
    known_[instance.number].left.try_emplace(ended.player(), Left{state_.last_revision(), now.steady});
  }
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
}

std::optional<Players> InstancePlayers::NextVanished(const InstanceEntry& instance, Now now) {
  const bool parks = instance.record.leaver_policy() == v1::LEAVER_POLICY_PARK;
  const bool removes = instance.record.leaver_policy() == v1::LEAVER_POLICY_REMOVE;
  const std::chrono::milliseconds grace(instance.record.leaver_grace_ms());
  Known& known = known_[instance.number];
  if (!instance.awaits.empty()) {  // nobody can say who is connected to what is waited for
    known.unseen.clear();
    known.looked_at.reset();
    return std::nullopt;
  }
  const bool same = known.looked_at && known.connections == instance.connections;
  if (same && now.steady - *known.looked_at < kVanishedInterval) return std::nullopt;
  known.looked_at = now.steady;
  known.connections = instance.connections;
  const std::vector<std::uint32_t> connected = Connected(instance);
  Fates fates;
  Players next = instance.players;
  instance.players.ForEach([&](const records::StoredPlayer& stored) {
    const v1::Player& player = stored.player();
    const std::uint32_t number = player.number();
    if (player.left() || std::binary_search(connected.begin(), connected.end(), number)) {
      known.unseen.erase(number);
      const bool back = !player.left() && parks && player.parked();
      if (!stored.unseen() && !back) return;
      next.Change(number, [&](records::StoredPlayer& seen) {
        seen.set_unseen(false);
        if (back) seen.mutable_player()->set_parked(false);
      });
      if (back) fates["back"].push_back(number);
      return;
    }
    if (!parks && !removes && !stored.unseen()) return;
    const Steady away = now.steady - known.unseen.try_emplace(number, now.steady).first->second;
    const bool never = stored.unseen();
    if ((removes && away >= grace) || (never && away >= std::max(grace, kFirstConnectionGrace))) {
      SetLeft(number, "", next);
      known.left[number] = {state_.last_revision(), now.steady};
      fates[never ? "never came" : "removed"].push_back(number);
    } else if (parks && !player.parked() && away >= grace) {
      next.Change(number, [](records::StoredPlayer& parked) { parked.mutable_player()->set_parked(true); });
      fates["parked"].push_back(number);
    }
  });
  if (next.BucketsUnlike(instance.players).empty()) return std::nullopt;
  LogFates(instance, fates);
  return next;
}

// Players who join and never come fill no log: many at once are one line.
void InstancePlayers::LogFates(const InstanceEntry& instance, const Fates& fates) {
  for (const auto& [fate, players] : fates) {
    if (players.size() > kMostFatesInLines) {
      state_.Log(absl::StrCat("players ", fate, " id=", instance.record.id(), " count=", players.size()));
      continue;
    }
    for (const std::uint32_t player : players) {
      state_.Log(absl::StrCat("player ", fate, " id=", instance.record.id(), " player=", player));
    }
  }
}

void InstancePlayers::Prune(InstanceEntry& instance, Now now) {
  Known& known = known_[instance.number];
  std::vector<std::uint32_t> forgotten;
  instance.players.ForEach([&](const records::StoredPlayer& stored) {
    const v1::Player& player = stored.player();
    if (!player.left()) return;
    // After a restart it is not known since when: from now on, then.
    const Left& left = known.left.try_emplace(player.number(), Left{state_.last_revision(), now.steady}).first->second;
    if (now.steady - left.since > settings_.keep_left_players && AllKnow(state_, instance.record.id(), left.mark)) {
      forgotten.push_back(player.number());
    }
  });
  if (forgotten.empty()) return;
  Players next = instance.players;
  for (const std::uint32_t number : forgotten) next.Erase(number);
  if (!state_.StorePlayers(instance, next).ok()) return;
  for (const std::uint32_t number : forgotten) known.left.erase(number);
  state_.MarkOrders(instance);
}

// --- Reading.

absl::StatusOr<std::string> PlayerIdOf(const InstanceEntry& instance, std::uint32_t number) {
  const records::StoredPlayer* known = instance.players.Find(number);
  const std::string& of = instance.record.id();
  if (known == nullptr) return absl::NotFoundError(absl::StrCat("player: ", of, " has no player ", number));
  if (!known->player().player_id().empty()) return known->player().player_id();
  return absl::FailedPreconditionError(
      absl::StrCat("player: ", number, " of ", of, " is a guest, who has no id; kick it, or take no guests"));
}

absl::Status CheckGuest(const records::Instance& record, const v1::JoinInstanceRequest& request, bool stranger) {
  if (!request.ticket().empty()) {
    if (request.credential().empty() && request.player_name().empty()) return absl::OkStatus();
    return absl::InvalidArgumentError("ticket: says who the player is, so there is no name or credential beside it");
  }
  if (!record.no_guests() || !request.credential().empty() || (request.viewer() && !stranger)) return absl::OkStatus();
  return absl::UnauthenticatedError("ticket: this instance takes no guests: a ticket is needed");
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
  std::vector<std::uint32_t> everywhere;
  instance.players.ForEach([&](const records::StoredPlayer& known) {
    if (!known.player().left()) everywhere.push_back(known.player().number());
  });
  for (const WorkerEntry& worker : instance.workers) {
    const std::set<std::uint32_t> here(worker.report.connected_players().begin(),
                                       worker.report.connected_players().end());
    std::erase_if(everywhere, [&](std::uint32_t number) { return !here.contains(number); });
  }
  return static_cast<int>(everywhere.size());
}

}  // namespace tessera::control
