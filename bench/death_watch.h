// DeathWatch: when one who looks at a world first saw the bodies of dead regions move again.
//
//   DeathWatch watch;
//   watch.Begin({2});                                   // region 2 is killed now
//   each frame: watch.Look(body, owner, place, now);
//   watch.moved_again()                                 // by body
//
// A body counts once another region is its owner and it is drawn elsewhere than in the frame before. Thread rule: any
// thread.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>

namespace tessera::bench {

class DeathWatch {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Place = std::array<std::int64_t, 3>;  // in whatever steps

  // Bodies count that are looked at as one of these regions' from now on.
  void Begin(std::set<std::uint32_t> regions);
  void Look(std::uint64_t body, std::uint32_t owner, const Place& place, TimePoint now);

  std::map<std::uint64_t, TimePoint> moved_again() const;
  // More than half of those that count have moved again.
  bool most_moved_again() const;

 private:
  struct Watched {
    Place place;
    bool again = false;
    TimePoint at{};
  };

  mutable std::mutex mutex_;
  std::set<std::uint32_t> regions_;
  std::map<std::uint64_t, Watched> watched_;
};

// By how much later the bodies that both saw move again did so for the second, s: the median; NaN if there are none.
double MedianDelaySeconds(const DeathWatch& first, const DeathWatch& second);

}  // namespace tessera::bench
