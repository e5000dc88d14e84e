// PollSchedule: when each of many clients in one thread is to be polled, so that being late never makes it later.
//
// Each client has a slot of its own in every period, evenly apart. A client that is reached after the beginning of its
// next slot has missed the ones between: they are counted as late and dropped, so there is never more than one poll due
// for a client, however slow the machine is.
//
//   PollSchedule schedule(std::chrono::milliseconds(33), players);
//   while (const auto due = schedule.Take(now)) clients[*due].Poll(now);
//   sleep until schedule.next();
//
// Thread rule: one thread at a time; time comes in.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

namespace tessera::local {

class PollSchedule {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // `places`: how many clients there may be; the slot of client i begins i / places of a period late.
  PollSchedule(std::chrono::nanoseconds period, std::size_t places) : period_(period), places_(places) {}

  // Client `index` is polled from now on. Requires index < places, and each once.
  void Add(std::size_t index, Time now) {
    const auto shift = period_ * static_cast<std::int64_t>(index) / static_cast<std::int64_t>(places_);
    slots_.emplace(now + shift, index);
  }

  // The client that has waited longest, if one is due; its next slot is the first that has not begun.
  std::optional<std::size_t> Take(Time now) {
    if (slots_.empty() || slots_.top().first > now) return std::nullopt;
    const auto [due, index] = slots_.top();
    slots_.pop();
    const std::int64_t missed = (now - due) / period_;
    late_ += static_cast<std::uint64_t>(missed);
    ++taken_;
    slots_.emplace(due + (missed + 1) * period_, index);
    return index;
  }
  // Client `index` is polled no more.
  void Remove(std::size_t index) {
    std::vector<Slot> kept;
    for (; !slots_.empty(); slots_.pop()) {
      if (slots_.top().second != index) kept.push_back(slots_.top());
    }
    slots_ = Slots(std::greater<>(), std::move(kept));
  }

  // When the next client is due; nothing without clients.
  std::optional<Time> next() const { return slots_.empty() ? std::nullopt : std::optional(slots_.top().first); }
  std::uint64_t taken() const { return taken_; }  // polls that were made
  std::uint64_t late() const { return late_; }    // polls that were dropped, because the slot after them had begun

 private:
  using Slot = std::pair<Time, std::size_t>;
  using Slots = std::priority_queue<Slot, std::vector<Slot>, std::greater<>>;

  std::chrono::nanoseconds period_;
  std::size_t places_;
  Slots slots_;
  std::uint64_t taken_ = 0, late_ = 0;
};

}  // namespace tessera::local
