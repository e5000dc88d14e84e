// An instance begins anew from the tick after which it stands: see cluster/upgrades.h.
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/branches.h"
#include "control_plane/control_plane.h"
#include "spdlog/spdlog.h"

namespace tessera::control {

using Clock = std::chrono::steady_clock;

absl::StatusOr<v1::UpgradeInstanceResponse> ControlPlane::UpgradeInstance(const v1::UpgradeInstanceRequest& request,
                                                                          const std::function<bool()>& given_up) {
  if (!files_) {
    return absl::FailedPreconditionError("this control plane keeps no checkpoints, and an upgrade needs one");
  }
  const std::string& id = request.id();
  const auto begun =
      Call([&](Cluster& cluster, Now now) { return cluster.BeginUpgrade(now, id, request.validate_only()); });
  if (!begun.ok()) return begun.status();
  v1::UpgradeInstanceResponse response;
  *response.mutable_instance() = *begun;
  if (request.validate_only()) return response;
  const auto tick = AwaitUpgradeTick(id, given_up);
  auto renewed = tick.ok() ? BeginAnew(id, *tick, given_up) : tick.status();
  if (!renewed.ok()) {
    const std::string why = absl::StrCat("not upgraded: ", renewed.status().message());
    spdlog::warn("instance {} id={}", why, id);
    const absl::Status ended = Call([&](Cluster& cluster, Now now) { return cluster.EndUpgrade(now, id, why); });
    if (!ended.ok()) spdlog::error("instance stands for now id={}: {}", id, std::string(ended.message()));
    return renewed.status();
  }
  *response.mutable_instance() = *std::move(renewed);
  response.set_tick(*tick);
  return response;
}

absl::StatusOr<std::uint64_t> ControlPlane::AwaitUpgradeTick(const std::string& id,
                                                             const std::function<bool()>& given_up) {
  Lock lock(mutex_);
  Watch watch(*this, id);
  const Clock::time_point patience = Clock::now() + kUpgradePatience;
  while (true) {
    const auto tick = cluster_->UpgradeTick(id);
    if (!tick.ok()) return tick.status();
    if (tick->has_value()) return **tick;
    if (Clock::now() >= patience) {
      return absl::DeadlineExceededError(absl::StrCat("id: the regions of ", id, " did not come to stand in ",
                                                      std::chrono::seconds(kUpgradePatience).count(), " s"));
    }
    if (absl::Status status = WaitFor(lock, watch, patience, given_up); !status.ok()) return status;
  }
}

// From the checkpoint of the tick after which it stands, which is made unless it is there already.
absl::StatusOr<v1::Instance> ControlPlane::BeginAnew(const std::string& id, std::uint64_t tick,
                                                     const std::function<bool()>& given_up) {
  std::vector<std::string> damaged;
  const bool there = Call([&](Cluster& cluster, Now) {
    const InstanceEntry* instance = cluster.state().FindInstance(id);
    return instance != nullptr && KeptOf(instance->record.checkpoints(), tick) != nullptr;
  });
  auto manifest = there ? FindWhole(id, tick, damaged) : absl::NotFoundError("tick: no checkpoint is made yet");
  if (!manifest.ok()) {
    v1::CheckpointInstanceRequest make;
    make.set_id(id);
    if (const auto made = CheckpointInstance(make, given_up); !made.ok()) return made.status();
    manifest = FindWhole(id, tick, damaged);
  }
  if (!manifest.ok()) return manifest.status();
  const auto contents = KeptContents(id, *manifest);
  if (!contents.ok()) return contents.status();
  return Call([&](Cluster& cluster, Now now) { return cluster.FinishUpgrade(now, id, *manifest, *contents); });
}

}  // namespace tessera::control
