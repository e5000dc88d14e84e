// Lease: the time span in which a worker may step its region.
//
// Promise: whoever declares the worker dead waits one TTL after the last renewal that it gave; the holder counts from
// when it *asked*, the giver from when it *answered*, so the holder always stops first. A region without a standby
// needs no lease: nobody can take its place unless whoever ended it says so.
//
//   Lease lease;
//   lease.Require();                          // it has a standby from now on
//   if (auto number = lease.Ask(now)) ask standby and control plane
//   lease.Answered(number, ttl);              // or Renewed, by the acknowledgement of what was sent then
//   if (lease.Held(now)) step
//
// Thread rule: none of its own. Time is passed in, never read.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>

#include "region_worker/core/time.h"

namespace tessera::worker {

class Lease {
 public:
  // The control plane waits as long before it puts a standby in the place of a worker that it cannot hear.
  static constexpr Duration kTtl = std::chrono::seconds(1);
  // A lease with less than this left is asked for. The standby's acknowledgements come within a few ticks, so in good
  // health that happens once.
  static constexpr Duration kAskBelow = std::chrono::milliseconds(700);
  static constexpr Duration kAskDistance = std::chrono::milliseconds(100);

  // From now on it is needed. The first one has to be asked for too: the order that says so may have been long on its
  // way. Repeating it does nothing.
  void Require() { required_ = true; }
  void Release() {
    required_ = false;
    expiry_ = {};
    asked_.clear();
  }
  // The standby acknowledged what was sent at `asked_at`. While no lease is needed there is no standby, and the word of
  // an earlier one counts no more.
  void Renewed(TimePoint asked_at) {
    if (required_) Extend(asked_at);
  }
  bool Held(TimePoint now) const { return !required_ || now < expiry_; }
  bool required() const { return required_; }

  // The number of a request that is to go out now, if one is.
  std::optional<std::uint64_t> Ask(TimePoint now) {
    if (!required_ || now + kAskBelow <= expiry_ || now < next_ask_) return std::nullopt;
    next_ask_ = now + kAskDistance;
    asked_[++number_] = now;
    if (asked_.size() > kAskedKept) asked_.erase(asked_.begin());
    return number_;
  }
  // Somebody answered a request and promises to wait for `ttl`; unknown numbers are ignored.
  void Answered(std::uint64_t number, Duration ttl) {
    const auto asked = asked_.find(number);
    if (asked == asked_.end()) return;
    Extend(asked->second + std::min(ttl, kTtl) - kTtl);
    asked_.erase(asked_.begin(), std::next(asked));
    next_ask_ = {};
  }

 private:
  void Extend(TimePoint asked_at) { expiry_ = std::max(expiry_, asked_at + kTtl); }

  static constexpr std::size_t kAskedKept = 32;  // older ones would renew nothing
  bool required_ = false;
  TimePoint expiry_{};
  TimePoint next_ask_{};
  std::uint64_t number_ = 0;
  std::map<std::uint64_t, TimePoint> asked_;
};

}  // namespace tessera::worker
