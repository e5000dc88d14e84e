// LastingWitnesses: those who write down what a cluster says and does (lasting_history.h), each in a thread of its own:
// one who makes changes, one who asks for the world's state, one on each host who reads the workers' figures there, and
// players, who count how often they were thrown out.
//
//   LastingWitnesses witnesses(stage, "inst-1", players);
//   ... faults ...
//   const double struck = witnesses.Now();
//   witnesses.AcknowledgedAfter(struck, patience);
//   History history = witnesses.End();
//
// Thread rule: one thread; End once.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "bench/lasting_history.h"
#include "bench/lasting_stage.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::bench {

class LastingWitnesses {
 public:
  // `channels` of witnesses are dialled here: errors as of trust::Dial.
  static absl::StatusOr<std::unique_ptr<LastingWitnesses>> Begin(const LastingStage& stage, const std::string& instance,
                                                                 std::uint32_t players);
  ~LastingWitnesses();
  LastingWitnesses(const LastingWitnesses&) = delete;
  LastingWitnesses& operator=(const LastingWitnesses&) = delete;

  // Seconds since it began.
  double Now() const;
  // When the first change that was asked for after `since` was acknowledged; nothing within `patience`.
  std::optional<double> AcknowledgedAfter(double since, std::chrono::seconds patience);
  // The last answer about the world, if one was asked for after `since`.
  std::optional<v1::Instance> LatestAfter(double since) const;
  // Those of the world, by the last answer about it.
  std::vector<Border> Borders() const;
  // AllStepped, of what is known so far; nothing within `patience`.
  std::optional<double> SteppedAfter(double since, std::uint64_t map, std::chrono::seconds patience);
  // Returns once the record of who wrote has all that the store holds by now. UNAVAILABLE: not within `patience`.
  absl::Status AwaitWrites(std::chrono::seconds patience);
  // A line for each time that a player was thrown out, or could not join: when, and why.
  std::vector<std::string> PlayersDropped() const;

  // So many more players join.
  void LetPlay(std::uint32_t players);
  // All witnesses go home. The cluster runs on.
  History End();
  // Names of hosts that the cluster has now. UNAVAILABLE: nobody says.
  absl::StatusOr<std::set<std::string>> KnownHosts() const;

 private:
  struct Channels;
  LastingWitnesses(const LastingStage& stage, std::string instance);
  void MakeChanges();
  bool MakeChange(const std::string& name, bool add);
  void AskForTheWorld();
  void ReadWorkers(std::uint32_t host);
  void Play(std::uint32_t number);
  void Drop(std::uint32_t number, const absl::Status& why);
  void FollowWrites();
  void Doze();
  bool WaitFor(const std::function<bool()>& holds, std::chrono::seconds patience) const;

  const LastingStage& stage_;
  const std::string instance_;
  const std::chrono::steady_clock::time_point begin_;
  std::unique_ptr<Channels> channels_;
  std::atomic<bool> ended_{false};
  std::uint32_t players_ = 0;  // that were let play
  mutable std::mutex mutex_;   // guards what follows
  History history_;
  std::int64_t written_up_to_ = 0;  // the newest revision of history_.writes
  std::vector<std::string> dropped_;
  std::optional<v1::Instance> latest_;
  double latest_asked_ = 0;
  std::vector<std::thread> threads_;
};

}  // namespace tessera::bench
