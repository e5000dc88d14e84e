// DelayLine: one direction of a bad network.
//
//   DelayLine<Datagram> line;
//   line.Put(now, datagram, conditions);
//   for (Datagram& arrived : line.Take(now)) ...
//
// Pure: time comes in, chance by the seed. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <random>
#include <vector>

#include "client_sdk/network_conditions.h"

namespace tessera::client {

template <class Item>
class DelayLine {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  void Seed(std::uint64_t seed) { random_.seed(seed); }
  bool empty() const { return under_way_.empty(); }

  // May be lost, doubled, late.
  void Put(TimePoint now, Item item, const NetworkConditions& conditions) {
    if (Happens(conditions.loss)) return;
    if (Happens(conditions.duplicate)) under_way_.emplace(Due(now, conditions), item);
    under_way_.emplace(Due(now, conditions), std::move(item));
  }
  // Arrives, after all that was put in this way before it. `lane`: those of one are in order among each other.
  void PutReliable(TimePoint now, std::uint64_t lane, Item item, const NetworkConditions& conditions) {
    TimePoint due = Due(now, conditions);
    // Nobody tries more often than this before giving up the connection, which is not for this to decide.
    constexpr int kMaxTries = 10;
    const auto again = 2 * conditions.delay + conditions.jitter + kResend;
    for (int i = 0; i < kMaxTries && Happens(conditions.loss); ++i) due += again;
    TimePoint& last = last_in_lane_[lane];
    last = std::max(last, due);
    under_way_.emplace(last, std::move(item));
  }
  std::vector<Item> Take(TimePoint now) {
    std::vector<Item> arrived;
    while (!under_way_.empty() && under_way_.begin()->first <= now) {
      arrived.push_back(std::move(under_way_.begin()->second));
      under_way_.erase(under_way_.begin());
    }
    return arrived;
  }

 private:
  static constexpr std::chrono::milliseconds kResend{50};

  double Random() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  bool Happens(double share) { return share > 0 && Random() < share; }
  TimePoint Due(TimePoint now, const NetworkConditions& conditions) {
    const double jitter_s = std::chrono::duration<double>(conditions.jitter).count() * Random();
    return now + conditions.delay +
           std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(jitter_s));
  }

  std::mt19937_64 random_{1};
  std::multimap<TimePoint, Item> under_way_;  // those due at one time in the order of putting
  std::map<std::uint64_t, TimePoint> last_in_lane_;
};

}  // namespace tessera::client
