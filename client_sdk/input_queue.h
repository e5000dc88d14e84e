// InputQueue: the inputs that a client has made and still sends.
//
// Each input goes into kSendings messages, one a tick, so that it arrives although two messages in a row are lost.
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <chrono>
#include <deque>
#include <optional>
#include <vector>

#include "core/replication/input.h"
#include "core/world/player_input.h"

namespace tessera::client {

class InputQueue {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  static constexpr int kSendings = 3;

  // A new input is due at once. More than fit in a message means that nobody listens: the oldest are stale then.
  void Push(const PlayerInput& input) {
    queue_.push_back({input, kSendings});
    if (queue_.size() > replication::kMaxInputs) queue_.pop_front();
    sent_at_.reset();
  }
  void Clear() { queue_.clear(); }
  bool Due(TimePoint now, std::chrono::nanoseconds tick_length) const {
    return !queue_.empty() && (!sent_at_ || now - *sent_at_ >= tick_length);
  }
  // The inputs whose body satisfies `wanted`, ascending by number.
  template <class Wanted>
  std::vector<PlayerInput> Select(const Wanted& wanted) const {
    std::vector<PlayerInput> inputs;
    for (const Queued& queued : queue_) {
      if (wanted(queued.input.body)) inputs.push_back(queued.input);
    }
    return inputs;
  }
  // All that is queued has been sent once more.
  void Sent(TimePoint now) {
    sent_at_ = now;
    for (Queued& queued : queue_) --queued.sendings_left;
    std::erase_if(queue_, [](const Queued& queued) { return queued.sendings_left <= 0; });
  }

 private:
  struct Queued {
    PlayerInput input;
    int sendings_left = 0;
  };

  std::deque<Queued> queue_;          // ascending by number
  std::optional<TimePoint> sent_at_;  // nothing: an input was pushed since
};

}  // namespace tessera::client
