#include "region_worker/core/run_statistics.h"

#include <algorithm>

namespace tessera::worker {

void RunStatistics::Stepped(const region::Region& region, const region::StepResult& result,
                            std::uint32_t tick_rate_hz) {
  const auto removed = std::ranges::count_if(result.departures, [&](const region::Departure& departure) {
    return departure.reason == region::DepartureReason::kRemoved &&
           std::ranges::find(result.nonfinite, departure.body) == result.nonfinite.end();
  });
  ++counts_.ticks;
  counts_.removed_bodies += static_cast<std::uint64_t>(removed);
  counts_.nonfinite_bodies += result.nonfinite.size();
  counts_.handovers_in += result.handed_in;
  counts_.handovers_out += result.handed_out;
  for (const BodyId body : result.nonfinite) {
    taken_out_.push_back(body);
    if (taken_out_.size() > kTakenOutKept) taken_out_.pop_front();
  }
  if (region::DueAt(region.tick(), tick_rate_hz)) KeepCensus(region);
}

void RunStatistics::StepEnded(TimePoint end, Tick tick, Duration work, bool late) {
  rate_.Observe(end, tick);
  step_times_.Add(work);
  if (late) ++counts_.late_ticks;
}

void RunStatistics::KeepCensus(const region::Region& region) {
  censuses_.push_back(region::TakeCensus(region.tick(), region.owned()));
  if (censuses_.size() > kCensusesKept) censuses_.pop_front();
}

}  // namespace tessera::worker
