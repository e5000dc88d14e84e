// KeptRevocations: the newest list of revocations that came to this host, on its disk.
//
// A list counts if the cluster's key has signed it, and takes the place of one with a lower number, never of one with a
// higher. So the host knows who is let in no more whatever the control plane has forgotten, and can give it back.
//
//   KeptRevocations kept(state_dir);
//   kept.Begin(identity.revocations_key());
//   if (kept.Take(list).ok()) say that kept.number() is kept
//
// Thread rule: one owner. `state` outlives it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "agent/state_dir.h"
#include "tessera/v1/failover.pb.h"
#include "tessera/v1/revocations.pb.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::agent {

// Lives of regions that are let in no more, by instance.
using RevokedLives = std::map<std::string, std::vector<v1::DeadRegion>>;
// Those of the order's instance, and no others.
void WriteRevoked(const RevokedLives& lives, v1::WorkerOrder& order);

class KeptRevocations {
 public:
  explicit KeptRevocations(const StateDir& state) : state_(state) {}

  // Reads the list on the disk. DATA_LOSS: it is not what an agent of this cluster wrote, and counts for nothing.
  absl::Status Begin(const std::string& key);
  // Keeps the list, if it is newer; the one that is kept already is fine. FAILED_PRECONDITION: it is older;
  // INVALID_ARGUMENT, UNAUTHENTICATED: it is none of this cluster's; UNAVAILABLE: the disk does not take it.
  absl::Status Take(const v1::SignedRevocations& list);

  std::uint64_t number() const { return content_.number(); }  // 0: none is kept
  const v1::SignedRevocations& newest() const { return newest_; }
  RevokedLives lives() const;

 private:
  const StateDir& state_;
  std::string key_;
  v1::SignedRevocations newest_;
  v1::Revocations content_;
};

}  // namespace tessera::agent
