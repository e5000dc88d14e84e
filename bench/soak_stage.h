// SoakStage: the world of the suite soak under full load, from its start to its end: the plaza's bodies, which never
// come to rest, in four regions on two hosts, with a game, and players who come and go.
//
//   SoakStage stage(size, stop);
//   absl::Status status = stage.Begin();
//   for (const SoakTurn& turn : turns) if (status.ok()) status = stage.Take(turn);
//   stage.End();
//
// Errors of all functions: CANCELLED when a signal asks for the end, ABORTED when the world is over, DEADLINE_EXCEEDED
// when what is waited for does not come within two minutes. Destruction ends all processes that it started.
// Thread rule: one thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "bench/soak_meter.h"
#include "bench/soak_players.h"
#include "bench/soak_turns.h"
#include "cli/signals.h"
#include "host/temporary_folder.h"
#include "local_cluster/world_run.h"

namespace tessera::bench {

struct SoakSize {
  std::uint32_t bodies = 2000;
  std::size_t groups = 8;  // each has SoakPlayers::kInGroup players
  double interval_s = 10;  // between two samples
};

struct SoakCounts {
  std::uint64_t turns = 0, failed = 0;  // failed: not carried out, or the world was not well again in time
  std::uint64_t deaths = 0, scales = 0, checkpoints = 0, properties = 0, spawned = 0;
  std::uint64_t lost = 0, duplicated = 0;  // bodies of the scene and of players, by roll calls after each turn
  std::uint64_t taken_out = 0;             // by their owners, as not finite or beyond limits: reported, and not lost
  std::uint64_t left_running = 0;          // workers that had to be killed at the end
};

class SoakStage {
 public:
  SoakStage(const SoakSize& size, cli::StopSignal& stop);
  ~SoakStage();

  // All players are in, every region is protected; time counts from now on.
  absl::Status Begin();
  // One turn, until the world is well again and a roll call was taken. A turn that fails is counted, said on stderr and
  // no error, unless five fail in a row.
  absl::Status Take(const SoakTurn& turn);
  absl::Status RestUntil(double run_s);
  // All leave and end; only the figures are left.
  void End();

  double run_s() const;  // since Begin
  const SoakCounts& counts() const { return counts_; }
  std::uint64_t joins() const { return joins_; }
  std::uint64_t players_failed() const { return players_failed_; }
  const SoakMeter& meter() const { return *meter_; }

 private:
  using Clock = std::chrono::steady_clock;

  absl::Status Await(const std::string& what, const std::function<bool(const v1::Instance&)>& holds);
  absl::Status AwaitWell();
  absl::Status CallRoll();
  void NoteTakenOut(const v1::Instance& instance);
  absl::Status Carry(const SoakTurn& turn);
  absl::Status ChangePlayers();
  absl::Status Scale();
  absl::Status KillWorker(std::uint64_t draw);
  void Checkpoint();
  void SetProperties(std::uint64_t draw);
  absl::Status Spawn();

  const SoakSize size_;
  cli::StopSignal& stop_;
  host::TemporaryFolder folder_;
  std::uint32_t regions_;
  std::vector<BodyId> bodies_;  // the scene's dynamic ones
  std::set<BodyId> taken_out_;
  std::uint64_t lost_ = 0, duplicated_ = 0;  // at the last roll call
  std::uint64_t failed_in_a_row_ = 0, joins_ = 0, players_failed_ = 0, messages_ = 0;
  SoakCounts counts_;
  Clock::time_point begin_;
  bool begun_ = false;
  // Ended in the opposite order.
  std::unique_ptr<local::WorldRun> run_;
  std::unique_ptr<SoakMeter> meter_;
  std::unique_ptr<SoakPlayers> players_;
};

}  // namespace tessera::bench
