// InputClock: when the player's next input is due, so that it is at the server just before its tick.
//
// The server takes one input a tick, in order, and reports in its snapshots how many ticks early they came. Too early
// is delay, too late leaves a tick without one. So inputs are made at the world's rate, a little faster while the least
// margin of the last second is too small, a little slower while it is too large.
//
//   clock.Applied(now, snapshot.last_input, snapshot.input_margin_ticks);
//   for (int i = clock.Due(now, playout.tick_rate_hz()); i > 0; --i) clock.Made(MakeInput());
//   double phase = clock.Phase(now);   // share of a tick since the newest input was due
//
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

namespace tessera::client {

class InputClock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // Ticks early that the latest input of a second should be: one is just in time, the half keeps it from the edge.
  static constexpr double kTargetMargin_ticks = 1.5;
  // Faster or slower, as a share of the world's rate, for each tick of error: what is seen is up to a second old, so
  // twice as much would swing.
  static constexpr double kMaxSteer = 0.05, kSteerPerTick = 0.01;
  // Inputs that one call makes up for; after a longer pause the rest is skipped.
  static constexpr int kMaxCatchUp = 4;

  // Takes a snapshot's report: the last input that was applied, and how many ticks before its tick the newest came.
  void Applied(TimePoint now, std::uint32_t last_input, std::int32_t margin_ticks) {
    // Until the first input is known to act, nobody knows which tick the next one should be meant for.
    if (aimed_from_ == 0 && first_ != 0 && last_input >= first_) aimed_from_ = newest_ + 1;
    if (aimed_from_ == 0 || last_input < aimed_from_) return;
    margins_.emplace_back(now, margin_ticks);
    while (now - margins_.front().first > std::chrono::seconds(1)) margins_.pop_front();
  }
  void Made(std::uint32_t number) {
    if (first_ == 0) first_ = number;
    newest_ = number;
  }
  // Inputs due since the last call; the first one at once.
  int Due(TimePoint now, double rate_hz) {
    const double passed_s = last_.has_value() ? std::chrono::duration<double>(now - *last_).count() : 0;
    if (!last_.has_value()) ticks_ = 1;
    last_ = now;
    pace_hz_ = rate_hz * (1 + Steer());
    ticks_ += passed_s * pace_hz_;
    const int due = static_cast<int>(std::min(ticks_, 1e6));
    ticks_ -= due;
    return std::min(due, kMaxCatchUp);
  }
  double Phase(TimePoint now) const {
    if (!last_.has_value()) return 1;
    return std::clamp(ticks_ + std::chrono::duration<double>(now - *last_).count() * pace_hz_, 0.0, 1.0);
  }
  void Stop() {
    last_.reset();
    margins_.clear();
    first_ = aimed_from_ = 0;
  }
  // Least of the last second; 0 while nothing is known.
  std::int32_t margin_ticks() const {
    std::int32_t least = margins_.empty() ? 0 : margins_.front().second;
    for (const auto& [time, ticks] : margins_) least = std::min(least, ticks);
    return least;
  }

 private:
  double Steer() const {
    if (margins_.empty()) return 0;
    return std::clamp(kSteerPerTick * (kTargetMargin_ticks - margin_ticks()), -kMaxSteer, kMaxSteer);
  }

  std::deque<std::pair<TimePoint, std::int32_t>> margins_;
  std::optional<TimePoint> last_;
  double ticks_ = 0, pace_hz_ = 0;
  std::uint32_t first_ = 0, newest_ = 0;  // numbers of inputs since the last Stop
  std::uint32_t aimed_from_ = 0;          // the first that was meant for the right tick; 0: none yet
};

}  // namespace tessera::client
