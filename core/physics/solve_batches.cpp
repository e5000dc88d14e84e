#include "core/physics/solve_batches.h"

#include <algorithm>

#include "core/physics/motion/free_flight.h"
#include "core/physics/motion/turn.h"
#include "core/physics/pair_table.h"

namespace tessera::physics {
namespace {

// Faster than this, rad a step, a body's inertia turns enough with it to be felt.
constexpr float kGyroscopicTurn_rad = 1e-3f;

// Impulses are those of one substep.
float WarmScale(int last_substeps, int substeps) {
  return last_substeps == 0 ? 1.0f : static_cast<float>(last_substeps) / static_cast<float>(substeps);
}

// The orientation half way through the step. A body without joints flies there. One with joints is held by where it
// turns to, so it is taken to turn as the solver turns it.
Quatd MidwayOf(const RigidBody& body, const StartingTurn& start, double dt_s) {
  const Quatd& from = body.placement().orientation;
  if (!body.joints.empty()) return Turned(from, Vec3d(start.spin) * (dt_s / 2));
  FlightState flight{{}, from, {}, start.momentum};
  Fly(body.inertia(), {}, {}, dt_s / 2, &flight);
  return flight.orientation;
}

// The solver holds inertia still over the step. A body whose inertia turns with it gets it, and the velocity that its
// angular momentum gives, as they are half way: the rule of the midpoint.
SolverBody SolverBodyOf(const RigidBody& body, double dt_s, Quatd* midway) {
  const StartingTurn start(body);
  SolverBody in;
  in.velocity = body.state().linear_velocity * static_cast<float>(body.linear_damping().kept());
  in.angular_velocity = start.spin;
  in.rotation = body.placement().rotation;
  *midway = body.placement().orientation;
  if (TurnsItsInertia(body, start.spin, static_cast<float>(dt_s))) {
    *midway = MidwayOf(body, start, dt_s);
    in.angular_velocity = AngularVelocityOf(body.inertia(), *midway, start.momentum);
    in.rotation = RotationOf(*midway);
  }
  in.acceleration = Vec3f(body.Acceleration());
  if (body.torque_nm != Vec3d()) {
    in.angular_acceleration = AngularVelocityOf(body.inertia(), *midway, Vec3f(body.torque_nm));
  }
  in.mass_kg = static_cast<float>(body.mass_kg());
  in.inertia_kg_m2 = Vec3f(body.inertia());
  return in;
}

// Mass and moments of a kinematic body, kg and kg m^2: an impulse that a float can hold does not show in its velocity,
// and roots of it and of its inverse are far from a float's ends.
constexpr float kDrivenMass = 1e20f;

// The place of one more kinematic body.
std::uint32_t AddDriven(const RigidBody& body, IslandBatch& batch) {
  SolverBody& in = batch.bodies.emplace_back();
  in.velocity = body.state().linear_velocity;
  in.angular_velocity = body.state().angular_velocity;
  in.mass_kg = kDrivenMass;
  in.inertia_kg_m2 = {kDrivenMass, kDrivenMass, kDrivenMass};
  in.rotation = body.placement().rotation;
  return static_cast<std::uint32_t>(batch.bodies.size() - 1);
}

}  // namespace

StartingTurn::StartingTurn(const RigidBody& body) {
  const auto kept = static_cast<float>(body.angular_damping().kept());
  spin = body.state().angular_velocity * kept;
  momentum = body.state().angular_momentum * kept;
}

bool TurnsItsInertia(const RigidBody& body, Vec3f spin, float dt_s) {
  return !body.round() && Length(spin) * dt_s >= kGyroscopicTurn_rad;
}

void SolveBatches::Fill(const SolveInput& in, ThreadTeam& team) {
  for (IslandBatch& batch : batches_) {
    batch.unanchored = batch.bears = false;
    batch.sources.clear();
    batch.contacts.clear();
    batch.joints.clear();
  }
  FillBodies(in, team);
  FillContacts(in);
  FillJoints(in);
}

void SolveBatches::FillBodies(const SolveInput& in, ThreadTeam& team) {
  place_.resize(in.awake.size());
  for (std::uint32_t i = 0; i < in.awake.size(); ++i) {
    const IslandPlan& plan = in.plans[in.islands.IndexOf(i)];
    if (!plan.solved) continue;
    IslandBatch& batch = BatchOf(plan);
    batch.substeps = plan.substeps;
    batch.unanchored |= plan.unanchored;
    place_[i] = static_cast<std::uint32_t>(batch.sources.size());
    batch.sources.push_back(in.awake[i]);
  }
  for (IslandBatch& batch : batches_) {
    // Bodies left from the last step get every field anew.
    batch.bodies.resize(batch.sources.size());
    batch.midways.resize(batch.sources.size());
    team.For(batch.bodies.size(), kChunkBodies, [&batch, dt_s = in.dt_s](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        PrefetchAfter(i, std::span<const RigidBody* const>(batch.sources), kUpToFrame);
        batch.bodies[i] = SolverBodyOf(*batch.sources[i], dt_s, &batch.midways[i]);
      }
    });
  }
}

