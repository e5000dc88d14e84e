#include "core/physics/solve/direct_contacts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/physics/solve/solved_access.h"
#include "core/physics/solve/solver.h"

namespace tessera::physics {
namespace {

using AxisLanes = Lanes[3];

Vector6 RowOf(const AxisLanes& linear, float scale, const AxisLanes& angular, float sign, int lane) {
  Vector6 row;
  for (std::size_t k = 0; k < 3; ++k) {
    row[k] = sign * (static_cast<double>(linear[k].f[lane]) * scale);
    row[k + 3] = sign * static_cast<double>(angular[k].f[lane]);
  }
  return row;
}

// Rows of a contact as they stay over the step.
template <class Block>
void FillRows(const Block& block, int lane, DirectContact& to) {
  const float scale_a = block.head.inverse_root_mass_a.f[lane], scale_b = block.head.inverse_root_mass_b.f[lane];
  const auto fill = [&](std::size_t row, const AxisLanes& linear, float of_linear, const AxisLanes& angular_a,
                        const AxisLanes& angular_b) {
    to.on_a[row] = RowOf(linear, of_linear * scale_a, angular_a, -1, lane);
    to.on_b[row] = RowOf(linear, of_linear * scale_b, angular_b, 1, lane);
  };
  for (std::size_t i = 0; i < Block::kPointCount; ++i) {
    fill(i, block.head.normal, 1, block.points[i].angular_a, block.points[i].angular_b);
  }
  if constexpr (Block::kHasFriction) {
    to.friction = block.friction.coefficient.f[lane];
    for (std::size_t k = 0; k < 2; ++k) {
      fill(kDirectTangent + k, block.friction.tangent[k], 1, block.friction.angular_a[k], block.friction.angular_b[k]);
    }
  }
  if constexpr (Block::kHasTwist) {
    fill(kDirectTwist, block.head.normal, 0, block.twist.angular_a, block.twist.angular_b);
    for (std::size_t i = 0; i < Block::kPointCount; ++i) to.arm[i] = block.twist.arm[i].f[lane];
  }
}

// The bias of a point, as the kernels have it (kernel_body.inl, Wanted): m/s.
double BiasOf(const ContactHead& head, float separation, int lane, const StepConstants& step, bool relax) {
  if (relax) return separation > 0 ? separation * step.inverse_h : 0;
  const float slop = head.slop.f[lane], rate = head.bias_rate.f[lane];
  if (separation > 0) return separation * step.inverse_h + slop * rate;
  return std::max((separation + slop) * rate, -step.push_out_m_s);
}

double SpeedOf(const DirectContact& contact, std::size_t row, const std::vector<DirectBody>& bodies) {
  double speed = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    if (contact.a >= 0) speed += contact.on_a[row][k] * bodies[static_cast<std::size_t>(contact.a)].velocity[k];
    if (contact.b >= 0) speed += contact.on_b[row][k] * bodies[static_cast<std::size_t>(contact.b)].velocity[k];
  }
  return speed;
}

// Takes over impulses and biases as they are now. A point that may bounce yet, which relaxing leaves alone, is no row.
template <class Block>
void Take(const Block& block, int lane, const StepConstants& step, bool relax, const std::vector<DirectBody>& bodies,
          DirectContact& to) {
  to.rows = 0;
  to.impact = 0;
  for (std::size_t i = 0; i < Block::kPointCount; ++i) {
    const PointLanes& point = block.points[i];
    if (!(point.mass.f[lane] > 0)) continue;
    const float separation = point.separation.f[lane];
    const bool bounces = relax && block.head.restitution.f[lane] > 0 &&
                         (separation > 0 || SpeedOf(to, i, bodies) < -static_cast<double>(kBounce_m_s));
    if (bounces) {
      to.impact += point.impulse.f[lane];
      continue;
    }
    to.rows |= static_cast<std::uint8_t>(1U << i);
    to.impulse[i] = point.impulse.f[lane];
    to.bias[i] = BiasOf(block.head, separation, lane, step, relax);
  }
  if constexpr (Block::kHasFriction) {
    to.rows |= static_cast<std::uint8_t>(3U << kDirectTangent);
    to.impact += block.friction.impact.f[lane];
    for (std::size_t k = 0; k < 2; ++k) to.impulse[kDirectTangent + k] = block.friction.impulse[k].f[lane];
  }
  if constexpr (Block::kHasTwist) {
    to.rows |= static_cast<std::uint8_t>(1U << kDirectTwist);
    to.impulse[kDirectTwist] = block.twist.impulse.f[lane];
  }
}

template <class Block>
void PutBack(const DirectContact& from, int lane, Block& block) {
  for (std::size_t i = 0; i < Block::kPointCount; ++i) {
    if (from.Has(i)) block.points[i].impulse.f[lane] = static_cast<float>(from.impulse[i]);
  }
  if constexpr (Block::kHasFriction) {
    for (std::size_t k = 0; k < 2; ++k) {
      block.friction.impulse[k].f[lane] = static_cast<float>(from.impulse[kDirectTangent + k]);
    }
  }
  if constexpr (Block::kHasTwist) block.twist.impulse.f[lane] = static_cast<float>(from.impulse[kDirectTwist]);
}

// Groups of contacts, by the first contact of each. A body belongs to the group of its first contact.
class Grouping {
 public:
  std::uint32_t Root(std::uint32_t body) {
    parent_.try_emplace(body, body);
    while (parent_[body] != body) body = parent_[body];
    return body;
  }
  void Unite(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t root_a = Root(a), root_b = Root(b);
    parent_[std::max(root_a, root_b)] = std::min(root_a, root_b);
  }

