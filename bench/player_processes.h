// PlayerProcesses: players of a world, each in a process of its own, as those of a game are: none waits for another's
// frame, and none takes the time in which the bench looks at the cluster.
//
//   auto players = PlayerProcesses::Start(SeatCommands(control_address, instance_id, 8));
//   while (!(*players)->AllIn()) (*players)->TakeIn(Clock::now());
//   (*players)->Watch({RegionId(2)});           // and now region 2 is killed
//   while (!(*players)->SawOthers()) (*players)->TakeIn(Clock::now());
//   (*players)->gap_s()
//
// Each process gets its orders by its standard input and says by its standard output what it sees (player_view.h). It
// ends with that input, so with this object or this process, however that one ends. Thread rule: one thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "bench/player_view.h"

namespace tessera::bench {

class PlayerProcesses {
 public:
  using Clock = std::chrono::steady_clock;

  // One process for each command; a command's first word is the path of its program. INTERNAL: one does not start.
  static absl::StatusOr<std::unique_ptr<PlayerProcesses>> Start(const std::vector<std::vector<std::string>>& commands);
  // They leave the world in order, or are killed when they take longer than 5 s.
  ~PlayerProcesses();
  PlayerProcesses(const PlayerProcesses&) = delete;
  PlayerProcesses& operator=(const PlayerProcesses&) = delete;

  // All that they have said until now; waits for nothing. INTERNAL: one of them has ended, or speaks nonsense.
  absl::Status TakeIn(Clock::time_point now);

  std::vector<const PlayerView*> views() const;
  bool AllIn() const;            // each has seen its own body
  FrameCount frames() const;     // sum over all players
  std::size_t ended() const;     // players who are out
  std::string WhyEnded() const;  // "player 2: ..., player 5: ..."; empty: nobody has

  // The bodies of these regions are watched from now on.
  void Watch(const std::set<RegionId>& regions);
  // All who were shown bodies of those regions are shown most of them by others; or most players are, since a second.
  bool SawOthers() const { return saw_others_; }
  // Players' gaps, in seconds: the median over those for whom it is over; 0 while there are none. And the worst.
  double gap_s() const;
  double worst_gap_s() const;

 private:
  struct Player;

  PlayerProcesses();
  void Read(Player& player);
  std::vector<double> Gaps() const;

  std::vector<std::unique_ptr<Player>> players_;
  absl::Status wrong_;
  std::uint64_t watch_ = 0;  // number of the newest order to watch
  std::optional<Clock::time_point> most_saw_at_;
  bool saw_others_ = false;
};

}  // namespace tessera::bench
