// KnownCallers: who calls at the doors that speak TLS, by what a call shows. It is a picture of the cluster's tokens
// and hosts, which never changes: a change of either makes another one, so calls are judged without the cluster's lock,
// also while a slow write holds that.
//
//   const std::shared_ptr<const KnownCallers> known = plane.known_callers();
//   if (const records::AccessToken* token = known->FindToken(secret, now)) ...
//
// Promise: once a call that revokes a token, or removes a host, has returned, no picture that is asked for still has
// it. Thread rule: any thread.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "control_plane/cluster/access_tokens.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"

namespace tessera::control {

class KnownCallers {
 public:
  KnownCallers(const ClusterState& state, const AccessTokens& tokens);

  // The token that the secret proves, which lives as long as this. Null: none does, or it has run out.
  const records::AccessToken* FindToken(std::string_view secret, Now now) const;
  // Errors as HostOfJoinToken's.
  absl::Status CheckJoinToken(const std::string& token, Now now) const;
  // Errors as CheckHostCertificate's.
  absl::Status CheckCertificate(const std::string& host_id, const std::string& serial) const;

 private:
  const std::unique_ptr<const ClusterState> hosts_;
  const TokensByHash tokens_;
};

}  // namespace tessera::control
