// LinkBudget: how much another region may send over its link.
//
//   if (!link.budget.Take(now, limits, message.size())) cut the link;
//
// A neighbour sends a few messages a tick. A worker that was taken over could send as fast as the network carries, and
// each message is read in the tick's time. What goes over a link is needed whole, so nothing is dropped: a link beyond
// the budget is cut. The budget stays with the region and not with the link, so dialling again gives no new one.
// Thread rule: one thread; time comes in.
#pragma once

#include <cstddef>

#include "net/token_bucket.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

// Honest ones stay far below, also of a world that steps as fast as it can, and of a standby that is given the whole
// state of a million bodies: that is some hundred megabytes, and comes once. Lower, and these are cut; higher, and a
// region that is flooded spends a tenth of its time on it.
struct LinkLimits {
  net::Rate messages{.per_s = 50'000, .burst = 100'000};
  net::Rate bytes{.per_s = 256.0 * 1024 * 1024, .burst = 1024.0 * 1024 * 1024};
};

class LinkBudget {
 public:
  bool Take(TimePoint now, const LinkLimits& limits, std::size_t message_bytes) {
    messages_.Fill(now, limits.messages);
    bytes_.Fill(now, limits.bytes);
    const auto size = static_cast<double>(message_bytes);
    if (messages_.left() < 1 || bytes_.left() < size) return false;
    messages_.Spend(1);
    bytes_.Spend(size);
    return true;
  }

 private:
  net::TokenBucket messages_, bytes_;
};

}  // namespace tessera::worker
