// TickLog: whether a region has a standby, what that is sent of each tick, and how far it has followed.
//
// Promise: the first message after SwitchOn or Restart holds a whole state; each that follows, the changes since the
// one before. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <cassert>
#include <optional>
#include <span>

#include "core/region/log.h"

namespace tessera::region {

class TickLog {
 public:
  explicit TickLog(double tick_s) : writer_(tick_s) {}

  // There is a standby from now on, or another one, or none any more.
  void Switch(bool on) {
    on_ = on;
    Restart();
  }
  bool on() const { return on_; }
  // The next message is a whole state, and the standby has nothing until then.
  void Restart() {
    acknowledged_ = Tick();
    writer_.Restart();
  }
  // The standby has all up to this tick; `now` is the region's.
  void Acknowledged(Tick up_to, Tick now) {
    if (on_ && up_to <= now) acknowledged_ = std::max(acknowledged_, up_to);
  }
  // Tick up to which the standby has all; tick 0 as long as it has nothing, and without one.
  Tick acknowledged() const { return acknowledged_; }
  // The same; none without a standby.
  std::optional<Tick> standby_has() const { return on_ ? std::optional(acknowledged_) : std::nullopt; }

  // Whether the next message is a whole state.
  bool whole() const { return writer_.whole(); }
  // The message of a tick; `touching` counts only for a whole state. Requires on().
  Bytes Write(const LogView& now, std::span<const TouchingPair> touching) { return writer_.Write(now, touching); }

  // For the end of the step to `now`: its message is written, and the standby has none that is not.
  void Validate([[maybe_unused]] Tick now) const {
    assert(on_ ? !whole() && writer_.tick() == now : acknowledged_ == Tick());
    assert(acknowledged_ <= now);
  }

 private:
  bool on_ = false;
  Tick acknowledged_;
  LogWriter writer_;
};

}  // namespace tessera::region
