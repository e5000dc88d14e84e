#include "control_plane/turn_lock.h"

namespace tessera::control {

bool TurnLock::Lock(Line& line, Clock::time_point until) {
  std::unique_lock lock(mutex_);
  if (!held_) {
    held_ = true;
    return true;
  }
  if (&line == &ordinary_ && line.waiting == 0) ordinary_since_ = Clock::now();
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
  const bool overdue = ordinary_.waiting > 0 && Clock::now() - ordinary_since_ >= kOrdinaryPatience;
  Line* next = nullptr;
  if (urgent_.waiting > 0 && !overdue) {
    next = &urgent_;
  } else if (ordinary_.waiting > 0) {
    next = &ordinary_;
    ordinary_since_ = Clock::now();
  }
  if (next == nullptr) {
    held_ = false;
    return;
  }
  next->has_turn = true;
  next->handed.notify_one();
}

int TurnLock::waiting() const {
  const std::lock_guard lock(mutex_);
  return urgent_.waiting + ordinary_.waiting;
}

}  // namespace tessera::control
