// The names that people give to hosts, tokens and issuers, and how these name the instances that they are for.
//
// Thread rule: free functions on values.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace tessera::control {

// 1 to kMaxNameBytes lower case letters and digits, dashes between. INVALID_ARGUMENT: "name: ...".
absl::Status CheckName(const std::string& name);

// A text that ids of instances begin with, as "inst-7" is; empty: that of all. INVALID_ARGUMENT: "instances: ...".
absl::Status CheckInstances(const std::string& prefix);

}  // namespace tessera::control
