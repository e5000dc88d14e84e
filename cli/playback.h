// Playback: where in a recording somebody is who plays, pauses, and goes to and fro by keys.
//
//   Playback playback(length, from, speed);
//   each frame: if (const auto place = playback.Press(key)) client.Seek(*place);
//               playback.Advance(now);
//               client.Poll(TimePoint(playback.client_time()));
//
// A client's clock never goes back, so the time that it is polled with and the place in the recording are two things:
// the first grows while the recording plays, the second jumps as well. Pure: time is passed in. Thread rule: one
// thread.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "cli/keys.h"
#include "client_sdk/client.h"

namespace tessera::cli {

class Playback {
 public:
  static constexpr std::chrono::microseconds kJump = std::chrono::seconds(5);
  static constexpr double kSlowest = 0.1, kFastest = 16;  // times as fast

  // `from`: within `length`. `speed`: kSlowest to kFastest. `stays`: at the end it pauses, so that a key can go back.
  Playback(std::chrono::microseconds length, std::chrono::microseconds from, double speed, bool stays);

  // The first call begins.
  void Advance(client::TimePoint now);
  // The place to seek, if the key asks for another one; one step of the pause lasts `kStep`.
  std::optional<std::chrono::microseconds> Press(Key key);

  std::chrono::nanoseconds client_time() const { return client_time_; }
  std::chrono::microseconds place() const { return std::chrono::duration_cast<std::chrono::microseconds>(place_); }
  bool paused() const { return paused_; }
  double speed() const { return speed_; }
  bool ended() const { return ended_; }  // by a key
  // "0:12.30 of 1:00.00, paused"; the speed where it is not 1.
  std::string Line() const;

 private:
  static constexpr std::chrono::nanoseconds kStep = std::chrono::nanoseconds(std::chrono::seconds(1)) / 60;

  std::optional<std::chrono::microseconds> To(std::chrono::nanoseconds place);

  std::chrono::nanoseconds length_, place_;
  double speed_;
  bool stays_, paused_ = false, ended_ = false;
  std::chrono::nanoseconds client_time_{0};
  std::optional<client::TimePoint> before_;
};

}  // namespace tessera::cli
