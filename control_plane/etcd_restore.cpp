#include "control_plane/etcd_restore.h"

#include "absl/strings/str_cat.h"
#include "control_plane/etcd/etcd_store.h"

namespace tessera::control {

absl::StatusOr<RestoreReport> RestoreIntoEtcd(const EtcdClient& client, const std::string& prefix,
                                              const LeaderAddress& self, std::string_view backup, ElectionTimes times) {
  EtcdElection election(client, prefix, self, times);
  bool others_lead = false;
  const auto until = EtcdElection::Clock::now() + kEtcdRestorePatience;
  const auto fence = election.Campaign([&](const auto& leader) { others_lead = leader.has_value(); },
                                       [&] { return others_lead || EtcdElection::Clock::now() > until; });
  if (others_lead) {
    return absl::FailedPreconditionError(
        absl::StrCat("backup: a control plane leads at ", prefix, " in etcd; end all of them, or name another prefix"));
  }
  if (absl::IsCancelled(fence.status())) {
    return absl::UnavailableError(absl::StrCat("backup: nobody could be elected at ", prefix, " in etcd in time"));
  }
  if (!fence.ok()) return fence.status();
  const auto store = EtcdStore::Open(client, prefix, *fence, [&election] { election.Abandon(); });
  if (!store.ok()) return store.status();
  return RestoreBackup(backup, **store);
}

}  // namespace tessera::control
