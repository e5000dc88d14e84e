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

// Where a body without joints, whose inertia turns with it, has turned to: it flies half the step as it came, is turned
// by what it was pushed within the step, and flies the other half with the momentum that it has then.
Quatd TurnedFree(const RigidBody& body, const SolverBody& out, const Quatd& midway, Vec3f momentum, double dt_s) {
  const StartingTurn start(body);
  // The exact flight of the whole step where nothing acted.
  const bool flies = momentum == start.momentum;
  const Vec3f spin = AngularVelocityOf(body.inertia(), midway, start.momentum);
  const Vec3f pushed = out.turned_rad - (spin + out.angular_velocity) * static_cast<float>(dt_s / 2);
  FlightState flight{{}, flies ? body.placement().orientation : Turned(midway, Vec3d(pushed)), {}, momentum};
  Fly(body.inertia(), {}, {}, flies ? dt_s : dt_s / 2, &flight);
  return flight.orientation;
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

BodyMotion SolvePass::MotionOf(const RigidBody& body, const SolverBody& out, const Quatd& midway, const Gain* gain,
                               double dt_s) {
  const StartingTurn start(body);
  const Placement& from = body.placement();
  BodyMotion motion;
  motion.position = from.position + Vec3d(out.moved_m);
  motion.velocity = out.velocity;
  Vec3f gained = out.angular_impulse_nms;
  if (gain != nullptr) {
    const Vec3f kept = body.state().linear_velocity * static_cast<float>(body.linear_damping().kept());
    motion.velocity = Vec3f(Vec3d(kept) + body.Acceleration() * dt_s + gain->momentum / body.mass_kg());
    gained = Vec3f(gain->angular_momentum + body.torque_nm * dt_s);
  }
  motion.angular_momentum = start.momentum + gained;
  motion.turned_rad = out.turned_rad;
  const bool turns_inertia =
      TurnsItsInertia(body, (start.spin + out.angular_velocity) * 0.5f, static_cast<float>(dt_s));
  motion.orientation = turns_inertia && body.joints.empty()
                           ? TurnedFree(body, out, midway, motion.angular_momentum, dt_s)
                           : Turned(from.orientation, Vec3d(out.turned_rad));
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
        motions[body.awake_index] =
            MotionOf(body, batch.bodies[i], batch.midways[i], unanchored ? &gains_[i] : nullptr, in.dt_s);
      }
    });
  }
}

}  // namespace tessera::physics
