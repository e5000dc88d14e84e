// The second half of a step: islands are weighed and solved, the rest flies.
#include <algorithm>
#include <cmath>

#include "core/physics/exchange.h"
#include "core/physics/motion/free_flight.h"
#include "core/physics/motion/turn.h"
#include "core/physics/tuning.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {
namespace {

// Faster than this, rad a step, a body's inertia turns enough with it to be felt.
constexpr float kGyroscopicTurn_rad = 1e-3f;

// Whether its inertia turns with the body by so much in a step that it is felt. `spin`: of the step, rad/s.
bool TurnsItsInertia(const RigidBody& body, Vec3f spin, float dt_s) {
  return !body.round() && Length(spin) * dt_s >= kGyroscopicTurn_rad;
}

// What a contact does to a body that turns fast is known to the second order of the step only. On a needle the error is
// angular momentum about the wrong axis, and far more energy than the solver gave: so much of it is taken again.
// `energy`: twice what the solver left in the turning, J.
template <class Motion>
void KeepEnergy(Vec3d inertia, float energy, Motion* motion) {
  constexpr float kMost = 1.01f;  // below this the error is one of rounding
  const Vec3f spin = AngularVelocityOf(inertia, motion->orientation, motion->angular_momentum);
  const float now = Dot(motion->angular_momentum, spin);
  if (now > kMost * energy && energy >= 0) motion->angular_momentum *= std::sqrt(energy / now);
}

// Impulses are those of one substep.
float WarmScale(int last_substeps, int substeps) {
  return last_substeps == 0 ? 1.0f : static_cast<float>(last_substeps) / static_cast<float>(substeps);
}

}  // namespace

void World::Impl::FillBatches() {
  ChooseSubsteps();
  for (Batch& batch : batches) {
    batch.adrift = false;
    batch.bodies.clear();
    batch.of.clear();
    batch.contacts.clear();
    batch.joints.clear();
  }
  solver_indices.resize(awake.size());
  for (RigidBody* body : awake) {
    const Island& island = islands.Of(body->awake_index);
    if (!island.solved) continue;
    Batch& batch = batches[static_cast<std::size_t>(island.batch)];
    batch.adrift |= island.adrift;
    body->substeps = batch.substeps;
    body->island_load = island.load;
    solver_indices[body->awake_index] = static_cast<std::uint32_t>(batch.bodies.size());
    const BodyState& state = body->state();
    const auto kept = static_cast<float>(body->linear_damping().kept());
    const auto kept_spin = static_cast<float>(body->angular_damping().kept());
    SolverBody in;
    const Quatd& start = body->placement().orientation;
    in.velocity = state.linear_velocity * kept;
    in.angular_velocity = state.angular_velocity * kept_spin;
    in.rotation = body->placement().rotation;
    // A joint holds a body by where it turns to, so that of a jointed body must be right as the solver has it. It gets
    // its inertia, and the velocity that its angular momentum gives, as they will be half way through the step: the
    // rule of the midpoint.
    if (!body->joints.empty() && TurnsItsInertia(*body, in.angular_velocity, static_cast<float>(dt_s))) {
      const Quatd midway = Turned(start, Vec3d(in.angular_velocity) * (dt_s / 2));
      in.angular_velocity = AngularVelocityOf(body->inertia(), midway, state.angular_momentum * kept_spin);
      in.rotation = RotationOf(midway);
    }
    in.acceleration = Vec3f(body->Acceleration());
    if (body->torque_nm != Vec3d()) {
      in.angular_acceleration = AngularVelocityOf(body->inertia(), start, Vec3f(body->torque_nm));
    }
    in.mass_kg = static_cast<float>(body->mass_kg());
    in.inertia_kg_m2 = Vec3f(body->inertia());
    batch.bodies.push_back(in);
    batch.of.push_back(body);
  }
  FillContacts();
  FillJoints();
}

// A body that sleeps beside what is awake, and would wake if that came upon it, stands as firm as a static one.
void World::Impl::FillContacts() {
  const auto index = [this](std::uint32_t body) { return body != kAsleep ? solver_indices[body] : kStatic; };
  for (Touch& touch : touching) {
    if (!touch.responds) continue;
    const Island& island = islands.Of(touch.one());
    if (!island.solved) continue;
    Batch& batch = batches[static_cast<std::size_t>(island.batch)];
    const float warm_scale = WarmScale(touch.substeps, batch.substeps);
    const std::uint32_t low = index(touch.low), high = index(touch.high);
    for (std::uint32_t i = 0; i < touch.count; ++i) {
      batch.contacts.push_back({low, high, touch.manifolds + i, touch.material, touch.slop_m, warm_scale});
    }
    touch.substeps = batch.substeps;
  }
}

