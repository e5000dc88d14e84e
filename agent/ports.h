// PortRange: which ports the workers of this host listen on, handed out three in a row.
//
// Next fit: the search goes on behind the last hand-out, so that ports are not taken again at once, while datagrams for
// the worker that had them may still be under way. Pure; what other processes hold is asked of `is_free`.
// Thread rule: one owner.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>

#include "absl/status/statusor.h"

namespace tessera::agent {

class PortRange {
 public:
  // `first` to `last`, both included.
  PortRange(std::uint16_t first, std::uint16_t last);
  // "7800-8799". INVALID_ARGUMENT unless it holds at least one worker's ports, all from 1 to 65535.
  static absl::StatusOr<PortRange> Parse(const std::string& text);

  // The first of three ports that are nobody's here and that `is_free(first)` agrees to; nullopt if there are none.
  std::optional<std::uint16_t> Take(const std::function<bool(std::uint16_t)>& is_free);
  // Marks ports as taken by an adopted worker.
  void Mark(std::uint16_t first_port);
  void Return(std::uint16_t first_port);

  std::uint32_t places() const;  // how many workers it has room for
  std::string ToString() const;  // "7800-8799"

 private:
  bool Overlaps(std::uint32_t port) const;

  std::uint32_t first_, last_, next_;
  std::set<std::uint32_t> taken_;  // first ports
};

}  // namespace tessera::agent
