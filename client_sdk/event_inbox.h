// EventInbox: the game's events for this player, each once and in order, whichever regions they came from.
//
// Regions send again what they do not know to be here, and after a handover two of them may speak: that of the higher
// epoch of the body's ownership counts. A world that was restored from a checkpoint counts anew from where it was; it
// is known by all its regions having been lost before.
//
// Pure. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/client.h"

namespace tessera::client {

class EventInbox {
 public:
  // News of the region that owns the body with this epoch. False: they are out of date.
  bool Accept(std::uint32_t epoch) {
    if (epoch < epoch_) return false;
    epoch_ = epoch;
    return true;
  }
  // Events up to `last`, by an accepted one.
  void Take(std::uint32_t last, std::vector<GameEvent> events) {
    std::uint32_t number = last - static_cast<std::uint32_t>(events.size());
    if (!begun_ || (lost_ && last < last_)) last_ = number;
    begun_ = true;
    lost_ = false;
    for (GameEvent& event : events) {
      if (++number <= last_) continue;
      last_ = number;
      waiting_.push_back(std::move(event));
    }
  }
  // No region is connected any more.
  void AllLost() {
    epoch_ = 0;
    lost_ = true;
  }

  std::uint32_t last() const { return last_; }
  std::vector<GameEvent> TakeAll() {
    std::vector<GameEvent> all(std::move_iterator(waiting_.begin()), std::move_iterator(waiting_.end()));
    waiting_.clear();
    return all;
  }

 private:
  bool begun_ = false, lost_ = false;
  std::uint32_t epoch_ = 0, last_ = 0;
  std::deque<GameEvent> waiting_;
};

}  // namespace tessera::client
