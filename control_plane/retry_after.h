// How long whoever was refused should wait before asking again, as part of a status.
//
//   return WithRetryAfter(absl::ResourceExhaustedError("..."), std::chrono::seconds(3));
//   ...
//   if (const auto wait = RetryAfterOf(status)) headers.Add("retry-after", *wait);
//
// Thread rule: free functions on values.
#pragma once

#include <chrono>
#include <optional>

#include "absl/status/status.h"

namespace tessera::control {

// Trailing metadata of gRPC's answer: whole milliseconds.
inline constexpr char kRetryAfterHeader[] = "retry-after-ms";

absl::Status WithRetryAfter(absl::Status status, std::chrono::milliseconds wait);
// Nothing: the status says none.
std::optional<std::chrono::milliseconds> RetryAfterOf(const absl::Status& status);

}  // namespace tessera::control
