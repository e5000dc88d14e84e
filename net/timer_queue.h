// TimerQueue: when each session of an acceptor is due, the earliest first.
//
//   timers.Move(number, session.due, new_due);
//   while (timers.first() && timers.first()->at <= now) ...
//
// Thread rule: one thread.
#pragma once

#include <optional>
#include <set>

#include "net/acceptor.h"

namespace tessera::net {

class TimerQueue {
 public:
  using TimePoint = Acceptor::TimePoint;
  struct Timer {
    TimePoint at;
    SessionNumber session;
    friend auto operator<=>(const Timer&, const Timer&) = default;
  };

  // Moves a session's timer from `due` to `to`, and stores that in `due`; nothing means never.
  void Move(SessionNumber session, std::optional<TimePoint>& due, std::optional<TimePoint> to) {
    if (due) timers_.erase({*due, session});
    due = to;
    if (due) timers_.insert({*due, session});
  }
  std::optional<Timer> first() const { return timers_.empty() ? std::nullopt : std::optional(*timers_.begin()); }

 private:
  std::set<Timer> timers_;
};

}  // namespace tessera::net
