#include "agent/ports.h"

#include <cassert>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "agent/limits.h"

namespace tessera::agent {

PortRange::PortRange(std::uint16_t first, std::uint16_t last) : first_(first), last_(last), next_(first) {
  assert(first >= 1 && last + 1U >= first + kPortsPerWorker);
}

absl::StatusOr<PortRange> PortRange::Parse(const std::string& text) {
  const std::vector<std::string> ends = absl::StrSplit(text, '-');
  std::uint32_t first = 0, last = 0;
  if (ends.size() != 2 || !absl::SimpleAtoi(ends[0], &first) || !absl::SimpleAtoi(ends[1], &last) || first < 1 ||
      last > 65535 || last + 1 < first + kPortsPerWorker) {
    return absl::InvalidArgumentError(absl::StrCat("\"", text,
                                                   "\" is no port range; give FIRST-LAST, from 1 to 65535, with ",
                                                   kPortsPerWorker, " ports a worker, e.g. 7800-8799"));
  }
  return PortRange(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(last));
}

std::optional<std::uint16_t> PortRange::Take(const std::function<bool(std::uint16_t)>& is_free) {
  for (std::uint32_t i = 0; i < places(); ++i) {
    if (next_ + kPortsPerWorker > last_ + 1) next_ = first_;
    const std::uint32_t port = next_;
    next_ += kPortsPerWorker;
    if (Overlaps(port) || !is_free(static_cast<std::uint16_t>(port))) continue;
    taken_.insert(port);
    return static_cast<std::uint16_t>(port);
  }
  return std::nullopt;
}

void PortRange::Mark(std::uint16_t first_port) { taken_.insert(first_port); }
void PortRange::Return(std::uint16_t first_port) { taken_.erase(first_port); }
std::uint32_t PortRange::places() const { return (last_ - first_ + 1) / kPortsPerWorker; }
std::string PortRange::ToString() const { return absl::StrCat(first_, "-", last_); }

// An adopted worker may come from a range with another start, so its three need not be one of our places.
bool PortRange::Overlaps(std::uint32_t port) const {
  const auto next = taken_.lower_bound(port);
  if (next != taken_.end() && *next < port + kPortsPerWorker) return true;
  return next != taken_.begin() && *std::prev(next) + kPortsPerWorker > port;
}

}  // namespace tessera::agent
