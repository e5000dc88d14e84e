#include "core/physics/solve/impacts.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/physics/solve/solved_access.h"
#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

// Number of sweeps over all contacts: a blow goes through a row of this many bodies against the order of its contacts.
constexpr int kSweeps = 32;
// Number of sweeps over the points of one contact; four points converge in fewer.
constexpr int kPointSweeps = 8;
// A body flies if the square of all other impulses of a substep is below this share of that of its acceleration. The
// share is well above the rounding of a fast body's velocity.
constexpr float kFlies = 1e-4f;

Vec3f LaneOf(const Lanes (&v)[3], int lane) { return {v[0].f[lane], v[1].f[lane], v[2].f[lane]}; }

// One contact of a block, and the bodies that it acts on.
template <class Block>
struct Striking {
  Striking(Block& block_in, int lane_in, SolvedState* states, SolvedMemory* before)
      : block(block_in),
        lane(lane_in),
        a(states[block.head.a[lane]]),
        b(states[block.head.b[lane]]),
        before_a(before[block.head.a[lane]]),
        before_b(before[block.head.b[lane]]),
        normal(LaneOf(block.head.normal, lane)),
        inverse_root_mass_a(block.head.inverse_root_mass_a.f[lane]),
        inverse_root_mass_b(block.head.inverse_root_mass_b.f[lane]) {}

  // Velocity of a point along the normal, where the bodies move as `of_a` and `of_b` say.
  template <class Body>
  float Velocity(const PointLanes& point, const Body& of_a, const Body& of_b) const {
    const Vec3f relative = Get(of_b.velocity) * inverse_root_mass_b - Get(of_a.velocity) * inverse_root_mass_a;
    return Dot(normal, relative) +
           (Dot(LaneOf(point.angular_b, lane), Get(of_b.spin)) - Dot(LaneOf(point.angular_a, lane), Get(of_a.spin)));
  }
  float Velocity(const PointLanes& point) const { return Velocity(point, a, b); }

  template <class Body>
  void Apply(const PointLanes& point, float impulse, Body& to_a, Body& to_b) const {
    const Vec3f push = normal * impulse;
    Add(to_a.velocity, push * -inverse_root_mass_a);
    Add(to_a.spin, LaneOf(point.angular_a, lane) * -impulse);
    Add(to_b.velocity, push * inverse_root_mass_b);
    Add(to_b.spin, LaneOf(point.angular_b, lane) * impulse);
  }

  // Gives the points that hit impulses, all together, until they move at their targets.
  void Strike(const bool (&hits)[kManifoldPoints], const float (&targets)[kManifoldPoints]) {
    constexpr int kPoints = Block::kPointCount;
    float impulses[kPoints] = {};
    for (int sweep = 0; sweep < (kPoints > 1 ? kPointSweeps : 1); ++sweep) {
      for (int i = 0; i < kPoints; ++i) {
        if (!hits[i]) continue;
        const PointLanes& point = block.points[i];
        const float wanted = impulses[i] + point.mass.f[lane] * (targets[i] - Velocity(point));
        const float change = std::max(wanted, 0.0f) - impulses[i];
        impulses[i] += change;
        Apply(point, change, a, b);
        Apply(point, change, before_a, before_b);  // so that the next kick does not repeat it
      }
    }
    float sum = 0;
    for (int i = 0; i < kPoints; ++i) {
      block.points[i].total.f[lane] += impulses[i];
      sum += impulses[i];
    }
    if constexpr (Block::kHasFriction) block.friction.impact.f[lane] += sum;
    NoteLeverArm(Cross(Get(b.moved) - Get(a.moved), normal * sum));
  }

  // Moves the two apart along the normal, while their common centre of mass stays.
  void PutApart(float by_m) {
    const float m_a = inverse_root_mass_a * inverse_root_mass_a, m_b = inverse_root_mass_b * inverse_root_mass_b;
    const float share = by_m / (m_a + m_b);
    Add(a.moved, normal * (-share * m_a));
    Add(b.moved, normal * (share * m_b));
    const Vec3f relative = Get(b.velocity) * inverse_root_mass_b - Get(a.velocity) * inverse_root_mass_a;
    NoteLeverArm(Cross(normal * share, relative));
  }

  void NoteLeverArm(Vec3f made) {
    block.lever_arm.made[0].f[lane] += made.x;
    block.lever_arm.made[1].f[lane] += made.y;
    block.lever_arm.made[2].f[lane] += made.z;
  }

  Block& block;
  const int lane;
  SolvedState &a, &b;
  SolvedMemory &before_a, &before_b;
  const Vec3f normal;
  const float inverse_root_mass_a, inverse_root_mass_b;
};

// The motion, at the end of the substep, of a point that hits its surface within it.
struct Bounced {
  bool hits = false;
  float velocity = 0, separation = 0;
  float time = 0;  // at which it hits, s
};

// The bounce of a point with this distance, velocity and acceleration along the normal at the start of the substep.
Bounced BounceOf(float distance, float velocity, float acceleration, float restitution, float h) {
  const float start = std::max(distance, 0.0f);
  if (start + h * (velocity + 0.5f * h * acceleration) >= 0) return {};
  const float square = velocity * velocity - 2 * acceleration * start;
  const float speed = std::sqrt(std::max(square, 0.0f));  // at the surface
  if (!(speed > kBounce_m_s)) return {};
  const float time = start > 0 ? std::min(h, 2 * start / (speed - velocity)) : 0;
  const float up = restitution * speed, rest = h - time;
  return {true, up + acceleration * rest, rest * (up + 0.5f * acceleration * rest), time};
}

