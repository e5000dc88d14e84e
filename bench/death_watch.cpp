#include "bench/death_watch.h"

#include <utility>
#include <vector>

#include "bench/statistics.h"

namespace tessera::bench {

void DeathWatch::Begin(std::set<std::uint32_t> regions) {
  const std::lock_guard lock(mutex_);
  regions_ = std::move(regions);
  watched_.clear();
}

void DeathWatch::Look(std::uint64_t body, std::uint32_t owner, const Place& place, TimePoint now) {
  const std::lock_guard lock(mutex_);
  if (regions_.contains(owner)) {
    watched_[body] = {place};  // anew if it was handed over and came back
    return;
  }
  const auto found = watched_.find(body);
  if (found == watched_.end() || found->second.again) return;
  if (found->second.place != place) {
    found->second.again = true;
    found->second.at = now;
  }
  found->second.place = place;
}

std::map<std::uint64_t, DeathWatch::TimePoint> DeathWatch::moved_again() const {
  const std::lock_guard lock(mutex_);
  std::map<std::uint64_t, TimePoint> moved;
  for (const auto& [body, watched] : watched_) {
    if (watched.again) moved.emplace(body, watched.at);
  }
  return moved;
}

bool DeathWatch::most_moved_again() const {
  const std::size_t moved = moved_again().size();
  const std::lock_guard lock(mutex_);
  return 2 * moved > watched_.size();
}

double MedianDelaySeconds(const DeathWatch& first, const DeathWatch& second) {
  const auto before = first.moved_again(), after = second.moved_again();
  std::vector<double> delays;
  for (const auto& [body, at] : before) {
    const auto found = after.find(body);
    if (found != after.end()) delays.push_back(std::chrono::duration<double>(found->second - at).count());
  }
  return Median(std::move(delays));
}

}  // namespace tessera::bench
