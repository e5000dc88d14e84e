// RestoreIntoEtcd: a backup becomes the store of several control planes. It is also the way of a cluster from a file of
// SQLite to etcd: a backup is the same whichever store it is made of.
//
// Thread rule: a free function; it blocks, for kEtcdRestorePatience and the time of the writes at most.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "control_plane/backup.h"
#include "control_plane/etcd/etcd_client.h"
#include "control_plane/etcd/etcd_election.h"

namespace tessera::control {

// How long it is tried to lead there, which is what writing to etcd takes.
inline constexpr std::chrono::seconds kEtcdRestorePatience{15};

// Leads under `prefix` for as long as it takes, so that no control plane begins a new cluster there meanwhile. Errors:
// those of RestoreBackup; FAILED_PRECONDITION also while a control plane leads there; UNAVAILABLE: etcd does not
// answer.
absl::StatusOr<RestoreReport> RestoreIntoEtcd(const EtcdClient& client, const std::string& prefix,
                                              const LeaderAddress& self, std::string_view backup,
                                              ElectionTimes times = {});

}  // namespace tessera::control
