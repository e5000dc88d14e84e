// TurnLock: a lock that is handed on by turns. Those that are urgent, such as a death and the orders that follow from
// it, go before all others, and whoever gives the lock back hands it to the next one: nobody slips in between.
//
// So a holder that takes long, since it writes to a slow store, delays an urgent one by itself alone, however many
// others wait. Players who join and leave, and who may be any number, come last: they delay an operator by the one
// whose turn it is. The others get a turn at the latest once they have waited for kOrdinaryPatience, one each time.
//
//   TurnLock turns;
//   const std::lock_guard lock(turns);      // an ordinary turn; std::unique_lock and condition_variable_any too
//   UrgentTurn urgent(turns);
//   const std::lock_guard lock(urgent);     // an urgent one; with a LastTurn, one after all others
//   if (turns.try_lock_for(std::chrono::milliseconds(100))) ...
//
// Thread rule: any thread; whoever has locked it unlocks it. Not recursive.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace tessera::control {

class TurnLock {
 public:
  using Clock = std::chrono::steady_clock;
  // Longer, and commands wait while many urgent messages come one after the other; shorter, and of two slow writes one
  // more is ordinary.
  static constexpr std::chrono::milliseconds kOrdinaryPatience{500};

  void lock() { Lock(ordinary_, Clock::time_point::max()); }
  void lock_urgent() { Lock(urgent_, Clock::time_point::max()); }
  void lock_last() { Lock(last_, Clock::time_point::max()); }
  // An ordinary turn; false: it did not come in time.
  bool try_lock_for(std::chrono::nanoseconds patience) { return Lock(ordinary_, Clock::now() + patience); }
  void unlock();
  // How many wait for a turn.
  int waiting() const;

 private:
  struct Line {
    std::condition_variable handed;
    int waiting = 0;
    bool has_turn = false;      // it was handed to one of these, who has not woken yet
    Clock::time_point since{};  // since when they wait without a turn of theirs
  };

  bool Lock(Line& line, Clock::time_point until);

  mutable std::mutex mutex_;  // guards what follows
  bool held_ = false;         // also while it is being handed on
  Line urgent_, ordinary_, last_;
};

// The urgent side of a TurnLock, for std::unique_lock and std::condition_variable_any.
class UrgentTurn {
 public:
  explicit UrgentTurn(TurnLock& turns) : turns_(turns) {}
  void lock() { turns_.lock_urgent(); }
  void unlock() { turns_.unlock(); }

 private:
  TurnLock& turns_;
};

// Likewise of those who come last.
class LastTurn {
 public:
  explicit LastTurn(TurnLock& turns) : turns_(turns) {}
  void lock() { turns_.lock_last(); }
  void unlock() { turns_.unlock(); }

 private:
  TurnLock& turns_;
};

}  // namespace tessera::control
