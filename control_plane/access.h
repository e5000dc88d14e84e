// Access: which caller may call which method at which door.
//
//   CallerOfToken/... -> CheckAccess(Door::kOperators, caller, "/tessera.v1.HostService/AddHost")
//
// The table in access.cpp has every method; one that it lacks is an administrator's.
//
// Thread rule: free functions on values.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "tessera/v1/access.pb.h"

namespace tessera::control {

enum class Door : std::uint8_t {
  kSocket,     // a socket of this machine; the kernel lets the same user in, and root
  kOperators,  // TLS: people and programs with tokens, agents with certificates
  kPlayers,    // TLS: everybody
};

struct Caller {
  Door door = Door::kSocket;
  v1::Role role = v1::ROLE_UNSPECIFIED;  // as a token says
  std::string token;                     // its name
  std::string instances;                 // prefix of the ids of those that it is for; empty: all
  std::string host_id;                   // as a certificate of the cluster's authority says
  bool may_join = false;                 // it shows a host's join token that stands

  // For the log: "local", "token/ada", "host-3", "player", "nobody".
  std::string Name() const;
};

// UNAUTHENTICATED: a proof is missing. PERMISSION_DENIED: that proof does not suffice. Both say what would.
absl::Status CheckAccess(const Caller& caller, std::string_view method);

// Whether a token for the instances `prefix` is for the one with this id. After a digit at its end none follows:
// "inst-1" is for inst-1 and not for inst-12.
bool IsFor(std::string_view prefix, std::string_view id);
// PERMISSION_DENIED unless the caller's token is for this instance, whether there is one or not. Whatever names an
// instance asks it; CheckAccess has refused what concerns the whole cluster. UNAUTHENTICATED: the token was revoked
// since then.
absl::Status CheckInstance(const Caller& caller, std::string_view id);
// Whether CheckInstance lets the caller have every instance.
bool HasAllInstances(const Caller& caller);

}  // namespace tessera::control
