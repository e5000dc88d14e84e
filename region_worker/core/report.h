// A worker's reports about itself, and their times.
//
// Thread rule: none of its own.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "region_worker/core/identity.h"
#include "region_worker/core/region_run.h"
#include "region_worker/core/time.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

// The part whose change is reported at once.
struct ReportedState {
  v1::WorkerPhase phase = v1::WORKER_PHASE_LOADING;
  std::uint64_t order_revision = 0;
  std::vector<RegionId> linked;
  std::vector<PlayerNumber> players;
  std::string failure;
  MapVersion map{}, planned{}, refused{};
  bool paused = false, unprotected = false, world_paused = false;
  std::string next_game{}, next_game_failure{};  // hash; empty: nothing is known of it
  Tick checkpoint_tick{};
  std::string checkpoint_failure;
  std::vector<PropertyAnswer> property_answers{};
  std::vector<BackendAnswer> backend_answers{};
  std::vector<region::EndedPlayer> ended_players{};
  friend bool operator==(const ReportedState&, const ReportedState&) = default;
};

// Without the memory that the process takes. `run` is null until the world is built.
v1::WorkerReport MakeReport(const v1::WorkerIdentity& identity, const v1::RegionAddress& address,
                            const net::VerificationKey& key, const ReportedState& state, const RegionRun* run,
                            TimePoint now);

// Lets a report through when the state differs from the last one's, else every kInterval; while there are events for
// the game's backend that were not in the last one, every kEventInterval.
class ReportGate {
 public:
  static constexpr Duration kInterval = std::chrono::milliseconds(500);
  // Each of these reports makes the control plane write, and order all regions anew.
  static constexpr Duration kEventInterval = std::chrono::milliseconds(100);

  // `published`: number of the newest event for the backend; 0: there is none.
  bool Due(TimePoint now, const ReportedState& state, std::uint64_t published = 0) const {
    const bool events = published > published_ && now >= next_ - kInterval + kEventInterval;
    return events || now >= next_ || state != last_;
  }
  void Sent(TimePoint now, ReportedState state, std::uint64_t published = 0) {
    next_ = now + kInterval;
    last_ = std::move(state);
    published_ = published;
  }

 private:
  TimePoint next_{};
  ReportedState last_;
  std::uint64_t published_ = 0;
};

}  // namespace tessera::worker
