// Issuers: the games' backends whose tickets this cluster believes, by their public keys.
//
// The cluster's id is drawn with the first issuer, and stays: every ticket has it, so another cluster's is worth
// nothing here.
//
// Thread rule: as Cluster.
#pragma once

#include <map>
#include <set>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"
#include "control_plane/secrets.h"
#include "tessera/v1/access.pb.h"
#include "trust/ticket.h"

namespace tessera::control {

class Issuers {
 public:
  Issuers(ClusterState& state, RandomBytes random) : state_(state), random_(std::move(random)) {}

  // DATA_LOSS names the key that cannot be read.
  absl::Status Load();
  absl::StatusOr<v1::AddIssuerResponse> Add(const v1::AddIssuerRequest& request, Now now);
  v1::ListIssuersResponse List() const;
  absl::Status Remove(const v1::RemoveIssuerRequest& request);
  // Null: there is none of that name.
  const records::Issuer* Named(const std::string& name) const;
  // Those whose public keys `revoked` names sign nothing from now on. What the store does not take, the next call tries
  // again.
  void Drop(const std::set<std::string>& revoked);
  // OK: Add would take it, if the store does.
  absl::Status CheckRequest(const v1::AddIssuerRequest& request) const;

  // The issuer whose key has this id; null: none.
  const records::Issuer* Find(const trust::TicketKeyId& key) const;
  // Empty: nobody was ever an issuer here.
  const std::string& cluster_id() const { return cluster_id_; }

 private:
  struct Entry {
    records::Issuer record;
    Revision revision = kAbsent;
  };
  ClusterState& state_;
  RandomBytes random_;
  std::string cluster_id_;
  std::map<std::string, Entry> issuers_;             // by name
  std::map<trust::TicketKeyId, std::string> names_;  // by the id of the key
};

}  // namespace tessera::control
