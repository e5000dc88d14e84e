#include "core/physics/solve/impacts.h"

#include <cmath>

#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

// Enough for a blow to pass through a row of this many bodies against the order of its contacts.
constexpr int kSweeps = 32;
// Of the points of one contact; four converge in fewer.
constexpr int kPointSweeps = 8;
// A body flies if all other impulses of a substep are smaller than that of its acceleration by this, squared. Well
// above the rounding of a fast body's velocity.
constexpr float kFlies = 1e-4f;

Vec3f Get(const float (&v)[4]) { return {v[0], v[1], v[2]}; }
void Add(float (&to)[4], Vec3f v) {
  to[0] += v.x;
  to[1] += v.y;
  to[2] += v.z;
}
Vec3f At(const Lanes (&v)[3], int lane) { return {v[0].f[lane], v[1].f[lane], v[2].f[lane]}; }

template <class Body>
float Velocity(const ImpactContact& contact, const ImpactPoint& point, const Body& a, const Body& b) {
  const Vec3f relative = Get(b.velocity) * contact.inverse_root_mass_b - Get(a.velocity) * contact.inverse_root_mass_a;
  return Dot(contact.normal, relative) + (Dot(point.angular_b, Get(b.spin)) - Dot(point.angular_a, Get(a.spin)));
}

template <class Body>
void Apply(const ImpactContact& contact, const ImpactPoint& point, float impulse, Body& a, Body& b) {
  const Vec3f push = contact.normal * impulse;
  Add(a.velocity, push * -contact.inverse_root_mass_a);
  Add(a.spin, point.angular_a * -impulse);
  Add(b.velocity, push * contact.inverse_root_mass_b);
  Add(b.spin, point.angular_b * impulse);
}

// How a point that hits its surface is at the end of the substep.
struct Bounced {
  bool hits = false;
  float velocity = 0, separation = 0;
  float time = 0;  // of the hit
};

// From a distance, a velocity and an acceleration along the normal at the start of the substep.
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

// Impulses at the points that hit, together.
void Strike(ImpactContact& contact, SolvedState& a, SolvedState& b, SolvedMemory& before_a, SolvedMemory& before_b) {
  for (int sweep = 0; sweep < (contact.count > 1 ? kPointSweeps : 1); ++sweep) {
    for (int i = 0; i < contact.count; ++i) {
      ImpactPoint& point = contact.points[i];
      if (!point.hits) continue;
      const float wanted = point.impulse + point.mass * (point.target - Velocity(contact, point, a, b));
      const float change = std::max(wanted, 0.0f) - point.impulse;
      point.impulse += change;
      Apply(contact, point, change, a, b);
      Apply(contact, point, change, before_a, before_b);  // not to be repeated by the next kick
    }
  }
}

// Finds what hits by the free motion of both bodies, strikes, and puts them where they are after the bounce.
bool FirstStrike(ImpactContact& contact, SolvedState& a, SolvedState& b, SolvedMemory& before_a, SolvedMemory& before_b,
                 Vec3f shift, float h) {
  Bounced first;
  float first_distance = 0;
  for (int i = 0; i < contact.count; ++i) {
    ImpactPoint& point = contact.points[i];
    point.impulse = 0;
    const float velocity = Velocity(contact, point, before_a, before_b);
    const float kick = Velocity(contact, point, a, b) - velocity;
    const Bounced bounced = BounceOf(*point.separation, velocity, kick / h, contact.restitution, h);
    point.hits = bounced.hits;
    point.target = bounced.velocity;
    if (bounced.hits && (!first.hits || bounced.time < first.time)) {
      first = bounced;
      first_distance = std::max(*point.separation, 0.0f);
    }
  }
  if (!first.hits) return false;
  Strike(contact, a, b, before_a, before_b);
  // What drifting will make of the velocity, against where the bounce ends.
  const float drifts = h * first.velocity + Dot(contact.normal, shift);
  const float m_a = contact.inverse_root_mass_a * contact.inverse_root_mass_a;
  const float m_b = contact.inverse_root_mass_b * contact.inverse_root_mass_b;
  const float aside = (first.separation - first_distance - drifts) / (m_a + m_b);
  Add(a.moved, contact.normal * (-aside * m_a));
  Add(b.moved, contact.normal * (aside * m_b));
  return true;
}

