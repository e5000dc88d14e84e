// Strikes: a blow between the two bodies of a contact, at its own moment within a substep.
//
// Bodies are kept as if they had moved all substep long with the velocities that they end it with, for so the drift
// moves them. An impulse at time t therefore sets a body back by t times the change of velocity that it makes, and
// from there the drift ends where the true path does. Nothing else is needed to know where two bodies are at any later
// time of the substep, so blows are exact in whatever number and order they come: an elastic one changes no energy, and
// none changes the motion of the common centre of mass.
//
// A substep begins with the impulses that contacts gave in the one before, for a load presses on. A blow is no load: a
// body that was just stopped by another would begin with that push once more, and what bounces would give it back. So a
// point comes no faster than its bodies do without the pushes that they begin with.
//
// Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/physics/linear.h"
#include "core/physics/solve/kernel.h"
#include "core/physics/solve/solved_access.h"

namespace tessera::physics {

// The path of a point towards the surface that it may hit. At a time s of a substep of h it is off the surface by
//   separation + velocity * s + bend * (1 - s / h)^2.
struct PointPath {
  float separation = 0;  // m
  float velocity = 0;    // at the end of the substep, m/s
  float bend = 0;        // half the acceleration times h^2, m

  float PlaceAt(float s, float h) const {
    const float left = 1 - s / h;
    return separation + velocity * s + bend * left * left;
  }
  float VelocityAt(float s, float h) const { return velocity - 2 * bend * (1 - s / h) / h; }
};

// The first time at or after `from` at which such a point hits, unless it comes slower than kBounce_m_s or not within
// the substep. One that is below the surface already hits as soon as it goes down.
std::optional<float> HitTime(const PointPath& path, float from, float h);

// By how much a strike changed the speeds of both bodies, m/s; turning counts as it does in the energy.
struct SpeedChange {
  float of_a = 0, of_b = 0;
};

// How far strikes of this substep have set a body back.
struct Setback {
  Vec3f moved;   // m
  Vec3f turned;  // rad, mass-normalised as spins are
};

// Change of a body's velocity and spin by the impulses that a substep begins with, mass-normalised.
struct Pushed {
  Vec3f velocity, spin;
};

// Bodies of a substep that strikes read and change.
struct StruckBodies {
  SolvedState* states;
  const SolvedMass* masses;
  SolvedMemory* before;  // velocities before the kick, which gain what strikes add, so that the next kick does not
  const Vec3f* shifts;   // how far each was put so that its drift ends on its parabola, m: minus half a t^2
  Setback* setbacks;
  const Pushed* pushes;  // nothing for those that fly
  float h;
};

// One contact of a block, and the bodies that it acts on.
template <class Block>
class Striking {
 public:
  Striking(Block& block, int lane, const StruckBodies& bodies)
      : block_(block),
        lane_(lane),
        bodies_(bodies),
        index_a_(At(block.head.a[lane] / kStateUnits)),
        index_b_(At(block.head.b[lane] / kStateUnits)),
        a_(bodies.states[index_a_]),
        b_(bodies.states[index_b_]),
        normal_(LaneOf(block.head.normal)),
        shift_(bodies.shifts[index_b_] - bodies.shifts[index_a_]),
        pushed_a_(bodies.pushes[index_a_]),
        pushed_b_(bodies.pushes[index_b_]),
        inverse_root_mass_a_(block.head.inverse_root_mass_a.f[lane]),
        inverse_root_mass_b_(block.head.inverse_root_mass_b.f[lane]) {}

  // When the first of its points hits, at or after `from`.
  std::optional<float> FirstHit(float from) const {
    std::optional<float> first;
    for (int i = 0; i < kPoints; ++i) {
      const std::optional<float> time = HitOf(i, from);
      if (time && (!first || *time < *first)) first = time;
    }
    return first;
  }

  // Gives all points that hit within the substep, at or after `from`, impulses at this time, together.
  SpeedChange Strike(float from, float time) const {
    bool hits[kPoints];
    float targets[kPoints] = {};
    const float bounce = 1 + block_.head.restitution.f[lane_];
    for (int i = 0; i < kPoints; ++i) {
      hits[i] = HitOf(i, from).has_value();
      if (!hits[i]) continue;
      const PointPath path = PathOf(block_.points[i]);
      targets[i] = path.velocity - bounce * std::min(path.VelocityAt(time, bodies_.h), 0.0f);
    }
    const Vec3f apart = ApartAt(time);
    const Vec3f velocity_a = Get(a_.velocity), spin_a = Get(a_.spin);
    const Vec3f velocity_b = Get(b_.velocity), spin_b = Get(b_.spin);
    const float sum = Push(hits, targets);
    const SpeedChange change{Settle(index_a_, velocity_a, spin_a, inverse_root_mass_a_, time),
                             Settle(index_b_, velocity_b, spin_b, inverse_root_mass_b_, time)};
    if constexpr (Block::kHasFriction) block_.friction.impact.f[lane_] += sum;
    // The impulse acts, in the sums of angular momentum, where the two were at the start of the step.
    const Vec3f made = Cross(apart, normal_ * sum);
    block_.lever_arm.made[0].f[lane_] += made.x;
    block_.lever_arm.made[1].f[lane_] += made.y;
    block_.lever_arm.made[2].f[lane_] += made.z;
    return change;
  }

