// TickMeter: times the ticks of a worker by the clock of its process, for metrics and the log.
//
//   TickMeter meter(metrics);
//   meter.Begin(now);                     // a step
//   core.Step(now, meter.observer());
//   meter.Stepped(core.run()->ticks());
//   ... what it made is sent ...
//   core.StepEnded(end, meter.End(end));
//
// Thread rule: one thread, the one that steps.
#pragma once

#include <array>
#include <utility>

#include "core/region/region.h"
#include "region_worker/core/tick_driver.h"
#include "region_worker/core/time.h"
#include "region_worker/longest_tick.h"
#include "region_worker/worker_metrics.h"

namespace tessera::worker {

class TickMeter {
 public:
  explicit TickMeter(WorkerMetrics& metrics) : metrics_(metrics) {}

  // Time that was spent on what came for the region since the last tick: part of the next tick's work.
  void AddReceiveTime(Duration spent) { receive_time_ += spent; }
  void Begin(TimePoint now);
  // For the step that has begun.
  region::PhaseObserver observer();
  void Stepped(const TickDriver& ticks);
  // The work of the whole tick, without waiting.
  Duration End(TimePoint now);

 private:
  void NoteLength(const TickDriver& ticks);

  WorkerMetrics& metrics_;
  std::array<TimePoint, static_cast<std::size_t>(region::Phase::kDone) + 1> entered_{};
  LongestTick longest_tick_;
  TimePoint begun_{}, begun_before_{};    // the last step and the one before it; TimePoint(): none
  Duration worked_until_{0}, worked_{0};  // CPU time of this thread
  Duration stepping_{0};                  // the last step, by the clock
  Duration receive_time_{0};
  TimePoint may_log_at_{};
};

}  // namespace tessera::worker
