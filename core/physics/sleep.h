// SleepPass: islands whose bodies have all been still for long enough fall asleep.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "core/physics/body_store.h"
#include "core/physics/islands.h"

namespace tessera::physics {

class SleepPass {
 public:
  // `allowed`: false for a world in which nothing sleeps.
  explicit SleepPass(bool allowed) : allowed_(allowed) {}

  // After bodies were moved: counts for how long each awake one has been still, and takes islands that sleep out of
  // `awake`.
  void Run(double dt_s, const Islands& islands, BodyStore& bodies);

 private:
  bool allowed_;
  std::vector<std::uint8_t> restless_;  // by island
  std::vector<RigidBody*> sleepy_;
};

}  // namespace tessera::physics
