// Bans: players who are let in no more, by the ids of their tickets: in one instance, or in the whole cluster.
//
// They are part of the list of revocations (revocations.h), so no old backup lifts one. Those of an instance go with
// it.
//
// Thread rule: as Cluster.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "control_plane/cluster/revocations.h"
#include "control_plane/now.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

class Bans {
 public:
  explicit Bans(Revocations& revocations) : revocations_(revocations) {}

  // `instance_id` empty: of the whole cluster. A ban that stands gets the new reason. INVALID_ARGUMENT names the field;
  // RESOURCE_EXHAUSTED: there are too many.
  absl::StatusOr<v1::Ban> Add(const std::string& instance_id, const std::string& player_id, const std::string& reason,
                              Now now);
  absl::Status Remove(const v1::UnbanPlayerRequest& request);
  v1::ListBansResponse List(const std::string& instance_id) const;
  void ForgetInstance(const std::string& instance_id);

  // PERMISSION_DENIED with the reason if the player is banned there, or in the whole cluster.
  absl::Status Check(const std::string& instance_id, const std::string& player_id) const;
  // The reason of that ban; null: there is none.
  const std::string* ReasonOf(const std::string& instance_id, const std::string& player_id) const;

 private:
  const auto& bans() const { return revocations_.revoked().bans; }

  Revocations& revocations_;
};

// INVALID_ARGUMENT "player_id: ..." unless it is one that tickets may have.
absl::Status CheckPlayerId(const std::string& player_id);
// INVALID_ARGUMENT "reason: ..." unless it is one line that clients can be sent.
absl::Status CheckReason(const std::string& reason);

}  // namespace tessera::control
