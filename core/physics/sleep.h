// SleepPass: islands whose bodies have all been still for long enough fall asleep.
//
// Thread rule: one thread at a time, which leads the team.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/body_store.h"
#include "core/physics/islands.h"
#include "core/physics/thread_team.h"

namespace tessera::physics {

class SleepPass {
 public:
  // `allowed`: false for a world in which nothing sleeps.
  explicit SleepPass(bool allowed, ThreadTeam& team = ThreadTeam::Alone()) : allowed_(allowed), team_(&team) {}

  // After bodies were moved: counts for how long each awake one has been still, and takes islands that sleep out of
  // `awake`. An island does not sleep that has one of `restless`, by awake_index.
  void Run(double dt_s, const Islands& islands, BodyStore& bodies, std::span<const std::uint32_t> restless = {});
  // Nothing is awake that could fall asleep.
  void RunIdle() { sleepy_.clear(); }
  // Those that the last run took out, in no order.
  std::span<RigidBody* const> fallen_asleep() const { return sleepy_; }

 private:
  bool allowed_;
  ThreadTeam* team_;
  std::vector<std::uint8_t> stirring_;  // by awake_index: the body has not been still for long enough
  std::vector<std::uint8_t> restless_;  // by island
  std::vector<RigidBody*> sleepy_;
};

}  // namespace tessera::physics
