// FailoverStage: a world of the suite failover, with those who play in it, from its start to its end.
//
//   FailoverStage stage(StageOptions(size));
//   if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
//   kill(stage.Workers()[0].pid, SIGKILL);
//   absl::Status carried_on = stage.PlayUntil("carried on", [&] { return stage.run().Latest().failovers() > 0; });
//   stage.TakeCensus(outcome);
//
// Thread rule: one thread.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "bench/player_processes.h"
#include "bench/report.h"
#include "bench/stage_pace.h"
#include "local_cluster/world_run.h"

namespace tessera::bench {

inline constexpr const char* kFailoverEngine = "tessera";

// How large worlds are and how often they are struck.
struct FailoverSize {
  std::uint32_t runs, bodies, bots;
  double control_away_s;
  std::uint32_t scale_rounds, restored_bodies;
};

struct Worker {
  RegionId region;
  pid_t pid = 0;
  std::string metrics;  // host:port
  std::string host;
};

// Results of all runs of a fault.
struct FailoverOutcome {
  std::vector<double> gaps_ms, worst_gaps_ms, server_gaps_ms;  // players' median, their worst; regions'
  double runs = 0, runs_failed = 0;                      // failed: not well again in time, or a player's client ended
  double runs_too_slow = 0;                              // the stage was, so nothing was struck; neither of the above
  double late_frames = 0, late_ticks_before_strike = 0;  // the highest shares before strikes that count
  double lost = 0, duplicated = 0, age_ticks = 0, clients_dropped = 0, workers_lost = 0;
  double taken_out = 0;  // by their owners, as not finite or beyond limits: reported, and not lost
  double beyond = 0;     // outside the bounds of the scene in the end, where they go on as ever
  // Late ticks in spans of one length: nothing happened in the first two, the fault was there in the third.
  struct LateTicks {
    double first = 0, second = 0, fault = 0;
  };
  std::vector<LateTicks> late_ticks;

  // Anew after each run.
  void TellLateTicks(const std::string& config, Report& report) const;
  void AddTo(const std::string& fault, const FailoverSize& size, Report& report) const;
  // Counts that must be 0 whatever happened: bodies lost and doubled, clients dropped.
  void TellKept(const std::string& scene, const std::string& config, Report& report) const;
};

// Four regions on two hosts, as many bodies and players as `size` says.
local::RunOptions StageOptions(const FailoverSize& size);

class FailoverStage {
 public:
  // Its players are bots of this process; or each plays in a process of its own (player_seat.h), of which this program
  // has the command. CommandError: something cannot be started.
  enum class Players { kBots, kProcesses };
  explicit FailoverStage(const local::RunOptions& options, Players players = Players::kBots);

  // An error, with the state of the instance, when the world or a player ended or time is up.
  absl::Status PlayUntil(const std::string& what, const std::function<bool()>& holds);
  absl::Status PlayFor(double seconds);
  // It runs with all its regions, as evenly on its hosts as they go, nothing is being changed, and for a second now
  // every region's standby has been following it on another host.
  absl::Status PlayUntilWell();
  // For so long, on a stage on which nothing happens. INVALID_ARGUMENT: its players are bots.
  absl::StatusOr<StagePace> MeasurePace(double seconds);
  // Until further censuses were complete.
  absl::Status PlayOn();
  // Adds what the world lost, doubled or dropped since the last time.
  void TakeCensus(FailoverOutcome& outcome);

  std::vector<Worker> Workers();
  std::vector<Worker> WorkersOn(std::size_t host);
  PlayerProcesses& players() { return *players_; }  // if they are processes
  local::WorldRun& run() { return run_; }

 private:
  void SeatPlayers(std::uint32_t count);
  void NotePlaces();
  void NoteSeen(BodyId body, const SeenPlace& place);
  std::set<BodyId> SeenNow();
  void TellMissing();

  local::WorldRun run_;
  std::uint32_t regions_;
  std::unique_ptr<PlayerProcesses> players_;                        // null: bots
  double lost_ = 0, duplicated_ = 0, dropped_ = 0, taken_out_ = 0;  // as of the last census that was taken
  std::map<BodyId, SeenPlace> seen_;                                // as last seen by anybody
  std::chrono::steady_clock::time_point look_at_places_{};
};

// One sample of each worker that answers: their sum, or the highest.
double SumOf(const std::vector<Worker>& workers, const std::string& sample);
double HighestOf(const std::vector<Worker>& workers, const std::string& sample);

}  // namespace tessera::bench
