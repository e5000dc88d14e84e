// The steps that make another machine a host, as docs/operating.md, "Add a host", has them. Pure.
#pragma once

#include <string>

namespace tessera::cli {

// For a person who has just been given a join token. `control`: addresses at which hosts reach the control plane, as
// --control takes them.
std::string HostSteps(const std::string& control);

}  // namespace tessera::cli
