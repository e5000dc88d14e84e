#include "control_plane/retry_after.h"

#include <cstdint>
#include <string>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"

namespace tessera::control {
namespace {

constexpr char kRetryAfterUrl[] = "tessera.v1/retry-after-ms";

}  // namespace

absl::Status WithRetryAfter(absl::Status status, std::chrono::milliseconds wait) {
  status.SetPayload(kRetryAfterUrl, absl::Cord(std::to_string(wait.count())));
  return status;
}

std::optional<std::chrono::milliseconds> RetryAfterOf(const absl::Status& status) {
  const auto payload = status.GetPayload(kRetryAfterUrl);
  std::int64_t wait_ms = 0;
  if (!payload || !absl::SimpleAtoi(std::string(*payload), &wait_ms)) return std::nullopt;
  return std::chrono::milliseconds(wait_ms);
}

}  // namespace tessera::control