void World::Impl::FillJoints() {
  const auto index = [this](const RigidBody& body) {
    return body.awake() ? solver_indices[body.awake_index] : kStatic;
  };
  for (std::size_t i = 0; i < awake_joints.size(); ++i) {
    Joint& joint = *awake_joints[i];
    const RigidBody& one = joint.a->awake() ? *joint.a : *joint.b;
    Batch& batch = batches[static_cast<std::size_t>(islands.Of(one.awake_index).batch)];
    // The world takes the part of body a.
    batch.joints.push_back({.a = joint.b != nullptr ? index(*joint.a) : kStatic,
                            .b = index(joint.b != nullptr ? *joint.b : *joint.a),
                            .rows = &joint_rows[i],
                            .impulses = joint.model.impulses.data(),
                            .warm_scale = WarmScale(joint.substeps, batch.substeps)});
    joint.substeps = batch.substeps;
  }
}

void World::Impl::FlyFree() {
  motions.resize(awake.size());
  racing.clear();
  for (RigidBody* body : awake) {
    if (islands.Of(body->awake_index).solved) continue;
    const BodyState& state = body->state();
    const Vec3d a = body->Acceleration();
    FlightState flight{body->placement().position, body->placement().orientation, state.linear_velocity,
                       state.angular_momentum};
    const Damping &damping = body->linear_damping(), &spin_damping = body->angular_damping();
    if (!spin_damping.none()) flight.angular_momentum *= static_cast<float>(spin_damping.kept());
    Fly(body->inertia(), a, body->torque_nm, dt_s, &flight);
    if (!damping.none()) {
      const Vec3d v(state.linear_velocity);
      flight.position = body->placement().position + v * damping.slid_s() + a * damping.fallen_s2();
      flight.velocity = Vec3f(v * damping.kept() + a * damping.slid_s());
    }
    motions[body->awake_index] = {flight.position, flight.orientation, flight.velocity, flight.angular_momentum,
                                  state.angular_velocity * static_cast<float>(dt_s)};
    NoteWay(*body);
  }
}

void World::Impl::SolveBatches() {
  for (Batch& batch : batches) {
    if (batch.bodies.empty()) continue;
    solver.Solve({.bodies = batch.bodies,
                  .contacts = batch.contacts,
                  .joints = batch.joints,
                  .substeps = batch.substeps,
                  .dt_s = static_cast<float>(dt_s)});
  }
  ReadBatches();
}

// Of those that are adrift. The solver adds impulses to velocities in single precision: a ship of 2000 t would not
// feel the steps of its crew, and the crew would.
void World::Impl::SumGains(const Batch& batch) {
  gains.assign(batch.bodies.size(), {});
  for (const ContactConstraint& contact : batch.contacts) {
    if (contact.a == kStatic || contact.b == kStatic || !islands.Of(batch.of[contact.a]->awake_index).adrift) continue;
    Exchange<double> exchange;
    exchange.Add(*contact.manifold);
    Gain &a = gains[contact.a], &b = gains[contact.b];
    a.momentum -= exchange.on_b;
    b.momentum += exchange.on_b;
    a.angular_momentum += exchange.angular_on_a;
    b.angular_momentum += exchange.angular_on_b;
  }
}

// The solver holds inertia still over the step. What turns with a body without joints meanwhile is made good here: of
// the turn, the part that a constant angular velocity made is replaced by free rotation.
void World::Impl::ReadBatches() {
  const auto dt = static_cast<float>(dt_s);
  for (const Batch& batch : batches) {
    if (batch.adrift) SumGains(batch);
    for (std::size_t i = 0; i < batch.bodies.size(); ++i) {
      const SolverBody& out = batch.bodies[i];
      RigidBody& body = *batch.of[i];
      const Placement& from = body.placement();
      const Vec3f momentum = body.state().angular_momentum * static_cast<float>(body.angular_damping().kept());
      const Vec3f start = body.state().angular_velocity * static_cast<float>(body.angular_damping().kept());
      Motion& motion = motions[body.awake_index];
      motion.position = from.position + Vec3d(out.moved_m);
      motion.velocity = out.velocity;
      Vec3f gained = out.angular_impulse_nms;
      if (islands.Of(body.awake_index).adrift) {
        const Vec3f kept = body.state().linear_velocity * static_cast<float>(body.linear_damping().kept());
        motion.velocity = Vec3f(Vec3d(kept) + body.Acceleration() * dt_s + gains[i].momentum / body.mass_kg());
        gained = Vec3f(gains[i].angular_momentum + body.torque_nm * dt_s);
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
      NoteWay(body);
    }
  }
}

}  // namespace tessera::physics
