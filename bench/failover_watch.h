// GapWatch: how long players saw the bodies of some regions stand still.
//
//   GapWatch watch({RegionId(2)}, bots);
//   while (watch.found() < enough) { run.Frame(); watch.Look(Clock::now()); }
//   watch.gap_s()
//
// A body counts from the last moment at which anybody was shown something by the old owners to the first at which it is
// shown by another, each as wide as the looks are apart: the figure is never too short, and too long by a look. The
// median over the bodies is reported, because some had just been handed over in the ordinary way, and of some a
// player's budget lets him hear late. Thread rule: one thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <set>
#include <vector>

#include "local_cluster/bot.h"

namespace tessera::bench {

class GapWatch {
 public:
  using Clock = std::chrono::steady_clock;

  GapWatch(std::set<RegionId> regions, std::vector<local::Bot*> bots);

  // Until most are found; what comes after that, as that a new worker of the old name takes its place, does not count.
  void Look(Clock::time_point now);
  bool found_most() const { return found() * 2 > watched(); }
  std::size_t watched() const { return newest_.size(); }
  std::size_t found() const { return shown_again_.size(); }  // shown by another owner since
  double gap_s() const;                                      // 0 while nothing was found

 private:
  std::set<RegionId> regions_;
  std::vector<local::Bot*> bots_;
  std::map<BodyId, Tick> newest_;  // by the old owners
  Clock::time_point looked_{};     // the look before
  Clock::time_point last_{};       // time of the last snapshot that was seen
  std::map<BodyId, Clock::time_point> shown_again_;
};

}  // namespace tessera::bench
