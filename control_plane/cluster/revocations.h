// Revocations: who is let in no more, as one list with a number that only grows: hosts that were removed, the lives of
// regions that evicted hosts ran, players' bans, access tokens that were revoked and issuers that were removed.
//
// The list is stored, signed with a key of the cluster's own, and sent to every agent, which keeps the newest and says
// so; until then workers of its host get no lease from here. So every host that may run anything has the list, and a
// control plane that begins from an old backup gets it back:
//
//   - A list with a higher number than the store's takes its place.
//   - A restored store counts its numbers on from far above (backup.h). Lists of the time that it has lost lie between:
//     while it recovers they take the place of what the backup had; one that a host brings later is added to what was
//     decided since. Then a ban that was lifted in that time may stand again, and nothing that was revoked is undone.
//
// Bans are sealed, and so are tokens and issuers: hosts are not shown players' ids, nor who had access.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"
#include "control_plane/secrets.h"
#include "net/signing_key.h"
#include "tessera/v1/revocations.pb.h"

namespace tessera::control {

// The content of the list.
struct Revoked {
  using Life = std::tuple<std::string, std::uint32_t, std::uint64_t>;  // instance, region, incarnation
  std::set<std::uint64_t> hosts;                                       // numbers in their ids
  std::set<Life> workers;
  std::map<std::pair<std::string, std::string>, records::Ban> bans;  // by instance, or "" for the cluster, and player
  std::map<std::string, records::RevokedToken> tokens;               // by the hash of the secret
  std::set<std::string> issuers;                                     // public keys
};

class Revocations {
 public:
  Revocations(ClusterState& state, RandomBytes random) : state_(state), random_(std::move(random)) {}

  // Makes the key at the first start. DATA_LOSS names the key of the store that cannot be read.
  absl::Status Load();

  const Revoked& revoked() const { return revoked_; }
  std::uint64_t number() const { return record_.number(); }
  const v1::SignedRevocations& newest() const { return newest_; }
  std::string public_key() const;

  // Stores `next` as the list with the next number, which goes to all hosts. RESOURCE_EXHAUSTED: it would be too large;
  // UNAVAILABLE: it could not be stored. Nothing has changed then.
  absl::Status Change(Revoked next);
  // The host and the workers that it runs are named from now on. Repeating it does nothing.
  absl::Status AddHost(const HostEntry& host);
  // The token is named until it would have run out. RESOURCE_EXHAUSTED: kMaxRevokedTokens are.
  absl::Status AddToken(const records::AccessToken& token, Now now);
  // The issuer of this public key is named, or not any more. RESOURCE_EXHAUSTED: kMaxRevokedIssuers are.
  absl::Status AddIssuer(const std::string& public_key);
  absl::Status LiftIssuer(const std::string& public_key);

  // --- What agents keep.
  // A list with this number may have what this one lacks.
  bool Lacks(std::uint64_t number) const;
  // True: it had, and this list has it now. INVALID_ARGUMENT, UNAUTHENTICATED, DATA_LOSS: it is none of this cluster's.
  absl::StatusOr<bool> TakeUp(const v1::SignedRevocations& list);
  bool KeptBy(const HostEntry& host) const { return host.kept_revocations >= number(); }

 private:
  absl::StatusOr<v1::SignedRevocations> Signed(const records::Revocations& record) const;
  absl::Status TakeOldBans(std::vector<StoreOp>& ops);
  absl::Status Store(records::Revocations next, Revoked content, std::vector<StoreOp> ops = {});
  void LeaveOutEnded(Revoked& content) const;

  ClusterState& state_;
  RandomBytes random_;
  net::SigningKey key_;
  records::Revocations record_;
  Revision revision_ = kAbsent;
  Revoked revoked_;               // as the record
  v1::SignedRevocations newest_;  // likewise
};

}  // namespace tessera::control
