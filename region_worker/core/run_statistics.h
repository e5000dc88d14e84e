// RunStatistics: what a region has gone through since its worker started, as reports have it.
//
// Thread rule: none of its own. Time is passed in.
#pragma once

#include <cstdint>
#include <deque>

#include "core/region/census.h"
#include "core/region/region.h"
#include "region_worker/core/step_times.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

struct TickCounts {
  std::uint64_t ticks = 0, late_ticks = 0, nonfinite_bodies = 0;
  std::uint64_t handovers_in = 0, handovers_out = 0;
  std::uint64_t removed_bodies = 0;
};

class RunStatistics {
 public:
  static constexpr std::size_t kCensusesKept = 5, kTakenOutKept = 100;

  // The census that the region begins with.
  void Begin(const region::Region& region) { KeepCensus(region); }
  // The result of a step, or of a resumption.
  void Stepped(const region::Region& region, const region::StepResult& result, std::uint32_t tick_rate_hz);
  // `work`: the time that the tick took, without waiting.
  void StepEnded(TimePoint end, Tick tick, Duration work, bool late);

  const TickCounts& counts() const { return counts_; }
  TimeSummary step_times() const { return step_times_.Summary(); }
  double rate_hz(TimePoint now) const { return rate_.rate_hz(now); }
  const std::deque<region::RegionCensus>& censuses() const { return censuses_; }  // oldest first
  const std::deque<BodyId>& taken_out() const { return taken_out_; }  // not finite; the newest, oldest first

 private:
  void KeepCensus(const region::Region& region);

  TickCounts counts_;
  StepTimes step_times_;
  RateMeter rate_;
  std::deque<region::RegionCensus> censuses_;
  std::deque<BodyId> taken_out_;
};

}  // namespace tessera::worker
