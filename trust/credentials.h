// The proofs that a program shows a control plane, and the place where it reaches it.
#pragma once

#include <string>
#include <utility>

namespace tessera::trust {

struct Credentials {
  // Certificate of the cluster's authority; empty: as the address' fingerprint says. With both they must agree.
  std::string authority;
  std::string certificate, key;  // a host's; empty: none
  std::string bearer_token;      // a person's or program's; empty: none
};

// An address stands for itself with no credentials, as a socket needs none.
struct ControlPoint {
  ControlPoint() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): most control points are nothing but their address
  ControlPoint(std::string at, Credentials shown = {}) : address(std::move(at)), credentials(std::move(shown)) {}

  std::string address;  // as ParseControlAddress takes it
  Credentials credentials;
};

}  // namespace tessera::trust
