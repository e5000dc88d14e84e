// AccessTokens: the rights of people and programs at the operators' door, by the secrets that prove them.
//
// Only hashes of secrets are stored. A token that has run out proves nothing, and stays listed until it is revoked.
//
// Thread rule: as Cluster.
#pragma once

#include <map>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"
#include "control_plane/secrets.h"
#include "tessera/v1/access.pb.h"

namespace tessera::control {

// Tokens by the hashes of their secrets.
using TokensByHash = std::map<std::string, records::AccessToken>;
// The token that the secret proves. Null: none does, or it has run out.
const records::AccessToken* FindToken(const TokensByHash& tokens, std::string_view secret, Now now);

class AccessTokens {
 public:
  AccessTokens(ClusterState& state, RandomBytes random) : state_(state), random_(std::move(random)) {}

  // DATA_LOSS names the key that cannot be read.
  absl::Status Load();
  absl::StatusOr<v1::CreateTokenResponse> Create(const v1::CreateTokenRequest& request, Now now);
  v1::ListTokensResponse List() const;
  absl::Status Revoke(const v1::RevokeTokenRequest& request);
  // Null: there is none of that name.
  const records::AccessToken* Named(const std::string& name) const;
  // Those that `revoked` names prove nothing from now on. What the store does not take, the next call tries again.
  void Drop(const std::map<std::string, records::RevokedToken>& revoked);
  // The token that the secret proves. Null: none does, or it has run out.
  const records::AccessToken* Find(std::string_view secret, Now now) const;
  // All that prove anything, for a picture.
  TokensByHash ByHash() const;

 private:
  struct Entry {
    records::AccessToken record;
    Revision revision = kAbsent;
  };
  ClusterState& state_;
  RandomBytes random_;
  std::map<std::string, Entry> tokens_;       // by name
  std::map<std::string, std::string> names_;  // by the secret's hash
};

}  // namespace tessera::control
