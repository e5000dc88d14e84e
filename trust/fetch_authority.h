// The authority's certificate, from the control plane itself: it sends it with its own, and a fingerprint that came by
// another way says that it is the right one.
//
// Thread rule: any thread. Blocks until it has an answer or `timeout` is over.
#pragma once

#include <chrono>
#include <string>

#include "absl/status/statusor.h"
#include "host/socket_address.h"

namespace tessera::trust {

// PEM. UNAVAILABLE: nobody answers, or not by TLS. UNAUTHENTICATED: the server has no certificate of this authority.
absl::StatusOr<std::string> FetchAuthority(const host::SocketAddress& address, const std::string& fingerprint,
                                           std::chrono::milliseconds timeout);

}  // namespace tessera::trust
