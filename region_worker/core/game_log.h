// GameLog: what the game of a region writes, on its way to the worker's log and, its newest lines, into reports.
//
//   GameLog log;
//   log.Take(host.TakeLines(), now, actions);      // after each step
//   log.Report(report);
//
// The host bounds the lines of a tick; this bounds those of a second, so that a game cannot fill a disk. What is left
// out is counted, and the log says so once it goes on. Thread rule: one thread.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "core/game/game_host.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/time.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

class GameLog {
 public:
  // Lines a second in the long run, and at once after a silence: 50 lines of 200 bytes are 36 MB an hour.
  static constexpr double kLinesPerSecond = 50, kBurst = 100;
  // Lines that each report repeats: more than a report's interval takes.
  static constexpr std::size_t kReported = 32;

  void Take(std::vector<game::GameLine> lines, TimePoint now, Actions& actions);
  void Report(v1::WorkerReport& report) const;
  std::uint64_t left_out() const { return left_out_; }

 private:
  void Write(const game::GameLine& line, Actions& actions);

  double allowance_ = kBurst;
  TimePoint refilled_{};
  std::uint64_t last_ = 0;  // number of the last line, left out or not
  std::uint64_t left_out_ = 0, left_out_since_ = 0;
  std::deque<v1::GameLine> newest_;
};

}  // namespace tessera::worker
