#include "control_plane/cluster/known_callers.h"

#include "control_plane/cluster/host_rights.h"
#include "control_plane/cluster/hosts.h"

namespace tessera::control {

std::unique_ptr<const ClusterState> ClusterState::CallersPicture() const {
  std::unique_ptr<ClusterState> picture(new ClusterState(store_));
  picture->counters_ = counters_;
  picture->set_aside_ = set_aside_;
  for (const auto& [number, host] : hosts_) {
    HostEntry& entry = picture->hosts_[number];
    entry.number = number;
    entry.record.set_id(host.record.id());
    entry.record.set_name(host.record.name());
    entry.record.set_join_token_hash(host.record.join_token_hash());
    if (host.record.has_join_token_expire_time()) {
      *entry.record.mutable_join_token_expire_time() = host.record.join_token_expire_time();
    }
    entry.record.set_certificate_serial(host.record.certificate_serial());
  }
  return picture;
}

KnownCallers::KnownCallers(const ClusterState& state, const AccessTokens& tokens)
    : hosts_(state.CallersPicture()), tokens_(tokens.ByHash()) {}

const records::AccessToken* KnownCallers::FindToken(std::string_view secret, Now now) const {
  return control::FindToken(tokens_, secret, now);
}

absl::Status KnownCallers::CheckJoinToken(const std::string& token, Now now) const {
  return HostOfJoinToken(*hosts_, token, now).status();
}

absl::Status KnownCallers::CheckCertificate(const std::string& host_id, const std::string& serial) const {
  return CheckHostCertificate(*hosts_, host_id, serial);
}

}  // namespace tessera::control