 private:
  static constexpr int kPoints = Block::kPointCount;
  // Number of sweeps over the points; four points converge in fewer.
  static constexpr int kSweeps = kPoints > 1 ? 8 : 1;

  Vec3f LaneOf(const Lanes (&v)[3]) const { return {v[0].f[lane_], v[1].f[lane_], v[2].f[lane_]}; }

  Vec3f Relative() const { return Get(b_.velocity) * inverse_root_mass_b_ - Get(a_.velocity) * inverse_root_mass_a_; }

  float Velocity(const PointLanes& point) const {
    const float velocity = Dot(normal_, Relative()) +
                           (Dot(LaneOf(point.angular_b), Get(b_.spin)) - Dot(LaneOf(point.angular_a), Get(a_.spin)));
    const float pushed =
        Dot(normal_, pushed_b_.velocity * inverse_root_mass_b_ - pushed_a_.velocity * inverse_root_mass_a_) +
        (Dot(LaneOf(point.angular_b), pushed_b_.spin) - Dot(LaneOf(point.angular_a), pushed_a_.spin));
    return pushed < 0 ? velocity - pushed : velocity;
  }

  PointPath PathOf(const PointLanes& point) const {
    const Setback &setback_a = bodies_.setbacks[index_a_], &setback_b = bodies_.setbacks[index_b_];
    const float shift = Dot(normal_, shift_);
    const float put = Dot(normal_, setback_b.moved - setback_a.moved) +
                      (Dot(LaneOf(point.angular_b), setback_b.turned) - Dot(LaneOf(point.angular_a), setback_a.turned));
    return {point.separation.f[lane_] + (shift + put), Velocity(point), -shift};
  }

  std::optional<float> HitOf(int i, float from) const {
    const PointLanes& point = block_.points[i];
    if (!(point.mass.f[lane_] > 0)) return std::nullopt;
    return HitTime(PathOf(point), from, bodies_.h);
  }

  // How far b is moved against a at this time, since the start of the step.
  Vec3f ApartAt(float time) const {
    const float left = 1 - time / bodies_.h;
    return Get(b_.moved) - Get(a_.moved) + Relative() * time - shift_ * (left * left);
  }

  // Finds impulses after which the points that hit move at their targets. Returns their sum.
  float Push(const bool (&hits)[kPoints], const float (&targets)[kPoints]) const {
    float impulses[kPoints] = {};
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (int i = 0; i < kPoints; ++i) {
        if (!hits[i]) continue;
        const PointLanes& point = block_.points[i];
        const float wanted = impulses[i] + point.mass.f[lane_] * (targets[i] - Velocity(point));
        const float change = std::max(wanted, 0.0f) - impulses[i];
        impulses[i] += change;
        const Vec3f push = normal_ * change;
        Add(a_.velocity, push * -inverse_root_mass_a_);
        Add(a_.spin, LaneOf(point.angular_a) * -change);
        Add(b_.velocity, push * inverse_root_mass_b_);
        Add(b_.spin, LaneOf(point.angular_b) * change);
      }
    }
    float sum = 0;
    for (int i = 0; i < kPoints; ++i) {
      block_.points[i].total.f[lane_] += impulses[i];
      sum += impulses[i];
    }
    return sum;
  }

  // Takes note of the change of a body's velocity and spin from these, at this time. Returns by how much, m/s.
  float Settle(std::size_t body, Vec3f velocity, Vec3f spin, float inverse_root_mass, float time) const {
    SolvedState& state = bodies_.states[body];
    const Vec3f pushed = Get(state.velocity) - velocity, spun = Get(state.spin) - spin;
    Add(bodies_.before[body].velocity, pushed);
    Add(bodies_.before[body].spin, spun);
    const Vec3f moved = pushed * (-time * inverse_root_mass), turned = spun * -time;
    Add(state.moved, moved);
    Add(state.turned, RootInertia(bodies_.masses[body]) * turned);
    bodies_.setbacks[body].moved += moved;
    bodies_.setbacks[body].turned += turned;
    return std::sqrt(LengthSquared(pushed) + LengthSquared(spun)) * inverse_root_mass;
  }

  Block& block_;
  const int lane_;
  const StruckBodies& bodies_;
  const std::size_t index_a_, index_b_;
  SolvedState &a_, &b_;
  const Vec3f normal_, shift_;
  const Pushed &pushed_a_, &pushed_b_;
  const float inverse_root_mass_a_, inverse_root_mass_b_;
};

}  // namespace tessera::physics
