// Releases that work together: a control plane and the agents of the release before and after it, so that a cluster is
// upgraded one program after the other while worlds run. Further apart, one would not know what the other relies on.
//
// Messages themselves may have fields that the other side does not know: both pass over them.
//
// Thread rule: free functions.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "google/protobuf/repeated_ptr_field.h"

namespace tessera::control {

// The release of worlds and agents that say none: of before they did.
inline constexpr const char* kFirstRelease = "0.1.0";
// A host keeps programs of no more releases.
inline constexpr int kMaxReleases = 16;

// FAILED_PRECONDITION: more than one release lies between them; INVALID_ARGUMENT: the agent's is no release. Releases
// are "0.1.0"; before 1.0 the second number counts them, from then on the first. An empty `own` takes any.
absl::Status CheckRelease(std::string_view agents, std::string_view own);

// By its numbers, and then as text. What is no release is older than any.
bool IsOlderRelease(std::string_view a, std::string_view b);

// INVALID_ARGUMENT "hello.releases: \"x\" is no release"; or there are more than kMaxReleases.
absl::Status CheckReleases(const google::protobuf::RepeatedPtrField<std::string>& releases);

}  // namespace tessera::control
