// What a worker tells about itself, and when.
//
// Thread rule: none of its own.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "region_worker/tick_loop.h"
#include "region_worker/wards.h"
#include "region_worker/worker_options.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

// The part whose change is told at once.
struct ReportedState {
  v1::WorkerPhase phase = v1::WORKER_PHASE_LOADING;
  std::uint64_t order_revision = 0;
  std::vector<RegionId> linked;
  std::vector<PlayerNumber> players;
  std::string failure;
  MapVersion map{}, planned{}, refused{};
  bool paused = false, unprotected = false;
  Tick checkpoint_tick{};
  std::string checkpoint_failure;
  std::vector<PropertyAnswer> property_answers{};
  friend bool operator==(const ReportedState&, const ReportedState&) = default;
};

// `ticks` and `wards` are null until the world is built.
v1::WorkerReport MakeReport(const Identity& self, const v1::RegionAddress& address, const ReportedState& state,
                            const TickLoop* ticks, const Wards* wards);

// Lets a report through when the state differs from the last one's, else every kInterval.
class ReportGate {
 public:
  static constexpr Duration kInterval = std::chrono::milliseconds(500);

  bool Due(TimePoint now, const ReportedState& state) const { return now >= next_ || state != last_; }
  void Sent(TimePoint now, const ReportedState& state) {
    next_ = now + kInterval;
    last_ = state;
  }
  TimePoint next() const { return next_; }

 private:
  TimePoint next_{};
  ReportedState last_;
};

}  // namespace tessera::worker
