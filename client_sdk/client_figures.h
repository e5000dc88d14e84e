// ClientFigures: the counts that a client keeps of itself: bytes, records, work and durations.
//
//   figures.BeginPoll(since_last);
//   figures.Received(bytes);  figures.Work(units);  figures.Sent(bytes);
//   figures.MeasureRates(now);
//   figures.EndPoll(took);
//   figures.AddTo(stats);
//
// Promise: totals never go back, be connections dropped meanwhile or not; rates are those of the last second or so.
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "client_sdk/stats.h"

namespace tessera::client {

class ClientFigures {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // `since_last`: between the beginnings of two polls; nothing for the first.
  void BeginPoll(std::optional<std::chrono::nanoseconds> since_last);
  void EndPoll(std::chrono::nanoseconds took) { network_time_.Add(took); }
  void Interpolated(std::chrono::nanoseconds took) { update_time_.Add(took); }
  // Units (WorkBudget) of the poll under way.
  void Work(std::int64_t units);

  void Received(std::size_t bytes) { bytes_in_ += bytes; }
  void Sent(std::size_t bytes) { bytes_out_ += bytes; }
  void TookRecords(std::uint64_t full, std::uint64_t delta);
  void InputRefused() { ++inputs_refused_; }
  // The connection is no more; its counts stay in the sums.
  void Dropped(const RegionStats& connection);
  // Takes a sample of the traffic, unless one has just been taken.
  void MeasureRates(TimePoint now);

  void AddTo(ClientStats& stats) const;

 private:
  struct Traffic {
    TimePoint time;
    std::uint64_t in = 0, out = 0;
  };

  std::uint64_t bytes_in_ = 0, bytes_out_ = 0, full_records_ = 0, delta_records_ = 0, inputs_refused_ = 0;
  RegionStats dropped_;               // sums over connections that are no more
  std::deque<Traffic> traffic_;       // over the last second
  std::int64_t work_ = 0, most_ = 0;  // in the poll under way, and in any
  DurationStats frame_time_, network_time_, update_time_;
};

}  // namespace tessera::client
