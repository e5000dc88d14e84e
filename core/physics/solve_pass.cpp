#include "core/physics/solve_pass.h"

#include <cmath>

#include "core/physics/exchange.h"
#include "core/physics/motion/free_flight.h"
#include "core/physics/motion/turn.h"

namespace tessera::physics {
namespace {

// A contact's effect on a body that turns fast is known to the second order of the step only. On a needle the error is
// angular momentum about the wrong axis, and far more energy than the solver gave: so much of it is taken again.
// `energy`: twice the energy of turning that the solver left, J.
void KeepEnergy(Vec3d inertia, float energy, BodyMotion* motion) {
  constexpr float kMost = 1.01f;  // below this the error is one of rounding
  const Vec3f spin = AngularVelocityOf(inertia, motion->orientation, motion->angular_momentum);
  const float now = Dot(motion->angular_momentum, spin);
  if (now > kMost * energy && energy >= 0) motion->angular_momentum *= std::sqrt(energy / now);
}

}  // namespace

void SolvePass::Solve(const SolveInput& in) {
  batches_.Fill(in, team_);
  for (IslandBatch& batch : batches_.batches()) {
    if (batch.bodies.empty()) continue;
    solver_.Solve({.bodies = batch.bodies,
                   .contacts = batch.contacts,
                   .joints = batch.joints,
                   .substeps = batch.substeps,
                   .dt_s = static_cast<float>(in.dt_s),
                   .bears = batch.bears});
  }
}

// The solver adds impulses to velocities in single precision: a ship of 2000 t would not feel the steps of its crew,
// and the crew would. So bodies of unanchored islands get the sum of their impulses in doubles.
void SolvePass::SumGains(const SolveInput& in, const IslandBatch& batch) {
  gains_.assign(batch.bodies.size(), {});
  for (const ContactConstraint& contact : batch.contacts) {
    if (contact.a >= batch.sources.size() || contact.b >= batch.sources.size()) continue;  // kStatic, or kinematic
    if (!in.plans[in.islands.IndexOf(batch.sources[contact.a]->awake_index)].unanchored) continue;
    Exchange<double> exchange;
    exchange.Add(*contact.manifold);
    Gain &a = gains_[contact.a], &b = gains_[contact.b];
    a.momentum -= exchange.on_b;
    b.momentum += exchange.on_b;
    a.angular_momentum += exchange.angular_on_a;
    b.angular_momentum += exchange.angular_on_b;
  }
}

// The solver holds inertia still over the step. For a body without joints whose inertia turns with it, that is made
// good here: of the turn, the part that a constant angular velocity made is replaced by free rotation.
BodyMotion SolvePass::MotionOf(const RigidBody& body, const SolverBody& out, const Gain* gain, double dt_s) {
  const auto dt = static_cast<float>(dt_s);
  const Placement& from = body.placement();
  const auto kept_spin = static_cast<float>(body.angular_damping().kept());
  const Vec3f momentum = body.state().angular_momentum * kept_spin, start = body.state().angular_velocity * kept_spin;
  BodyMotion motion;
  motion.position = from.position + Vec3d(out.moved_m);
  motion.velocity = out.velocity;
  Vec3f gained = out.angular_impulse_nms;
  if (gain != nullptr) {
    const Vec3f kept = body.state().linear_velocity * static_cast<float>(body.linear_damping().kept());
    motion.velocity = Vec3f(Vec3d(kept) + body.Acceleration() * dt_s + gain->momentum / body.mass_kg());
    gained = Vec3f(gain->angular_momentum + body.torque_nm * dt_s);
  }
  motion.angular_momentum = momentum + gained;
  motion.turned_rad = out.turned_rad;
  const Vec3f mean = (start + out.angular_velocity) * 0.5f;
  const bool turns_inertia = TurnsItsInertia(body, mean, dt);
  if (turns_inertia && body.joints.empty()) {
    FlightState flight{{}, from.orientation, {}, momentum + gained * 0.5f};
    Fly(body.inertia(), {}, {}, dt_s, &flight);
    motion.orientation = Turned(flight.orientation, Vec3d(out.turned_rad - mean * dt));
  } else {
    motion.orientation = Turned(from.orientation, Vec3d(out.turned_rad));
  }
  if (turns_inertia) KeepEnergy(body.inertia(), Dot(motion.angular_momentum, out.angular_velocity), &motion);
  return motion;
}

void SolvePass::ReadBack(const SolveInput& in, std::span<BodyMotion> motions) {
  for (const IslandBatch& batch : batches_.batches()) {
    if (batch.unanchored) SumGains(in, batch);
    team_.For(batch.sources.size(), kChunkBodies, [this, motions, &in, &batch](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        PrefetchAfter(i, std::span<const RigidBody* const>(batch.sources), kUpToFrame);
        const RigidBody& body = *batch.sources[i];
        const bool unanchored = batch.unanchored && in.plans[in.islands.IndexOf(body.awake_index)].unanchored;
        motions[body.awake_index] = MotionOf(body, batch.bodies[i], unanchored ? &gains_[i] : nullptr, in.dt_s);
      }
    });
  }
}

}  // namespace tessera::physics
