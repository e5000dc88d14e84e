#include "control_plane/turn_lock.h"

namespace tessera::control {

bool TurnLock::Lock(Line& line, Clock::time_point until) {
  std::unique_lock lock(mutex_);
  if (!held_) {
    held_ = true;
    return true;
  }
  if (line.waiting == 0) line.since = Clock::now();
  ++line.waiting;
  const auto has_turn = [&line] { return line.has_turn; };
  bool got = true;
  if (until == Clock::time_point::max()) {
    line.handed.wait(lock, has_turn);
  } else {
    got = line.handed.wait_until(lock, until, has_turn);
  }
  --line.waiting;
  if (got) line.has_turn = false;
  return got;
}

void TurnLock::unlock() {
  const std::lock_guard lock(mutex_);
  Line* next = nullptr;
  const auto overdue = [now = Clock::now()](const Line& line) { return now - line.since >= kOrdinaryPatience; };
  for (Line* line : {&last_, &ordinary_, &urgent_}) {  // the first of them comes last
    if (line->waiting > 0 && (next == nullptr || !overdue(*next))) next = line;
  }
  if (next == nullptr) {
    held_ = false;
    return;
  }
  next->since = Clock::now();
  next->has_turn = true;
  next->handed.notify_one();
}

int TurnLock::waiting() const {
  const std::lock_guard lock(mutex_);
  return urgent_.waiting + ordinary_.waiting + last_.waiting;
}

}  // namespace tessera::control
