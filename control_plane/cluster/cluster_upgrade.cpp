// How a world is upgraded: see upgrades.h. It begins anew with programs of the newest release that hosts have for it.
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/cluster/views.h"

namespace tessera::control {

absl::StatusOr<v1::Instance> Cluster::BeginUpgrade(Now now, const std::string& id, bool validate_only) {
  const auto found = FindRunning(*state_, id);
  if (!found.ok()) return found.status();
  auto begun = Ask(now, **found, Upgrades::Begin(**found, now), validate_only);
  if (begun.ok() && !validate_only) upgrades_.Begun((*found)->number);
  return begun;
}

absl::StatusOr<std::optional<std::uint64_t>> Cluster::UpgradeTick(const std::string& id) const {
  const InstanceEntry* instance = state().FindInstance(id);
  if (instance == nullptr) return NoInstance("id", id);
  if (!instance->record.has_upgrade() || instance->record.state() != v1::INSTANCE_STATE_RUNNING) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", id, " is not being upgraded any more"));
  }
  return Upgrades::Tick(*instance);
}

absl::StatusOr<v1::Instance> Cluster::FinishUpgrade(Now now, const std::string& id, const records::Manifest& manifest,
                                                    const Contents& contents) {
  if (const auto tick = UpgradeTick(id); !tick.ok()) return tick.status();
  InstanceEntry& instance = *state_->FindInstance(id);
  const auto next = upgrades_.End(instance, absl::StrCat("upgraded: begins anew after tick ", manifest.tick()), now);
  // Workers hear of both at once: no tick is made between them.
  if (absl::Status status = state_->StoreInstance(instance, *next); !status.ok()) return status;
  auto restored = Restore(now, id, manifest, contents, false, ReleaseChoice::kNewest);
  if (!restored.ok()) {
    state_->MarkOrders(instance);
    state_->MarkChanged(instance);
    reconciler_.Reconcile(now, instance);
  }
  return restored;
}

absl::Status Cluster::EndUpgrade(Now now, const std::string& id, const std::string& why) {
  InstanceEntry* instance = state_->FindInstance(id);
  if (instance == nullptr) return absl::OkStatus();
  return StoreUpgradeEnd(now, *instance, upgrades_.End(*instance, why, now));
}

absl::Status Cluster::StoreUpgradeEnd(Now now, InstanceEntry& instance, const std::optional<records::Instance>& next) {
  if (!next) return absl::OkStatus();
  return Ask(now, instance, next, false).status();
}

}  // namespace tessera::control
