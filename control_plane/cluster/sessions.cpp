// Players: joining and leaving.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/orders.h"
#include "core/world/limits.h"
#include "net/connect_token.h"

namespace tessera::control {
namespace {

absl::Status NoInstance(const std::string& id) {
  return absl::NotFoundError(absl::StrCat("instance_id: no instance ", OneLine(id, kMaxNameBytes)));
}

absl::Status CheckOpen(const records::Instance& record) {
  const v1::InstanceState state = record.state();
  if (IsFinal(state) || state == v1::INSTANCE_STATE_STOPPING) {
    const absl::string_view what = state == v1::INSTANCE_STATE_FAILED  ? " has failed"
                                   : state == v1::INSTANCE_STATE_ENDED ? " has ended"
                                                                       : " is stopping";
    return absl::FailedPreconditionError(
        absl::StrCat("instance_id: ", record.id(), what, record.reason().empty() ? "" : ": ", record.reason()));
  }
  if (record.spawn_points().empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("instance_id: ", record.id(), " cannot be joined: scene ", record.scene_name(), " has no player"));
  }
  const auto present = std::count_if(record.players().begin(), record.players().end(),
                                     [](const v1::Player& player) { return !player.left(); });
  if (present >= kMaxPlayers) {
    return absl::ResourceExhaustedError(absl::StrCat("instance_id: ", record.id(), " is full: ", present, " players"));
  }
  return absl::OkStatus();
}

std::uint64_t Seconds(std::chrono::nanoseconds unix_time) {
  return static_cast<std::uint64_t>(std::chrono::floor<std::chrono::seconds>(unix_time).count());
}

}  // namespace

absl::Status Cluster::BeginWait(Moment now, const v1::JoinInstanceRequest& request) {
  if (request.player_name().size() > kMaxNameBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("player_name: ", request.player_name().size(), " bytes are more than ", kMaxNameBytes));
  }
  InstanceEntry* instance = FindInstance(request.instance_id());
  if (instance == nullptr) return NoInstance(request.instance_id());
  if (absl::Status status = CheckOpen(instance->record); !status.ok()) return status;
  ++instance->waiting;
  Reconcile(now, *instance);
  return absl::OkStatus();
}

void Cluster::EndWait(Moment now, const std::string& instance_id) {
  InstanceEntry* instance = FindInstance(instance_id);
  if (instance == nullptr) return;
  --instance->waiting;
  Reconcile(now, *instance);
}

absl::StatusOr<bool> Cluster::CanJoin(const std::string& instance_id) const {
  const InstanceEntry* instance = FindInstance(instance_id);
  if (instance == nullptr) return NoInstance(instance_id);
  if (absl::Status status = CheckOpen(instance->record); !status.ok()) return status;
  return std::all_of(instance->workers.begin(), instance->workers.end(),
                     [](const auto& worker) { return worker.bound(); });
}

// Everybody on the way sees the token when it is shown to a door; the key never travels there.
absl::StatusOr<std::uint32_t> Cluster::PlayerOf(Moment now, const InstanceEntry& instance,
                                                const std::string& connect_token,
                                                const std::string& session_key) const {
  const auto key = net::InstanceKeyFrom(instance.record.key());
  if (!key.ok()) return key.status();
  const std::span sealed(reinterpret_cast<const std::uint8_t*>(connect_token.data()), connect_token.size());
  const auto token = net::Open(sealed, instance.record.id(), *key, Seconds(now.unix_time));
  if (!token.ok()) return absl::UnauthenticatedError(absl::StrCat("connect_token: ", token.status().message()));
  const auto shown = net::SessionKeyFrom(session_key);
  if (!shown.ok() || !(*shown == net::SessionKeyOf(sealed, *key))) {
    return absl::UnauthenticatedError("session_key: is not that of the connect token");
  }
  return token->player.value();
}

absl::StatusOr<std::uint32_t> Cluster::AddPlayer(const v1::JoinInstanceRequest& request, InstanceEntry& instance) {
  records::Instance next = instance.record;
  const std::uint32_t number = next.last_player() + 1;
  next.set_last_player(number);
  v1::Player& player = *next.add_players();
  player.set_number(number);
  player.set_name(request.player_name());
  player.set_spawn_region(SpawnRegionOf(number, next, instance.map));
  if (absl::Status status = StoreInstance(instance, next); !status.ok()) return status;
  MarkOrders(instance);
  Changed(instance);
  return number;
}

