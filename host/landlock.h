// Landlock (landlock(7)): the part of the kernel by which a process gives up files for good.
//
//   if (const auto version = host::LandlockVersion(); !version.ok()) spdlog::warn(...);
//
// Thread rule: any thread.
#pragma once

#include "absl/status/statusor.h"

namespace tessera::host {

// From 1. UNAVAILABLE with the kernel's reason: it is older than 5.13, was built without it, has left it out of its
// `lsm=`, or a container's filter refuses the call.
absl::StatusOr<int> LandlockVersion();

}  // namespace tessera::host
