#include "control_plane/cluster/bans.h"

#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"
#include "control_plane/secrets.h"
#include "core/world/player_name.h"
#include "core/world/utf8.h"
#include "trust/ticket.h"

namespace tessera::control {
namespace {

constexpr char kBanPrefix[] = "ban/";

std::string BanKey(const std::string& instance_id, const std::string& player_id) {
  // Ids of instances have no zero byte.
  return kBanPrefix + absl::BytesToHexString(HashSecret(instance_id + std::string(1, '\0') + player_id));
}

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

absl::Status Bans::Load() {
  const auto entries = state_.ListStored(kBanPrefix);
  if (!entries.ok()) return entries.status();
  for (const StoreEntry& stored : *entries) {
    Entry entry{.record = {}, .revision = stored.revision};
    if (!entry.record.ParseFromString(stored.value) ||
        stored.key != BanKey(entry.record.instance_id(), entry.record.player_id())) {
      return absl::DataLossError(absl::StrCat("store: ", stored.key, ": cannot be read"));
    }
    bans_.emplace(std::pair(entry.record.instance_id(), entry.record.player_id()), std::move(entry));
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::Ban> Bans::Add(const std::string& instance_id, const std::string& player_id,
                                  const std::string& reason, Now now) {
  if (absl::Status status = CheckPlayerId(player_id); !status.ok()) return status;
  if (absl::Status status = CheckReason(reason); !status.ok()) return status;
  const auto known = bans_.find({instance_id, player_id});
  if (known == bans_.end() && bans_.size() >= kMaxBans) {
    return absl::ResourceExhaustedError(absl::StrCat("there are ", bans_.size(), " bans already; lift one first"));
  }
  Entry entry;
  entry.record.set_player_id(player_id);
  entry.record.set_instance_id(instance_id);
  entry.record.set_reason(reason);
  *entry.record.mutable_create_time() = ToTimestamp(now.unix_time);
  const std::vector<StoreOp> ops{PutOp(BanKey(instance_id, player_id), entry.record.SerializeAsString(),
                                       known == bans_.end() ? kAbsent : known->second.revision)};
  const auto written = state_.WriteStored(ops);
  if (!written.ok()) return written.status();
  entry.revision = *written;
  v1::Ban view = BanView(entry.record);
  bans_[{instance_id, player_id}] = std::move(entry);
  return view;
}

absl::Status Bans::Remove(const v1::UnbanPlayerRequest& request) {
  const auto found = bans_.find({request.id(), request.player_id()});
  if (found == bans_.end()) {
    return absl::NotFoundError(absl::StrCat("player_id: ", OneLine(request.player_id(), trust::kMaxTicketPlayerId),
                                            " is not banned ", request.id().empty() ? "in the cluster" : "there"));
  }
  const std::vector<StoreOp> ops{DeleteOp(BanKey(request.id(), request.player_id()), found->second.revision)};
  if (const auto written = state_.WriteStored(ops); !written.ok()) return written.status();
  bans_.erase(found);
  return absl::OkStatus();
}

v1::ListBansResponse Bans::List(const std::string& instance_id) const {
  v1::ListBansResponse response;
  for (auto it = bans_.lower_bound({instance_id, ""}); it != bans_.end() && it->first.first == instance_id; ++it) {
    *response.add_bans() = BanView(it->second.record);
  }
  return response;
}

// A ban that cannot be deleted belongs to an instance that never comes again, and counts against the most.
void Bans::ForgetInstance(const std::string& instance_id) {
  std::vector<StoreOp> ops;
  const auto begin = bans_.lower_bound({instance_id, ""});
  auto end = begin;
  for (; end != bans_.end() && end->first.first == instance_id; ++end) {
    ops.push_back(DeleteOp(BanKey(instance_id, end->first.second), end->second.revision));
  }
  if (!ops.empty() && state_.WriteStored(ops).ok()) bans_.erase(begin, end);
}

absl::Status Bans::Check(const std::string& instance_id, const std::string& player_id) const {
  for (const std::string& where : {instance_id, std::string()}) {
    const auto found = bans_.find({where, player_id});
    if (found == bans_.end()) continue;
    return absl::PermissionDeniedError(absl::StrCat("player: is banned: ", found->second.record.reason()));
  }
  return absl::OkStatus();
}

}  // namespace tessera::control