// One that comes back is the player that it was: nothing about it has to be stored or told.
absl::StatusOr<std::uint32_t> Cluster::FindReturning(Moment now, const v1::JoinInstanceRequest& request,
                                                     const InstanceEntry& instance) const {
  const auto number = PlayerOf(now, instance, request.connect_token(), request.session_key());
  if (!number.ok()) return number.status();
  const auto& players = instance.record.players();
  const auto player =
      std::find_if(players.begin(), players.end(), [&](const v1::Player& p) { return p.number() == *number; });
  if (player == players.end() || player->left()) {
    return absl::FailedPreconditionError(absl::StrCat("connect_token: player ", *number, " has left for good"));
  }
  return *number;
}

absl::StatusOr<Cluster::Joined> Cluster::Join(Moment now, const v1::JoinInstanceRequest& request) {
  if (const absl::StatusOr<bool> can = CanJoin(request.instance_id()); !can.ok()) return can.status();
  InstanceEntry& instance = *FindInstance(request.instance_id());
  const auto key = net::InstanceKeyFrom(instance.record.key());
  if (!key.ok()) return key.status();
  const bool returns = !request.connect_token().empty();
  Joined joined;
  if (!returns) joined.mark = last_revision_;  // any order made from here on tells of the player
  const auto number = returns ? FindReturning(now, request, instance) : AddPlayer(request, instance);
  if (!number.ok()) return number.status();
  const std::uint64_t expires_unix_s =
      Seconds(now.unix_time) + static_cast<std::uint64_t>(kConnectTokenLifetime.count());
  const net::Credentials pass = net::Issue(
      {.instance_id = instance.record.id(), .player = PlayerNumber(*number), .expires_unix_s = expires_unix_s}, *key);
  joined.response.set_player(*number);
  joined.response.set_connect_token(std::string(pass.token.begin(), pass.token.end()));
  joined.response.set_session_key(pass.key.data(), pass.key.size());
  *joined.response.mutable_map() = instance.record.map();
  for (const WorkerEntry& worker : instance.workers) {
    v1::RegionAddress& address = *joined.response.add_regions();
    address = worker.report.address();
    address.clear_link_port();
    address.clear_metrics_port();
  }
  joined.response.set_scene_hash(instance.record.scene_hash());
  joined.response.set_tick_rate_hz(instance.record.tick_rate_hz());
  joined.response.set_snapshot_rate_hz(instance.record.snapshot_rate_hz());
  joined.response.set_expected_players(instance.record.expected_players());
  return joined;
}

bool Cluster::AllKnow(const std::string& instance_id, std::uint64_t mark) const {
  const InstanceEntry* instance = FindInstance(instance_id);
  return instance == nullptr ||
         std::all_of(instance->workers.begin(), instance->workers.end(), [mark](const WorkerEntry& worker) {
           return worker.gone || worker.report.order_revision() > mark;
         });
}

absl::Status Cluster::Leave(Moment now, const v1::LeaveInstanceRequest& request) {
  InstanceEntry* instance = FindInstance(request.instance_id());
  if (instance == nullptr) return NoInstance(request.instance_id());
  const auto number = PlayerOf(now, *instance, request.connect_token(), request.session_key());
  if (!number.ok()) return number.status();
  records::Instance next = instance->record;
  const auto player = std::find_if(next.mutable_players()->begin(), next.mutable_players()->end(),
                                   [&](const v1::Player& p) { return p.number() == *number; });
  if (player == next.mutable_players()->end() || player->left()) return absl::OkStatus();  // has left already
  player->set_left(true);
  instance->left[player->number()] = {last_revision_, now.steady};
  if (absl::Status status = StoreInstance(*instance, next); !status.ok()) return status;
  MarkOrders(*instance);
  Changed(*instance);
  return absl::OkStatus();
}

// Players who left are told to the workers for a while, then forgotten, so that a world with much coming and going
// stays small.
void Cluster::PrunePlayers(Moment now, InstanceEntry& instance) {
  std::set<std::uint32_t> forgotten;
  for (const v1::Player& player : instance.record.players()) {
    if (!player.left()) continue;
    // After a restart it is not known since when: from now on, then.
    const auto [mark, since] = instance.left.try_emplace(player.number(), last_revision_, now.steady).first->second;
    if (now.steady - since > settings_.keep_left_players && AllKnow(instance.record.id(), mark))
      forgotten.insert(player.number());
  }
  if (forgotten.empty()) return;
  records::Instance next = instance.record;
  auto& players = *next.mutable_players();
  players.erase(std::remove_if(players.begin(), players.end(),
                               [&](const v1::Player& p) { return forgotten.contains(p.number()); }),
                players.end());
  if (!StoreInstance(instance, next).ok()) return;
  for (const std::uint32_t number : forgotten) instance.left.erase(number);
  MarkOrders(instance);
}

}  // namespace tessera::control