// Finds the points that hit, by the free motion of both bodies, strikes, and moves the two to where they are after the
// bounce. `shift` is that of b against a.
template <class Block>
bool FirstStrike(Striking<Block> contact, Vec3f shift, float h) {
  Block& block = contact.block;
  const int lane = contact.lane;
  bool hits[kManifoldPoints] = {};
  float targets[kManifoldPoints] = {};
  Bounced first;
  float first_distance = 0;
  for (int i = 0; i < Block::kPointCount; ++i) {
    const PointLanes& point = block.points[i];
    if (!(point.mass.f[lane] > 0)) continue;
    const float velocity = contact.Velocity(point, contact.before_a, contact.before_b);
    const float kick = contact.Velocity(point) - velocity;
    const float separation = point.separation.f[lane];
    const Bounced bounced = BounceOf(separation, velocity, kick / h, block.head.restitution.f[lane], h);
    hits[i] = bounced.hits;
    targets[i] = bounced.velocity;
    if (bounced.hits && (!first.hits || bounced.time < first.time)) {
      first = bounced;
      first_distance = std::max(separation, 0.0f);
    }
  }
  if (!first.hits) return false;
  contact.Strike(hits, targets);
  // The drift of the substep will add this way, which is no part of where the bounce ends.
  const float drifts = h * first.velocity + Dot(contact.normal, shift);
  contact.PutApart(first.separation - first_distance - drifts);
  return true;
}

// Lets a body that was struck strike in turn, if it is to reach its surface in this substep.
template <class Block>
bool StrikeOn(Striking<Block> contact, float h) {
  Block& block = contact.block;
  const int lane = contact.lane;
  bool hits[kManifoldPoints] = {}, any = false;
  float targets[kManifoldPoints] = {};
  for (int i = 0; i < Block::kPointCount; ++i) {
    const PointLanes& point = block.points[i];
    if (!(point.mass.f[lane] > 0)) continue;
    const float velocity = contact.Velocity(point);
    hits[i] = velocity < -kBounce_m_s && point.separation.f[lane] + h * velocity < 0;
    targets[i] = -block.head.restitution.f[lane] * velocity;
    any |= hits[i];
  }
  if (any) contact.Strike(hits, targets);
  return any;
}

}  // namespace

void Impacts::Fill(std::span<const ContactConstraint> contacts, std::size_t bodies, std::size_t worlds) {
  bodies_.clear();
  for (const ContactConstraint& contact : contacts) {
    if (!(contact.material.restitution > 0)) continue;
    if (bodies_.empty()) {
      listed_.assign(bodies, false);
      shifts_.assign(bodies + worlds, {});
    }
    for (const std::uint32_t body : {contact.a, contact.b}) {
      if (body == kStatic || listed_[body]) continue;
      listed_[body] = true;
      bodies_.push_back(body);
    }
  }
}

// A drift by the velocity after the kick runs ahead of the parabola by half a kick. A body that nothing but its
// acceleration acts on is shifted back onto the parabola.
bool Impacts::Shift(SolvedState* states, const SolvedMass* masses, const SolvedMemory* before, const SolvedKick* kicks,
                    float h) {
  bool any = false;
  for (const std::uint32_t i : bodies_) {
    const Vec3f kick = Get(kicks[i].velocity);
    const Vec3f others = (Get(states[i].velocity) - Get(before[i].velocity)) - kick;
    const bool flies = LengthSquared(others) <= kFlies * LengthSquared(kick);
    shifts_[i] = flies ? kick * (-0.5f * h * masses[i].inverse_root_mass) : Vec3f();
    Add(states[i].moved, shifts_[i]);
    any |= shifts_[i] != Vec3f();
  }
  return any;
}

bool Impacts::Bounce(const Kernels& kernels, ContactBlocks& blocks, SolvedState* states, const SolvedMass* masses,
                     SolvedMemory* before, const SolvedKick* kicks, float h) {
  struck_.assign(shifts_.size(), false);
  bool moved = Shift(states, masses, before, kicks, h), any = true;
  for (int sweep = 0; any && sweep < kSweeps; ++sweep) {
    any = false;
    for (const ContactRun& run : blocks.runs()) {
      if (!run.bounces) continue;
      lanes_.resize(std::max<std::size_t>(lanes_.size(), run.blocks));
      kernels.contacts[run.kind].approach(blocks.BlocksOf(run), run.blocks, states, kBounce_m_s, sweep == 0,
                                          lanes_.data());
      for (std::size_t k = 0; k < run.blocks; ++k) {
        for (unsigned lanes = lanes_[k]; lanes != 0; lanes &= lanes - 1) {
          blocks.Visit(run, k, [&](auto& block) {
            const int lane = std::countr_zero(lanes);
            const Vec3f shift = shifts_[block.head.b[lane]] - shifts_[block.head.a[lane]];
            const auto a = static_cast<std::size_t>(block.head.a[lane]),
                       b = static_cast<std::size_t>(block.head.b[lane]);
            if (sweep > 0 && !struck_[a] && !struck_[b]) return;
            const Striking contact(block, lane, states, before);
            if (!(sweep == 0 ? FirstStrike(contact, shift, h) : StrikeOn(contact, h))) return;
            any = true;
            if (a < listed_.size()) struck_[a] = true;
            if (b < listed_.size()) struck_[b] = true;
          });
        }
      }
    }
    moved |= any;
  }
  return moved;
}

}  // namespace tessera::physics
