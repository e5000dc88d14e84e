#include "bench/failover_watch.h"

#include <algorithm>
#include <utility>

namespace tessera::bench {

GapWatch::GapWatch(std::set<RegionId> regions, std::vector<local::Bot*> bots)
    : regions_(std::move(regions)), bots_(std::move(bots)) {}

void GapWatch::Look(Clock::time_point now) {
  if (found_most()) return;
  const Clock::time_point before = std::exchange(looked_, now);
  const bool first = before == Clock::time_point();
  for (local::Bot* bot : bots_) {
    for (const auto& [id, body] : bot->client().World()) {
      if (!regions_.contains(body.region)) {
        if (newest_.contains(id)) shown_again_.try_emplace(id, now);
        continue;
      }
      Tick& newest = newest_[id];
      if (body.tick <= newest) continue;
      newest = body.tick;
      last_ = first ? now : before;
      shown_again_.erase(id);  // it was handed over and came back
    }
  }
}

double GapWatch::gap_s() const {
  std::vector<double> gaps;
  gaps.reserve(shown_again_.size());
  for (const auto& [id, at] : shown_again_) {
    if (at > last_) gaps.push_back(std::chrono::duration<double>(at - last_).count());
  }
  if (gaps.empty()) return 0;
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  return *middle;
}

}  // namespace tessera::bench
