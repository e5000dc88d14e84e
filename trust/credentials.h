// What a program shows a control plane, and where it reaches it.
#pragma once

#include <string>
#include <utility>

namespace tessera::trust {

struct Credentials {
  // Certificate of the cluster's authority; empty: as the address' fingerprint says. With both they must agree.
  std::string authority;
  std::string certificate, key;  // of a host; empty: none
  std::string bearer_token;      // of a person or program; empty: none
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