 private:
  std::map<std::uint32_t, std::uint32_t> parent_;  // by body
};

}  // namespace

void DirectContacts::Fill(std::span<const ContactConstraint> contacts, ContactBlocks& blocks,
                          std::span<const SolvedMass> masses) {
  groups_.clear();
  Grouping grouping;
  for (const ContactConstraint& contact : contacts) {
    if (contact.bears && contact.a != kStatic && contact.b != kStatic) grouping.Unite(contact.a, contact.b);
  }
  std::map<std::uint32_t, std::size_t> group_of;  // by root
  std::map<std::uint32_t, std::int32_t> body_of;  // by body of the batch: that of its group
  std::vector<std::vector<DirectContact>> rows;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactConstraint& contact = contacts[i];
    if (!contact.bears) continue;
    const std::uint32_t root = grouping.Root(contact.a != kStatic ? contact.a : contact.b);
    const auto [entry, is_new] = group_of.try_emplace(root, groups_.size());
    if (is_new) {
      groups_.emplace_back();
      rows.emplace_back();
    }
    Group& group = groups_[entry->second];
    const auto place = [&](std::uint32_t body) -> std::int32_t {
      if (body == kStatic) return -1;
      const auto [known, first] = body_of.try_emplace(body, static_cast<std::int32_t>(group.bodies.size()));
      if (first) group.bodies.push_back(body);
      return known->second;
    };
    DirectContact& to = rows[entry->second].emplace_back();
    to.a = place(contact.a);
    to.b = place(contact.b);
    group.places.push_back(blocks.PlaceOf(i));
    blocks.Visit(group.places.back(), [&](auto& block) { FillRows(block, group.places.back().lane, to); });
  }
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    std::vector<DirectBody> bodies(groups_[i].bodies.size());
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      bodies[k].inverse_root_mass = masses[groups_[i].bodies[k]].inverse_root_mass;
    }
    groups_[i].solve.Begin(std::move(bodies), std::move(rows[i]));
  }
}

void DirectContacts::Solve(ContactBlocks& blocks, std::span<SolvedState> states, const StepConstants& step,
                           bool relax) {
  for (Group& group : groups_) {
    std::vector<DirectBody>& bodies = group.solve.bodies();
    std::vector<DirectContact>& contacts = group.solve.contacts();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const SolvedState& state = states[group.bodies[i]];
      for (std::size_t k = 0; k < 3; ++k) {
        bodies[i].velocity[k] = state.velocity[k];
        bodies[i].velocity[k + 3] = state.spin[k];
      }
    }
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ContactPlace& place = group.places[i];
      blocks.Visit(place, [&](auto& block) { Take(block, place.lane, step, relax, bodies, contacts[i]); });
    }
    if (!group.solve.Solve()) continue;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      SolvedState& state = states[group.bodies[i]];
      for (std::size_t k = 0; k < 3; ++k) {
        state.velocity[k] = static_cast<float>(bodies[i].velocity[k]);
        state.spin[k] = static_cast<float>(bodies[i].velocity[k + 3]);
      }
    }
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ContactPlace& place = group.places[i];
      blocks.Visit(place, [&](auto& block) { PutBack(contacts[i], place.lane, block); });
    }
  }
}

}  // namespace tessera::physics
