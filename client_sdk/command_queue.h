// CommandQueue: the commands that a client has given and that no region has taken for good yet.
//
// A region says how far it has taken them; until then they are sent again, beginning with the lowest, so they are taken
// in order and each once. Numbers begin when the first region has spoken: beyond all that an earlier process of this
// player can have had under way.
//
//   absl::Status status = queue.Push(bytes);
//   if (queue.Due(now)) send(queue.Write(now, last_event));
//   queue.Taken(news.last_command());
//
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"

namespace tessera::client {

class CommandQueue {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  static constexpr std::size_t kMaxPending = 64;
  static constexpr std::chrono::milliseconds kRepeat{50}, kHurry{16};
  static constexpr int kHurried = 2;  // repetitions so soon
  // An acknowledgement of events goes so many times: it is not answered, and costs a few bytes.
  static constexpr int kAcknowledgements = 3;

  // INVALID_ARGUMENT "bytes: 2048 are more than 1024"; RESOURCE_EXHAUSTED "64 commands wait ...".
  // `shown_at`: as PlayerInput has it. `with_input`: the input that it goes with, 0: none; it is sent three times, a
  // tick apart, as that is.
  absl::Status Push(std::string_view bytes, std::uint64_t shown_at = 0, std::uint32_t with_input = 0);
  // The number that the next command gets; nothing before the first region has spoken.
  std::optional<std::uint32_t> next() const {
    return begun_ ? std::optional(base_ + static_cast<std::uint32_t>(pending_.size())) : std::nullopt;
  }
  // A region says that all commands up to this number are taken.
  void Taken(std::uint32_t last_command);
  // A region will never take this one.
  void Drop(std::uint32_t number);
  // Events have come, or have come again: that they are here is to be said.
  void EventsCame() { acknowledgements_due_ = kAcknowledgements; }

  bool Due(TimePoint now) const;
  // The next datagram. Requires Due.
  std::vector<std::uint8_t> Write(TimePoint now, std::uint32_t last_event);
  std::size_t pending() const { return pending_.size(); }

 private:
  bool begun_ = false;
  std::uint32_t base_ = 0;  // number of the first one that is pending, or of the next one; 0 before it has begun
  struct Pending {
    std::string bytes;
    std::uint64_t shown_at = 0;
    std::uint32_t with_input = 0;
  };
  std::deque<Pending> pending_;
  std::size_t sent_ = 0;  // how many of those went out at least once
  std::optional<TimePoint> sent_at_;
  int acknowledgements_due_ = 0;
  int hurry_ = 0;  // repetitions that are to come soon
};

}  // namespace tessera::client
