// InputMaker: makes a player's inputs, one a tick of the world while there is a reason for them, and keeps them until
// they have been sent often enough.
//
//   maker.Steer(steering);                                         // the program, whenever it likes
//   for (const PlayerInput& made : maker.MakeDue(now, world)) ...  // once a poll
//   if (maker.Due(now)) { Send(maker.queue()); maker.Sent(now); }
//   maker.Applied(now, tick, last_input, margin_ticks);            // the own body's region reports
//
// Promise: numbers of inputs only grow, also beyond those of an earlier client of the player (SkipPast). An input for
// the own body names the tick that it is meant for, once a region has reported.
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/input_clock.h"
#include "client_sdk/input_queue.h"
#include "core/world/player_input.h"

namespace tessera::client {

class InputMaker {
 public:
  InputMaker(PlayerNumber player, std::uint32_t tick_rate_hz);

  // The inputs ask for this from now on.
  void Steer(const Steering& steering);
  void Move(Vec3f force_n, Vec3f torque_nm);
  // The number of the next input.
  std::uint32_t next() const { return next_; }

  struct World {
    bool moves = false;          // it has started, and is not paused
    bool goes_on_alone = false;  // a region lets the own body go on by its last input when it has none
    bool predicted = false;      // a predicted body moves, whose tick the inputs give
    double tick_rate_hz = 0;     // measured
    double shown_tick = 0;       // the moment that the player has before its eyes
  };
  // The inputs that are due: while the player steers, one a tick. A predicted body that moves needs them too. One that
  // goes on alone needs some that say that steering has ended, or that the player looks elsewhere.
  std::vector<PlayerInput> MakeDue(TimePoint now, const World& world);
  // One input for any body, now.
  PlayerInput Make(const PlayerInput& asked, double shown_tick);

  // A region's snapshot says that it has applied this input last.
  void NoteLast(std::uint32_t last_input) { last_applied_ = std::max(last_applied_, last_input); }
  // It was made by an earlier client of this player if it is not below the next: inputs of lower numbers would pass for
  // late.
  void SkipPast(std::uint32_t last_input);
  // The own body's region reports: by `tick` it had applied `last_input`, and the newest had come so many ticks early.
  // Each datagram of a snapshot says it again. The newest input that is known to be applied by then; nothing if a later
  // report is here.
  std::optional<std::uint32_t> Applied(TimePoint now, Tick tick, std::uint32_t last_input, std::int32_t margin_ticks);
  std::uint32_t last_applied() const { return last_applied_; }
  // The world starts over: what was made and reported counts no more, and numbers go on.
  void Forget();

  // Whether the queue is to be sent now; and it has been.
  bool Due(TimePoint now) const { return queue_.Due(now, tick_length_); }
  const InputQueue& queue() const { return queue_; }
  void Sent(TimePoint now) { queue_.Sent(now); }
  const InputClock& clock() const { return clock_; }

 private:
  struct Report {
    Tick tick;
    std::uint32_t input = 0;
  };
  bool IsSteering() const;

  PlayerNumber player_;
  std::chrono::nanoseconds tick_length_;
  PlayerInput steering_;             // the next inputs ask for it
  bool look_changed_ = false;        // since the last input
  std::uint32_t last_steering_ = 0;  // the last input that asked for anything
  std::uint32_t next_ = 1;
  std::uint32_t last_applied_ = 0;
  InputQueue queue_;
  InputClock clock_;
  std::optional<Report> applied_;  // the newest
};

}  // namespace tessera::client
