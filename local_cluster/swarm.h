// Swarm: many players in one process, to see what a world and the client library bear.
//
// Players join one after the other on a thread of their own, so that those who are in already are polled meanwhile; all
// polls are made by the thread that calls Run. Each player wanders as a Bot does, with prediction, and reads all bodies
// each frame, as a game would.
//
//   Swarm swarm({.control = ..., .instance_id = "inst-1", .players = 100});
//   while (swarm.Run(std::chrono::seconds(1))) Print(swarm.Report());
//   swarm.Leave();
//
// Thread rule: one thread at a time.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "client_sdk/stats.h"
#include "local_cluster/bot.h"
#include "local_cluster/poll_schedule.h"
#include "trust/credentials.h"

namespace tessera::local {

struct SwarmOptions {
  trust::ControlPoint control;
  std::string instance_id;
  std::string name = "swarm";  // the players': "swarm-1", "swarm-2", ...
  std::size_t players = 1;
  double rate_hz = 30;                 // polls of a player a second
  std::uint64_t seed = 1;              // seeds their ways; player i has seed + i
  std::vector<std::string> tickets{};  // one for each player; empty: guests
};

struct SwarmReport {
  std::size_t wanted = 0, joined = 0, in = 0;  // players asked for, who came in, who are in now
  double seconds = 0;                          // since the first one came in
  double player_seconds = 0;                   // sum over players of the time that they were polled
  double cpu_seconds = 0;                      // used by this process in that time
  std::uint64_t polls = 0, late_polls = 0;     // made; dropped because the one after them was due
  std::uint64_t bytes_in = 0, bytes_out = 0, corrections = 0, extrapolations = 0;
  double mean_bodies = 0;                 // in view of a player, now
  double poll_p50_s = 0, poll_p99_s = 0;  // one player's frame: its poll, its steering, its reading
  absl::Status join_error;                // why no more players come in, if that is so
  absl::Status end_reason;                // why the last player who is gone was thrown out, if that was no end in order
};

class Swarm {
 public:
  explicit Swarm(SwarmOptions options);
  ~Swarm();
  Swarm(const Swarm&) = delete;
  Swarm& operator=(const Swarm&) = delete;

  // Polls for so long. False once nobody is in any more and nobody comes.
  bool Run(std::chrono::nanoseconds span);
  SwarmReport Report() const;
  // All leave the world in order; OK, or the first error.
  absl::Status Leave();

 private:
  struct Player {
    std::unique_ptr<Bot> bot;
    client::TimePoint since;
    bool in = true;
  };

  void JoinAll();
  void TakeJoined(client::TimePoint now);
  void Frame(std::size_t index, client::TimePoint now);

  const SwarmOptions options_;
  PollSchedule schedule_;
  std::vector<Player> players_;
  client::DurationStats frames_;
  std::optional<client::TimePoint> begin_;
  double begin_cpu_s_ = 0, past_player_seconds_ = 0;
  absl::Status end_reason_;

  mutable std::mutex mutex_;  // guards what stands between here and the thread that lets players in
  std::vector<std::unique_ptr<Bot>> joined_;
  absl::Status join_error_;
  bool all_joined_ = false;
  std::atomic<bool> stop_ = false;
  std::thread joiner_;
};

}  // namespace tessera::local
