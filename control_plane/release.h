// Releases that work together: a control plane and the agents of the release before and after it, so that a cluster is
// upgraded one program after the other while worlds run. Further apart, one would not know what the other relies on.
//
// Messages themselves may have fields that the other side does not know: both pass over them.
//
// Thread rule: a free function.
#pragma once

#include <string_view>

#include "absl/status/status.h"

namespace tessera::control {

// FAILED_PRECONDITION: more than one release lies between them; INVALID_ARGUMENT: the agent's is no release. Releases
// are "0.1.0"; before 1.0 the second number counts them, from then on the first. An empty `own` takes any.
absl::Status CheckRelease(std::string_view agents, std::string_view own);

}  // namespace tessera::control
