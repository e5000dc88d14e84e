// Cluster's calls about players: who is let in, and who is sent away.
#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/control_settings.h"
#include "control_plane/life.h"

namespace tessera::control {

absl::Status Cluster::BeginWait(Now now, const v1::JoinInstanceRequest& request) {
  const auto found = players_.BeginWait(request);
  if (!found.ok()) return found.status();
  reconciler_.Reconcile(now, **found);
  return absl::OkStatus();
}

int Cluster::WaitingPlayers(const std::string& instance_id) const {
  const InstanceEntry* instance = state().FindInstance(instance_id);
  return instance == nullptr ? 0 : players_.Waiting(*instance);
}

void Cluster::EndWait(Now now, const std::string& instance_id) {
  if (InstanceEntry* instance = players_.EndWait(instance_id)) reconciler_.Reconcile(now, *instance);
}

absl::StatusOr<std::optional<trust::Ticket>> Cluster::TakeTicket(Now now, const v1::JoinInstanceRequest& request,
                                                                 const std::optional<std::string>& stranger) {
  if (absl::StatusOr<bool> open = CanJoin(state(), request.instance_id(), request.viewer()); !open.ok()) {
    return open.status();
  }
  const InstanceEntry& instance = *state_->FindInstance(request.instance_id());
  if (absl::Status status = CheckGuest(instance.record, request, stranger.has_value()); !status.ok()) {
    return status;
  }
  if (request.ticket().empty()) {
    if (!stranger || !request.credential().empty()) return std::nullopt;
    if (absl::Status status = players_.TakeGuest(instance, request.viewer(), *stranger, now); !status.ok())
      return status;
    return std::nullopt;
  }
  absl::StatusOr<trust::Ticket> ticket = tickets_.Check(request.ticket(), instance.record, now);
  if (!ticket.ok()) return ticket.status();
  if (absl::Status status = bans_.Check(instance.record.id(), ticket->player_id); !status.ok()) return status;
  if (!request.viewer() && instance.players.FindId(ticket->player_id) == 0) {
    if (absl::Status status = CheckRoom(instance); !status.ok()) return status;
  }
  if (absl::Status status = tickets_.Use(*ticket, now); !status.ok()) return status;
  return std::optional(*std::move(ticket));
}

absl::StatusOr<Joined> Cluster::Join(Now now, const v1::JoinInstanceRequest& request,
                                     const std::optional<trust::Ticket>& ticket, bool stranger) {
  if (!ticket) return players_.Join(request, nullptr, now, stranger);
  // It may have been banned while it waited.
  if (absl::Status status = bans_.Check(request.instance_id(), ticket->player_id); !status.ok()) return status;
  return players_.Join(request, &*ticket, now, stranger);
}

absl::Status Cluster::Leave(Now now, const v1::LeaveInstanceRequest& request) { return players_.Leave(request, now); }

absl::StatusOr<v1::KickPlayerResponse> Cluster::KickPlayer(Now now, const v1::KickPlayerRequest& request) {
  InstanceEntry* instance = state_->FindInstance(request.id());
  if (instance == nullptr) return NoInstance("id", request.id());
  if (absl::Status status = CheckReason(request.reason()); !status.ok()) return status;
  std::uint32_t number = request.number();
  if (request.player_case() != v1::KickPlayerRequest::kNumber) {
    if (absl::Status status = CheckPlayerId(request.player_id()); !status.ok()) return status;
    number = instance->players.FindId(request.player_id());
    if (number == 0) {
      return absl::NotFoundError(absl::StrCat("player: ", request.player_id(), " does not play in ", request.id()));
    }
  }
  const auto kicked =
      players_.Kick(*instance, number, request.reason().empty() ? kKickedReason : request.reason(), now);
  if (!kicked.ok()) return kicked.status();
  v1::KickPlayerResponse response;
  response.set_number(*kicked);
  return response;
}

absl::StatusOr<v1::BanPlayerResponse> Cluster::BanPlayer(Now now, const v1::BanPlayerRequest& request) {
  const InstanceEntry* instance = state_->FindInstance(request.id());
  if (!request.id().empty() && instance == nullptr) return NoInstance("id", request.id());
  std::string player_id = request.player_id();
  if (request.player_case() == v1::BanPlayerRequest::kNumber) {
    if (instance == nullptr) return absl::InvalidArgumentError("number: is a player of an instance; give its id");
    const auto id = PlayerIdOf(*instance, request.number());
    if (!id.ok()) return id.status();
    player_id = *id;
  }
  const std::string reason = request.reason().empty() ? kBannedReason : request.reason();
  auto ban = bans_.Add(request.id(), player_id, reason, now);
  if (!ban.ok()) return ban.status();
  for (InstanceEntry& entry : state_->EachInstance()) {
    const std::uint32_t number = entry.players.FindId(player_id);
    if (number == 0 || IsFinal(entry.record.state()) || (instance != nullptr && &entry != instance)) continue;
    if (const auto kicked = players_.Kick(entry, number, reason, now); !kicked.ok()) return kicked.status();
  }
  v1::BanPlayerResponse response;
  response.mutable_ban()->Swap(&*ban);
  return response;
}

absl::Status Cluster::UnbanPlayer(const v1::UnbanPlayerRequest& request) {
  if (!request.id().empty() && state_->FindInstance(request.id()) == nullptr) return NoInstance("id", request.id());
  return bans_.Remove(request);
}

absl::StatusOr<v1::ListBansResponse> Cluster::ListBans(const v1::ListBansRequest& request) const {
  if (!request.id().empty() && state().FindInstance(request.id()) == nullptr) return NoInstance("id", request.id());
  return bans_.List(request.id());
}

}  // namespace tessera::control
