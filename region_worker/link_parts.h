// LinkParts: parts of messages that a link has sent, and those of them that it sent again, since it was last looked at.
// ENet counts both from 0 every ten seconds; the little that came between a look and that moment is in neither.
//
// Thread rule: none of its own; pure.
#pragma once

#include <cstdint>
#include <utility>

namespace tessera::worker {

class LinkParts {
 public:
  struct Counts {
    std::uint32_t sent = 0, resent = 0;

    friend bool operator==(const Counts&, const Counts&) = default;
  };

  // `counted`: as the link counts them now.
  Counts Since(const Counts& counted) {
    const Counts before = std::exchange(last_, counted);
    if (counted.sent < before.sent || counted.resent < before.resent) return counted;  // from 0
    return {.sent = counted.sent - before.sent, .resent = counted.resent - before.resent};
  }

 private:
  Counts last_;
};

}  // namespace tessera::worker
