#include "control_plane/cluster/host_rights.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"
#include "control_plane/secrets.h"
#include "control_plane/stored_records.h"

namespace tessera::control {
namespace {

// 0: any region.
bool HasPart(const records::Instance& record, const std::string& host_id, std::uint32_t region) {
  const auto& placements = record.placements();
  return std::any_of(placements.begin(), placements.end(), [&](const records::Placement& placement) {
    return placement.host_id() == host_id && (region == 0 || placement.region() == region);
  });
}

bool Uses(const records::Instance& record, const std::string& key) {
  const std::vector<std::string> keys = ContentKeys(record);
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

}  // namespace

absl::StatusOr<const HostEntry*> HostOfJoinToken(const ClusterState& state, const std::string& token, Now now) {
  const std::string hash = HashSecret(token);
  for (const auto& [number, host] : state.hosts()) {
    if (!HashMatches(hash, host.record.join_token_hash())) continue;
    // A token of an earlier release has no end.
    if (!host.record.has_join_token_expire_time() ||
        now.unix_time < FromTimestamp(host.record.join_token_expire_time())) {
      return &host;
    }
    return absl::UnauthenticatedError(
        absl::StrCat("hello.join_token: has run out; remove host ", host.record.name(), " and add it anew"));
  }
  return absl::UnauthenticatedError("hello.join_token: unknown, or used already");
}

absl::Status CheckMayFetchContent(const ClusterState& state, const std::string& host_id, const std::string& key,
                                  const char* field) {
  for (const auto& [number, instance] : state.instances()) {
    if (HasPart(instance.record, host_id, 0) && Uses(instance.record, key)) return absl::OkStatus();
  }
  return absl::NotFoundError(
      absl::StrCat(field, ": nothing that is placed on ", OneLine(host_id, kMaxNameBytes), " uses it"));
}

absl::Status CheckMayFetchState(const ClusterState& state, const std::string& host_id, const std::string& instance_id,
                                std::uint32_t region) {
  const InstanceEntry* instance = state.FindInstance(instance_id);
  if (instance != nullptr && region != 0 && HasPart(instance->record, host_id, region)) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat("region: ", OneLine(instance_id, kMaxNameBytes), "/", region,
                                          " is not placed on ", OneLine(host_id, kMaxNameBytes)));
}

}  // namespace tessera::control
