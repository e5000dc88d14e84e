#include "core/physics/sleep.h"

#include "core/physics/tuning.h"

namespace tessera::physics {

void SleepPass::Run(double dt_s, const Islands& islands, BodyStore& bodies, std::span<const std::uint32_t> restless) {
  restless_.assign(islands.count(), 0);
  for (const std::uint32_t index : restless) restless_[islands.IndexOf(index)] = 1;
  const std::span<RigidBody* const> awake = bodies.awake();
  stirring_.resize(awake.size());
  team_->For(awake.size(), kChunkBodies, [this, awake, dt_s](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PrefetchAfter(i, awake, kUpToState);
      RigidBody& body = *awake[i];
      const BodyState& state = body.state();
      const bool still = body.may_sleep() && allowed_ && Length(state.linear_velocity) < kSleepLinear_m_s &&
                         Length(state.angular_velocity) < kSleepAngular_rad_s;
      const float still_s = still ? state.still_s + static_cast<float>(dt_s) : 0.0f;
      body.SetStill(still_s);
      stirring_[i] = still_s < kSleepAfter_s ? 1 : 0;
    }
  });
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    if (stirring_[i] != 0) restless_[islands.IndexOf(i)] = 1;
  }
  sleepy_.clear();
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    if (restless_[islands.IndexOf(i)] == 0) sleepy_.push_back(awake[i]);
  }
  for (RigidBody* body : sleepy_) {
    bodies.UnlistAwake(*body);
    body->FallAsleep();
  }
}

}  // namespace tessera::physics
