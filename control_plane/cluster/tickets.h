// Tickets: who shows one that counts, and that each is shown once.
//
// A ticket counts if an issuer that stands has signed it, for this cluster and instance, not long ago, and its number
// is higher than that of every ticket of the same player and issuer before. So a copy of one that was shown is worth
// nothing. Numbers are stored before a player is let in, and kept until every ticket as old has run out by its time.
//
// Thread rule: as Cluster.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/cluster/issuers.h"
#include "control_plane/now.h"
#include "trust/ticket.h"

namespace tessera::control {

class Tickets {
 public:
  Tickets(ClusterState& state, const Issuers& issuers) : state_(state), issuers_(issuers) {}

  // DATA_LOSS names the key that cannot be read.
  absl::Status Load(Now now);
  // Whether a ticket counts for the instance, but for storing it as used. Errors begin with "ticket: ":
  // INVALID_ARGUMENT, it is none; UNAUTHENTICATED, it does not count here or now.
  absl::StatusOr<trust::Ticket> Check(const std::string& text, const records::Instance& record, Now now) const;
  // Uses up a ticket that Check has returned. UNAUTHENTICATED: it was, or a newer one; RESOURCE_EXHAUSTED: too many are
  // remembered.
  absl::Status Use(const trust::Ticket& ticket, Now now);
  // Time passes.
  void Prune(Now now);

  std::size_t remembered() const { return used_.size(); }

 private:
  struct Used {
    std::uint64_t number = 0;
    Steady since{0};  // time of the newest; in a new life of the control plane, its beginning
    Revision revision = kAbsent;
  };

  bool IsOld(const records::Issuer& issuer, const trust::Ticket& ticket) const;

  ClusterState& state_;
  const Issuers& issuers_;
  std::map<std::string, Used> used_;                     // by key in the store
  std::deque<std::pair<Steady, std::string>> in_order_;  // each use, the oldest first
};

// Whether the issuer has signed it; null: no issuer has its key. It takes a while (70 us), so who has the record does
// it before the cluster's lock is taken: forged tickets cost nobody else's time.
absl::Status CheckSignature(const trust::ShownTicket& shown, const records::Issuer* issuer);

}  // namespace tessera::control
