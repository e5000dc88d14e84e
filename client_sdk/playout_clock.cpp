#include "client_sdk/playout_clock.h"

#include <algorithm>
#include <cmath>

namespace tessera::client {
namespace {

constexpr double kRateWindow_s = 1.0;
constexpr std::size_t kMinArrivals = 8;  // for a slope that jitter does not dominate
// Share of a deviation that moves the line, and the mean deviation. Slower follows a changed delay too late.
constexpr double kGain = 0.05;
constexpr double kIntervalsBehind = 2, kJittersBehind = 2.5, kMaxDelay_s = 0.5;
constexpr double kMaxGlide = 0.1;      // share of the world's rate
constexpr double kGlideTime_s = 0.5;   // in which an error is glided away, up to that
constexpr double kJumpBeyond_s = 0.5;  // behind by what gliding would take 5 s to mend; it never goes back
constexpr double kBrakeBeyond_s = 0.08, kBrakePer_s = 10;  // ahead by that much it brakes, fully .09 s further on
// After the last arrival the line goes on for this long: then the world stands.
constexpr double kMaxSilence_s = 0.25;
// Silence and jumps in intervals between snapshots, where those are longer.
constexpr double kIntervalsSilent = 2, kIntervalsJumped = 4;

double Seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

PlayoutClock::PlayoutClock(double tick_rate_hz, double snapshot_rate_hz)
    : nominal_rate_hz_(tick_rate_hz), interval_ticks_(tick_rate_hz / snapshot_rate_hz), rate_hz_(tick_rate_hz) {}

// Where a world in slow motion has long intervals between snapshots.
double PlayoutClock::AtLeastIntervals(double time_s, double intervals) const {
  return std::max(time_s, intervals * interval_ticks_ / rate_hz_);
}

void PlayoutClock::SetPace(TimePoint now, double ticks_per_second, bool paused) {
  if (paused == paused_ && ticks_per_second == nominal_rate_hz_) return;
  head_tick_ = paused || paused_ ? newest_tick_ : HeadAt(now);
  head_time_ = now;
  arrivals_.clear();
  paused_ = paused;
  nominal_rate_hz_ = rate_hz_ = ticks_per_second;
  if (started_) arrivals_.push_back({now, head_tick_});
}

void PlayoutClock::MeasureRate(TimePoint now, double tick) {
  arrivals_.push_back({now, tick});
  while (Seconds(now - arrivals_.front().time) > kRateWindow_s) arrivals_.pop_front();
  const double span_s = Seconds(now - arrivals_.front().time);
  if (arrivals_.size() < kMinArrivals || span_s < kRateWindow_s / 4) return;
  const double measured = (tick - arrivals_.front().tick) / span_s;
  rate_hz_ = std::clamp(measured, nominal_rate_hz_ / 20, nominal_rate_hz_ * 2);
}

void PlayoutClock::Arrived(TimePoint now, Tick arrived) {
  const auto tick = static_cast<double>(arrived.value());
  if (!started_) {
    started_ = true;
    newest_tick_ = head_tick_ = tick;
    head_time_ = shown_time_ = now;
    shown_tick_ = std::max(0.0, tick - delay_ticks());
    arrivals_.push_back({now, tick});
    return;
  }
  const double expected = HeadAt(now);
  const double error = tick - expected;
  if (std::abs(error) > AtLeastIntervals(kJumpBeyond_s, kIntervalsJumped) * rate_hz_) {
    if (error < 0) return;  // long overdue: says nothing about the rhythm
    arrivals_.clear();      // the connection, or the world, has stood
    head_tick_ = tick;
  } else {
    head_tick_ = expected + kGain * error;
    jitter_ticks_ += kGain * (std::abs(error) - jitter_ticks_);
  }
  head_time_ = now;
  if (tick <= newest_tick_) return;
  newest_tick_ = tick;
  MeasureRate(now, tick);
}

double PlayoutClock::HeadAt(TimePoint now) const {
  if (paused_) return newest_tick_;
  return head_tick_ + std::min(Seconds(now - head_time_), AtLeastIntervals(kMaxSilence_s, kIntervalsSilent)) * rate_hz_;
}

double PlayoutClock::delay_ticks() const {
  return std::min(kIntervalsBehind * interval_ticks_ + kJittersBehind * jitter_ticks_,
                  AtLeastIntervals(kMaxDelay_s, kIntervalsBehind) * rate_hz_);
}

double PlayoutClock::Advance(TimePoint now) {
  if (!started_) return 0;
  if (paused_) {
    shown_tick_ += std::clamp(newest_tick_ - shown_tick_, 0.0, std::max(0.0, Seconds(now - shown_time_)) * rate_hz_);
    shown_time_ = now;
    return shown_tick_;
  }
  const double target = std::max(0.0, HeadAt(now) - delay_ticks());
  const double passed = std::max(0.0, Seconds(now - shown_time_)) * rate_hz_;
  shown_time_ = now;
  const double ahead_s = (shown_tick_ + passed - target) / rate_hz_;
  if (ahead_s < -AtLeastIntervals(kJumpBeyond_s, kIntervalsJumped)) {
    ++jumps_;
    return shown_tick_ = target;
  }
  double glide = std::clamp(-ahead_s / kGlideTime_s, -kMaxGlide, kMaxGlide);
  // The world has slowed down or stands: nothing comes to be shown, so the moment brakes, to a halt if need be.
  if (ahead_s > kBrakeBeyond_s) glide = std::max(-1.0, -kMaxGlide - (ahead_s - kBrakeBeyond_s) * kBrakePer_s);
  shown_tick_ += passed * (1 + glide);
  return shown_tick_;
}

}  // namespace tessera::client
