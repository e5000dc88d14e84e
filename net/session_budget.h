// SessionBudget: what one session may send, and whether it floods.
//
// A datagram beyond the budget is dropped before it is opened, so it costs next to nothing. That it was beyond proves
// nothing about who sent it: somebody on the network between can send such in a peer's name. So a session floods only
// if most of what was within the budget meanwhile was the peer's own.
//
//   if (!budget.Take(now, limits, datagram.size())) return budget.BeginsToFlood(now, limits) ? end it : drop it;
//   budget.Opened(proven);
//
// Thread rule: one thread; time comes in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "net/limits.h"
#include "net/token_bucket.h"

namespace tessera::net {

class SessionBudget {
 public:
  using TimePoint = TokenBucket::TimePoint;

  bool Take(TimePoint now, const SessionLimits& limits, std::size_t bytes) {
    if (limits.datagrams.per_s <= 0) return true;
    datagrams_.Fill(now, limits.datagrams);
    bytes_.Fill(now, limits.bytes);
    const auto size = static_cast<double>(bytes);
    if (datagrams_.left() >= 1 && bytes_.left() >= size) {
      datagrams_.Spend(1);
      bytes_.Spend(size);
      return true;
    }
    if (!excess_since_ || now - last_excess_ >= kFloodPause) {
      excess_since_ = now;
      proven_ = unproven_ = 0;
      excess_ = 0;
    }
    last_excess_ = now;
    ++excess_;
    return false;
  }
  // True once in kExcessToLimit datagrams that were beyond the budget; asked after Take has said no.
  bool IsToBeLimited() const { return excess_ % kExcessToLimit == 0; }
  // The outcome of a datagram that was within the budget.
  void Opened(bool proven) { ++(proven ? proven_ : unproven_); }

  // Asked after Take has said no; true once.
  bool BeginsToFlood(TimePoint now, const SessionLimits& limits) {
    if (said_ || now - *excess_since_ < limits.patience || proven_ <= unproven_) return false;
    said_ = true;
    return true;
  }

 private:
  TokenBucket datagrams_, bytes_;
  std::optional<TimePoint> excess_since_;
  TimePoint last_excess_{};
  std::uint64_t proven_ = 0, unproven_ = 0;  // since excess_since_
  std::uint32_t excess_ = 0;                 // likewise
  bool said_ = false;
};

}  // namespace tessera::net