// What was struck may strike in turn, if it is to reach its surface in this substep.
bool StrikeOn(ImpactContact& contact, SolvedState& a, SolvedState& b, SolvedMemory& before_a, SolvedMemory& before_b,
              float h) {
  bool any = false;
  for (int i = 0; i < contact.count; ++i) {
    ImpactPoint& point = contact.points[i];
    const float velocity = Velocity(contact, point, a, b);
    point.hits = velocity < -kBounce_m_s && *point.separation + h * velocity < 0;
    point.target = -contact.restitution * velocity;
    any |= point.hits;
  }
  if (any) Strike(contact, a, b, before_a, before_b);
  return any;
}

}  // namespace

void Impacts::Fill(std::span<const ContactConstraint> contacts, ContactBlocks& blocks, std::size_t bodies) {
  contacts_.clear();
  bodies_.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (!(contacts[i].material.restitution > 0)) continue;
    if (contacts_.empty()) {
      listed_.assign(bodies, false);
      shifts_.assign(bodies + 1, {});
    }
    ImpactContact out;
    out.restitution = contacts[i].material.restitution;
    out.count = contacts[i].manifold->count;
    const ContactPlace& place = blocks.PlaceOf(i);
    const int lane = place.lane;
    blocks.Visit(place, [&](auto& block) {
      out.a = static_cast<std::uint32_t>(block.head.a[lane]);
      out.b = static_cast<std::uint32_t>(block.head.b[lane]);
      out.normal = At(block.head.normal, lane);
      out.inverse_root_mass_a = block.head.inverse_root_mass_a.f[lane];
      out.inverse_root_mass_b = block.head.inverse_root_mass_b.f[lane];
      if constexpr (std::decay_t<decltype(block)>::kHasFriction) out.friction = &block.friction.impact.f[lane];
      for (int k = 0; k < out.count; ++k) {
        PointLanes& point = block.points[k];
        out.points[k] = {At(point.angular_a, lane),
                         At(point.angular_b, lane),
                         point.mass.f[lane],
                         &point.separation.f[lane],
                         &point.total.f[lane],
                         0,
                         0,
                         false};
      }
    });
    for (const std::uint32_t body : {contacts[i].a, contacts[i].b}) {
      if (body == kStatic || listed_[body]) continue;
      listed_[body] = true;
      bodies_.push_back(body);
    }
    contacts_.push_back(out);
  }
}

void Impacts::Bounce(SolvedState* states, const SolvedMass* masses, SolvedMemory* before, const SolvedKick* kicks,
                     float h) {
  // Drifting by the velocity after the kick runs ahead of the parabola by half a kick. What nothing but its
  // acceleration acts on is shifted back onto it.
  for (const std::uint32_t i : bodies_) {
    const Vec3f kick = Get(kicks[i].velocity);
    const Vec3f others = (Get(states[i].velocity) - Get(before[i].velocity)) - kick;
    const bool flies = LengthSquared(others) <= kFlies * LengthSquared(kick);
    shifts_[i] = flies ? kick * (-0.5f * h * masses[i].inverse_root_mass) : Vec3f();
    Add(states[i].moved, shifts_[i]);
  }
  bool any = false;
  for (ImpactContact& c : contacts_) {
    any |= FirstStrike(c, states[c.a], states[c.b], before[c.a], before[c.b], shifts_[c.b] - shifts_[c.a], h);
  }
  for (int sweep = 0; any && sweep < kSweeps; ++sweep) {
    any = false;
    for (ImpactContact& c : contacts_) any |= StrikeOn(c, states[c.a], states[c.b], before[c.a], before[c.b], h);
  }
  for (ImpactContact& contact : contacts_) {
    float sum = 0;
    for (int i = 0; i < contact.count; ++i) {
      sum += contact.points[i].impulse;
      *contact.points[i].total += contact.points[i].impulse;
    }
    if (contact.friction != nullptr) *contact.friction = sum;
  }
}

}  // namespace tessera::physics
