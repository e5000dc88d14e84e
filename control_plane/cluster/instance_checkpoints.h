// InstanceCheckpoints: when they are made, what they consist of, and worlds that have to be brought back from one. The
// files are ControlPlane's.
//
// One is made at a tick that all regions are still to reach: each uploads its file of that tick, and with the last one
// the manifest is complete. A change of who runs what on the way abandons it, as its files would not be the whole
// world. A draft is not stored: after a restart of the control plane the checkpoint is begun anew.
//
// A restore takes back what came after the tick that it goes to (branches.h).
//
// Those that are kept of a world take no more than the quota: the oldest go before their number says so, and one that
// alone is larger is not made. The world runs on with those that it has, and its events say it once.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"
#include "control_plane/placement.h"
#include "tessera/v1/agent_link.pb.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

class InstanceCheckpoints {
 public:
  // `quota`: bytes that those of one world may take; 0: as many as they need.
  explicit InstanceCheckpoints(ClusterState& state, std::uint64_t quota = 0) : state_(state), quota_(quota) {}
  void Forget(std::uint64_t number) { work_.erase(number); }

  // --- Making one.
  // The tick of the checkpoint of a RUNNING instance that is being made from here on, or was already. ABORTED while who
  // runs what is being changed.
  absl::StatusOr<std::uint64_t> Begin(InstanceEntry& instance, Now now);
  // The tick of the checkpoint that is being made; 0 if none is.
  std::uint64_t UnderWay(const InstanceEntry& instance) const;
  // Why the last one that was not made was not; never OK. ABORTED: who runs what was changed, or the world began anew;
  // another one can be begun.
  absl::Status WhyNotMade(const InstanceEntry& instance) const;
  // FAILED_PRECONDITION: nobody waits for that file. RESOURCE_EXHAUSTED: with it the checkpoint is larger than the
  // quota, and it is abandoned.
  absl::Status CheckUpload(const v1::UploadCheckpointRequest& request, Now now);
  // RESOURCE_EXHAUSTED: a checkpoint of so many bytes is larger than the quota.
  absl::Status CheckQuota(std::uint64_t bytes) const;
  // The file is on the disk. Returns the manifest if it was the last one.
  std::optional<records::Manifest> NoteUploaded(const v1::UploadCheckpointRequest& request);
  // All files are on the disk, `size` bytes: lists the checkpoint, and prunes the oldest. One that is larger than the
  // quota is removed instead.
  void NoteMade(InstanceEntry& instance, const records::Manifest& manifest, std::uint64_t size, Now now);
  // Time passes: begins one when it is due, abandons one that cannot be finished.
  void Step(InstanceEntry& instance, Now now);

  // --- Worlds that are lost without one.
  // The world cannot go on from its workers, which have died, or are not to be had. With a checkpoint it is to be
  // restored, and the next record is nothing; without one it has failed. One that dies again and again begins from an
  // older one, and stops when there is none.
  enum class Cause { kDied, kNotToBeHad };
  std::optional<records::Instance> GiveUp(InstanceEntry& instance, Cause cause, const std::string& why, Now now);
  // The checkpoint that a wanted restore begins from is older than this tick; 0: any is fine.
  std::uint64_t RestoreBefore(const InstanceEntry& instance) const;
  // Time passes: asks again for a restore that could not be made.
  void RetryRestore(const InstanceEntry& instance, Now now);
  // A wanted restore cannot be made now, and is tried again.
  void NoteRestoreWaits(InstanceEntry& instance, const std::string& why);
  // The record of a world that starts again from the checkpoint, with what that costs.
  records::Instance Restored(const InstanceEntry& instance, const records::Manifest& manifest,
                             const PlacementPlan& placed, Now now) const;
  // The world starts again, or has failed: nothing is under way any more.
  void Restarted(InstanceEntry& instance);
  // An instance that has failed lets its checkpoints go: it is forgotten in time like all that have ended.
  absl::Status Drop(InstanceEntry& instance);

  // --- Reading.
  // NOT_FOUND unless the instance starts from that checkpoint.
  absl::Status CheckFetch(const v1::FetchStateRequest& request) const;

 private:
  struct Draft {
    std::uint64_t tick = 0;
    Steady since{0};
    std::uint64_t map_version = 0;
    std::map<std::uint32_t, records::ManifestFile> files;  // by region: those that are on the disk
  };
  struct Work {
    std::optional<Draft> draft;
    absl::Status not_made = absl::AbortedError("none was begun");  // as WhyNotMade
    int failures = 0;                                              // in a row that a worker reported
    Steady next{0};                                                // when the next one is due; 0: not yet reckoned
    Steady restore_again_at{0};
    std::uint64_t restore_before = 0;  // as RestoreBefore
    bool died = false;                 // the wanted restore counts
    bool fewer_said = false;           // that the quota keeps fewer of them than were asked for
  };

  absl::StatusOr<std::uint64_t> BeginStanding(InstanceEntry& instance, Now now);
  const Draft* DraftOf(const InstanceEntry& instance, std::uint64_t tick) const;
  void Abandon(InstanceEntry& instance, const absl::Status& why, Now now);
  void NoteOverQuota(InstanceEntry& instance, const absl::Status& why, Now now);
  // Drops what is too many or too much from the list, what was taken back first, then the oldest, and returns its
  // ticks. One stays.
  std::vector<std::uint64_t> Prune(Work& work, records::Instance& next, Now now) const;

  ClusterState& state_;
  const std::uint64_t quota_;
  std::map<std::uint64_t, Work> work_;  // by instance number
};

}  // namespace tessera::control
