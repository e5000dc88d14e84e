#include "core/physics/integrate.h"

#include <algorithm>
#include <atomic>

#include "core/physics/motion/free_flight.h"

namespace tessera::physics {
namespace {

bool IsFinite(const BodyMotion& motion) {
  return tessera::IsFinite(motion.position) && tessera::IsFinite(motion.orientation) &&
         tessera::IsFinite(motion.velocity) && tessera::IsFinite(motion.angular_momentum);
}

bool AreFinite(std::span<const BodyMotion> motions, ThreadTeam& team) {
  std::atomic<bool> finite = true;
  team.For(motions.size(), kChunkBodies, [motions, &finite](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!IsFinite(motions[i])) finite.store(false, std::memory_order_relaxed);
    }
  });
  return finite.load(std::memory_order_relaxed);
}

bool Faster(const RigidBody& a, const RigidBody& b) {
  const float speed_a = Length(a.state().linear_velocity), speed_b = Length(b.state().linear_velocity);
  return speed_a > speed_b || (speed_a == speed_b && a.id() < b.id());
}

}  // namespace

BodyMotion FreeFlightOf(const RigidBody& body, double dt_s) {
  const BodyState& state = body.state();
  const Vec3d a = body.Acceleration();
  const Placement& from = body.placement();
  FlightState flight{from.position, from.orientation, state.linear_velocity, state.angular_momentum};
  const Damping &damping = body.linear_damping(), &spin_damping = body.angular_damping();
  if (!spin_damping.none()) flight.angular_momentum *= static_cast<float>(spin_damping.kept());
  Fly(body.inertia(), a, body.torque_nm, dt_s, &flight);
  if (!damping.none()) {
    const Vec3d v(state.linear_velocity);
    flight.position = from.position + v * damping.slid_s() + a * damping.fallen_s2();
    flight.velocity = Vec3f(v * damping.kept() + a * damping.slid_s());
  }
  return {flight.position, flight.orientation, flight.velocity, flight.angular_momentum,
          state.angular_velocity * static_cast<float>(dt_s)};
}

void FlyFree(std::span<RigidBody* const> awake, const Islands& islands, std::span<const IslandPlan> plans, double dt_s,
             std::span<BodyMotion> motions, ThreadTeam& team) {
  team.For(awake.size(), kChunkBodies, [awake, plans, motions, dt_s, &islands](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t island = islands.IndexOf(static_cast<std::uint32_t>(i));
      if (!plans[island].solved) motions[i] = FreeFlightOf(*awake[i], dt_s);
    }
  });
}

void Integrator::Run(std::span<RigidBody* const> awake, const Islands& islands, std::span<const BodyMotion> motions) {
  failed_.clear();
  failing_.clear();
  if (!AreFinite(motions, team_)) {
    failed_.resize(islands.count(), 0);
    for (std::uint32_t i = 0; i < awake.size(); ++i) {
      if (!IsFinite(motions[i])) failed_[islands.IndexOf(i)] = 1;
    }
  }
  team_.For(awake.size(), kChunkBodies, [this, awake, motions, &islands](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PrefetchAfter(i, awake, kUpToFrame);
      RigidBody& body = *awake[i];
      body.force_n = body.torque_nm = {};
      if (!failed_.empty() && failed_[islands.IndexOf(static_cast<std::uint32_t>(i))] != 0) continue;
      const BodyMotion& motion = motions[i];
      body.Move(motion.position, motion.orientation, motion.velocity, motion.angular_momentum);
    }
  });
  if (!failed_.empty()) FindFailing(awake, islands);
}

// The body that is given up is the fastest one; of equally fast ones, the one with the lowest id.
void Integrator::FindFailing(std::span<RigidBody* const> awake, const Islands& islands) {
  std::vector<RigidBody*> worst(islands.count(), nullptr);
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    const std::uint32_t island = islands.IndexOf(i);
    if (failed_[island] == 0) continue;
    RigidBody*& candidate = worst[island];
    if (candidate == nullptr || Faster(*awake[i], *candidate)) candidate = awake[i];
  }
  for (RigidBody* body : worst) {
    if (body != nullptr) failing_.push_back(body);
  }
}

bool Integrator::Validate(std::span<RigidBody* const> awake) {
  return std::all_of(awake.begin(), awake.end(), [](const RigidBody* body) {
    return tessera::IsFinite(body->state().position) && tessera::IsFinite(body->state().linear_velocity) &&
           body->force_n == Vec3d() && body->torque_nm == Vec3d();
  });
}

}  // namespace tessera::physics
