// WorkBudget: how much work one call may still do, counted rather than measured, so that no poll is dearer than another
// and tests see the same on every machine.
//
//   WorkBudget budget(kUnitsAPoll);
//   while (budget.left() && more_to_do) { ...; budget.Spend(kUnitsATriangle); }
//
// A unit is some ten nanoseconds of a common processor. A piece of work that has begun is ended, so a budget may be
// overdrawn by one piece. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <limits>

namespace tessera::client {

// Work of a poll, beside receiving and predicting, on what takes many: a scene that is read, ground that is looked for
// and built. About a millisecond; the first polls do so much, and all later ones no more.
inline constexpr std::int64_t kUnitsAPoll = 100'000;

class WorkBudget {
 public:
  explicit WorkBudget(std::int64_t units) : left_(units), units_(units) {}
  static WorkBudget Unlimited() { return WorkBudget(std::numeric_limits<std::int64_t>::max()); }

  bool left() const { return left_ > 0; }
  std::int64_t units_left() const { return left_ > 0 ? left_ : 0; }
  void Spend(std::int64_t units) { left_ -= units; }
  std::int64_t spent() const { return units_ - left_; }

 private:
  std::int64_t left_, units_;
};

}  // namespace tessera::client