// A sleeping body that nothing awake comes upon stands as firm as a static one.
void SolveBatches::FillContacts(const SolveInput& in) {
  const bool some_bear = !in.bearing.empty();
  const auto place = [this](std::uint32_t body) { return body != kAsleep ? place_[body] : kStatic; };
  for (ActiveContact& contact : in.contacts) {
    if (!contact.responds) continue;
    const IslandPlan& plan = in.plans[in.islands.IndexOf(contact.one())];
    if (!plan.solved) continue;
    IslandBatch& batch = BatchOf(plan);
    const float warm_scale = WarmScale(contact.substeps, batch.substeps);
    std::uint32_t low = place(contact.low), high = place(contact.high);
    if (contact.driven) {
      const bool low_drives = contact.pair->low->moving();
      (low_drives ? low : high) = AddDriven(low_drives ? *contact.pair->low : *contact.pair->high, batch);
    }
    const bool bears = some_bear && in.bearing[static_cast<std::size_t>(&contact - in.contacts.data())] != 0;
    if (bears) batch.bears = true;
    for (std::uint32_t i = 0; i < contact.count; ++i) {
      batch.contacts.push_back({low, high, contact.manifolds + i, contact.material, contact.slop_m, warm_scale,
                                contact.driven, bears, i == 0 ? contact.points : std::uint8_t{0}});
    }
    contact.substeps = batch.substeps;
  }
}

void SolveBatches::FillJoints(const SolveInput& in) {
  const auto place = [this](const RigidBody& body, IslandBatch& batch) {
    if (body.awake()) return place_[body.awake_index];
    return body.moving() ? AddDriven(body, batch) : kStatic;
  };
  for (std::size_t i = 0; i < in.joints.size(); ++i) {
    Joint& joint = *in.joints[i];
    IslandBatch& batch = BatchOf(in.plans[in.islands.IndexOf(joint.AwakeBody().awake_index)]);
    // The world takes the part of body a.
    const std::uint32_t a = joint.b != nullptr ? place(*joint.a, batch) : kStatic;
    batch.joints.push_back({.a = a,
                            .b = place(joint.b != nullptr ? *joint.b : *joint.a, batch),
                            .rows = &in.rows[i],
                            .impulses = joint.model.impulses.data(),
                            .warm_scale = WarmScale(joint.substeps, batch.substeps)});
    joint.substeps = batch.substeps;
  }
}

bool SolveBatches::Validate(const SolveInput& in) const {
  std::size_t solved = 0;
  for (std::uint32_t i = 0; i < in.awake.size(); ++i) {
    const IslandPlan& plan = in.plans[in.islands.IndexOf(i)];
    if (!plan.solved) continue;
    ++solved;
    const IslandBatch& batch = batches_[static_cast<std::size_t>(plan.level)];
    if (batch.substeps != plan.substeps || place_[i] >= batch.sources.size()) return false;
    if (batch.sources[place_[i]] != in.awake[i]) return false;
  }
  std::size_t placed = 0;
  for (const IslandBatch& batch : batches_) {
    placed += batch.sources.size();
    const auto there = [&](std::uint32_t body) { return body == kStatic || body < batch.bodies.size(); };
    const auto sound = [&](const auto& constraint) {
      return there(constraint.a) && there(constraint.b) && (constraint.a != kStatic || constraint.b != kStatic);
    };
    if (!std::all_of(batch.contacts.begin(), batch.contacts.end(), sound)) return false;
    if (!std::all_of(batch.joints.begin(), batch.joints.end(), sound)) return false;
  }
  return placed == solved;
}

}  // namespace tessera::physics
