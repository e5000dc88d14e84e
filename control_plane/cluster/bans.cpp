#include "control_plane/cluster/bans.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"
#include "core/world/player_name.h"
#include "core/world/utf8.h"
#include "trust/ticket.h"

namespace tessera::control {
namespace {

v1::Ban BanView(const records::Ban& record) {
  v1::Ban view;
  view.set_player_id(record.player_id());
  view.set_instance_id(record.instance_id());
  view.set_reason(record.reason());
  *view.mutable_create_time() = record.create_time();
  return view;
}

}  // namespace

absl::Status CheckPlayerId(const std::string& player_id) {
  if (player_id.empty() || player_id.size() > trust::kMaxTicketPlayerId) {
    return absl::InvalidArgumentError(
        absl::StrCat("player_id: ", player_id.size(), " bytes are not 1 to ", trust::kMaxTicketPlayerId));
  }
  if (!IsUtf8(player_id) || !HasNoControls(player_id)) {
    return absl::InvalidArgumentError("player_id: is not UTF-8, or has a control character");
  }
  return absl::OkStatus();
}

absl::Status CheckReason(const std::string& reason) {
  if (reason.size() > kMaxEndReasonBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("reason: ", reason.size(), " bytes are more than ", kMaxEndReasonBytes));
  }
  if (!IsUtf8(reason) || !HasNoControls(reason)) {
    return absl::InvalidArgumentError("reason: is not UTF-8, or has a control character");
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::Ban> Bans::Add(const std::string& instance_id, const std::string& player_id,
                                  const std::string& reason, Now now) {
  if (absl::Status status = CheckPlayerId(player_id); !status.ok()) return status;
  if (absl::Status status = CheckReason(reason); !status.ok()) return status;
  Revoked next = revocations_.revoked();
  records::Ban& ban = next.bans[{instance_id, player_id}];
  if (next.bans.size() > kMaxBans) {
    return absl::ResourceExhaustedError(absl::StrCat("there are ", bans().size(), " bans already; lift one first"));
  }
  ban.set_player_id(player_id);
  ban.set_instance_id(instance_id);
  ban.set_reason(reason);
  *ban.mutable_create_time() = ToTimestamp(now.unix_time);
  v1::Ban view = BanView(ban);
  if (absl::Status status = revocations_.Change(std::move(next)); !status.ok()) return status;
  return view;
}

absl::Status Bans::Remove(const v1::UnbanPlayerRequest& request) {
  Revoked next = revocations_.revoked();
  if (next.bans.erase({request.id(), request.player_id()}) == 0) {
    return absl::NotFoundError(absl::StrCat("player_id: ", OneLine(request.player_id(), trust::kMaxTicketPlayerId),
                                            " is not banned ", request.id().empty() ? "in the cluster" : "there"));
  }
  return revocations_.Change(std::move(next));
}

v1::ListBansResponse Bans::List(const std::string& instance_id) const {
  v1::ListBansResponse response;
  for (auto it = bans().lower_bound({instance_id, ""}); it != bans().end() && it->first.first == instance_id; ++it) {
    *response.add_bans() = BanView(it->second);
  }
  return response;
}

// A ban that cannot be left out belongs to an instance that never comes again, and counts against the most.
void Bans::ForgetInstance(const std::string& instance_id) {
  const auto of_instance = [&](const auto& ban) { return ban.first.first == instance_id; };
  if (std::none_of(bans().begin(), bans().end(), of_instance)) return;
  Revoked next = revocations_.revoked();
  std::erase_if(next.bans, of_instance);
  (void)revocations_.Change(std::move(next));
}

absl::Status Bans::Check(const std::string& instance_id, const std::string& player_id) const {
  const std::string* reason = ReasonOf(instance_id, player_id);
  if (reason == nullptr) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat("player: is banned: ", *reason));
}

const std::string* Bans::ReasonOf(const std::string& instance_id, const std::string& player_id) const {
  for (const std::string& where : {instance_id, std::string()}) {
    if (const auto found = bans().find({where, player_id}); found != bans().end()) return &found->second.reason();
  }
  return nullptr;
}

}  // namespace tessera::control
