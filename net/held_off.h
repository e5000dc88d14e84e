// HeldOff: credentials whose holders were let in and then refused, so often that they are not looked at for a while.
//
//   held_off.Note(now, credential);           // once more
//   if (held_off.Holds(now, credential)) ...  // more often than kRefusalsAtOnce within kHoldOff
//
// A credential is a keyed hash of its bytes. Bounded by kMaxHeldOff. Thread rule: one thread; time comes in.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>

#include "absl/container/flat_hash_map.h"
#include "net/limits.h"

namespace tessera::net {

class HeldOff {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  void Note(TimePoint now, std::uint64_t credential, int times = 1) {
    Forget(now);
    const auto [found, is_new] = times_.try_emplace(credential, 0);
    found->second += times;
    if (!is_new) return;
    order_.push_back({credential, now + kHoldOff});
    if (order_.size() > kMaxHeldOff) ForgetEldest();
  }
  bool Holds(TimePoint now, std::uint64_t credential) {
    Forget(now);
    const auto found = times_.find(credential);
    return found != times_.end() && found->second >= kRefusalsAtOnce;
  }
  std::size_t size() const { return times_.size(); }

 private:
  struct Entry {
    std::uint64_t credential;
    TimePoint until;
  };
  void Forget(TimePoint now) {
    while (!order_.empty() && now >= order_.front().until) ForgetEldest();
  }
  void ForgetEldest() {
    times_.erase(order_.front().credential);
    order_.pop_front();
  }

  absl::flat_hash_map<std::uint64_t, int> times_;
  std::deque<Entry> order_;  // the same, the first to end first
};

}  // namespace tessera::net
