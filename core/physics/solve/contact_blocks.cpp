#include "core/physics/solve/contact_blocks.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/physics/solve/solved_access.h"
#include "core/physics/solve/tuning.h"
#include "core/world/prefetch.h"

namespace tessera::physics {
namespace {

// Number of contacts by which manifolds are prefetched, as they lie all over the memory.
constexpr std::size_t kAhead = 8;
// As far as its points go. The line of the first one holds the beginning of the second one, too.
[[gnu::always_inline]] inline void Prefetch(const Manifold& manifold, std::uint8_t kind) {
  constexpr std::size_t kOthers = (kManifoldPoints - 1) * sizeof(ManifoldPoint), kLast = 2 * sizeof(ManifoldPoint);
  tessera::Prefetch(&manifold, sizeof(Manifold) - kOthers);
  if (kKindPoints[kind] > 1) tessera::Prefetch(&manifold.points[2], kLast);
}

std::uint8_t KindOf(const ContactConstraint& contact) {
  const int count = contact.points != 0 ? contact.points : contact.manifold->count;
  assert(count == contact.manifold->count && count >= 0 && count <= kManifoldPoints);
  const int points = count <= 1 ? 0 : count == 2 ? 1 : 2;
  const PairMaterial& material = contact.material;
  const int tangent = material.rolling_m > 0 || material.spinning_m > 0 ? 2 : material.friction > 0 ? 1 : 0;
  return static_cast<std::uint8_t>(tangent * kPointKinds + points);
}

void Put(Lanes (&to)[3], int lane, Vec3f v) {
  to[0].f[lane] = v.x;
  to[1].f[lane] = v.y;
  to[2].f[lane] = v.z;
}

// Weights of the points for the middle, by the impulses of the last step; those of a new contact by which points touch.
void Weigh(const Manifold& manifold, float (&weights)[kManifoldPoints]) {
  float sum = 0, lowest = manifold.points[0].separation_m;
  for (int i = 0; i < manifold.count; ++i) {
    sum += weights[i] = manifold.points[i].normal_impulse;
    lowest = std::min(lowest, manifold.points[i].separation_m);
  }
  if (!(sum > 0)) {
    sum = 0;
    for (int i = 0; i < manifold.count; ++i) {
      sum += weights[i] = manifold.points[i].separation_m <= lowest + kTouching_m ? 1.0f : 0.0f;
    }
  }
  for (int i = 0; i < manifold.count; ++i) weights[i] /= sum;
}

template <class Block>
void FillTangents(const ContactConstraint& contact, int lane, Block& block) {
  const Manifold& manifold = *contact.manifold;
  const Vec3f friction = manifold.friction_impulse * contact.warm_scale;
  const Vec3f rolling = manifold.rolling_impulse * contact.warm_scale;
  if constexpr (Block::kHasFriction) {
    block.friction.coefficient.f[lane] = contact.material.friction;
    block.friction.impact.f[lane] = 0;
    block.friction.impulse[0].f[lane] = friction.x;
    block.friction.impulse[1].f[lane] = friction.y;
    block.friction.total[0].f[lane] = friction.z;
  }
  if constexpr (Block::kHasTwist) {
    for (Lanes& arm : block.twist.arm) arm.f[lane] = contact.material.spinning_m;
    block.twist.impulse.f[lane] = Dot(rolling, manifold.normal);
    block.twist.total.f[lane] = 0;
  }
  if constexpr (Block::kHasRolling) {
    block.rolling.coefficient.f[lane] = contact.material.rolling_m;
    block.rolling.impulse[0].f[lane] = rolling.x;
    block.rolling.impulse[1].f[lane] = rolling.y;
    block.rolling.total[0].f[lane] = rolling.z;
  }
}

template <class Block>
void FillLane(const ContactConstraint& contact, int lane, std::uint32_t nobody, Softness softness, Block& block) {
  const Manifold& manifold = *contact.manifold;
  ContactHead& head = block.head;
  head.a[lane] = static_cast<std::int32_t>(contact.a == kStatic ? nobody : contact.a) * kStateUnits;
  head.b[lane] = static_cast<std::int32_t>(contact.b == kStatic ? nobody : contact.b) * kStateUnits;
  Put(head.normal, lane, manifold.normal);
  Put(head.offset, lane, manifold.points[0].r_a - manifold.points[0].r_b);
  head.slop.f[lane] = contact.bears ? 0 : contact.slop_m;
  head.round_a.f[lane] = manifold.round_a_m;
  head.round_b.f[lane] = manifold.round_b_m;
  head.soft_mass.f[lane] = softness.mass;
  head.soft_impulse.f[lane] = softness.impulse;
  head.bias_rate.f[lane] = softness.bias_rate;
  head.restitution.f[lane] = contact.material.restitution;
  float weights[kManifoldPoints] = {};
  Weigh(manifold, weights);
  int i = 0;
  for (PointLanes& to : block.points) {
    const bool there = i < manifold.count;
    const ManifoldPoint& point = manifold.points[i];
    Put(to.r_a, lane, there ? point.r_a : Vec3f{});
    to.start_separation.f[lane] = there ? point.separation_m : 0;
    to.mass.f[lane] = there ? 1.0f : 0.0f;
    to.impulse.f[lane] = there ? point.normal_impulse * contact.warm_scale : 0;
    block.weight[i].f[lane] = there ? weights[i] : 0;
    ++i;
  }
  FillTangents(contact, lane, block);
}

Vec3f Take(const Lanes (&axes)[2][3], const Lanes (&along)[2], int lane) {
  const float p = along[0].f[lane], q = along[1].f[lane];
  return {axes[0][0].f[lane] * p + axes[1][0].f[lane] * q, axes[0][1].f[lane] * p + axes[1][1].f[lane] * q,
          axes[0][2].f[lane] * p + axes[1][2].f[lane] * q};
}

template <class Block>
void StoreLane(const Block& block, int lane, Manifold& manifold) {
  for (int i = 0; i < manifold.count; ++i) {
    manifold.points[i].normal_impulse = block.points[i].impulse.f[lane];
    manifold.points[i].total_impulse = block.points[i].total.f[lane];
  }
  manifold.friction_impulse = manifold.total_friction = {};
  manifold.rolling_impulse = manifold.total_rolling = {};
  manifold.turn_on_a = manifold.turn_on_b = {};
  if constexpr (Block::kHasFriction) {
    manifold.friction_impulse = Take(block.friction.tangent, block.friction.impulse, lane);
    manifold.total_friction = Take(block.friction.tangent, block.friction.total, lane);
    manifold.friction_r_a = manifold.friction_r_b = {};
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[i];
      manifold.friction_r_a += point.r_a * block.weight[i].f[lane];
      manifold.friction_r_b += point.r_b * block.weight[i].f[lane];
    }
  }
  if constexpr (Block::kHasTwist) {
    manifold.rolling_impulse = manifold.normal * block.twist.impulse.f[lane];
    manifold.total_rolling = manifold.normal * block.twist.total.f[lane];
  }
  if constexpr (Block::kHasRolling) {
    manifold.rolling_impulse += Take(block.friction.tangent, block.rolling.impulse, lane);
    manifold.total_rolling += Take(block.friction.tangent, block.rolling.total, lane);
  }
}

// Number of contacts that a thread takes at a time.
constexpr std::size_t kChunkContacts = 64;

// Inverse of a body's inertia, 1 / (kg m^2).
float Ease(const SolvedMass& mass) {
  const float* q = mass.root_inertia;
  return q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + 2 * (q[3] * q[3] + q[4] * q[4] + q[5] * q[5]);
}

Vec3f SpinBy(const SolvedMass& mass, Vec3f turn) {
  const float* q = mass.root_inertia;
  return SymMat3f{q[0], q[1], q[2], q[3], q[4], q[5]} * turn;
}

void Turn(SolvedState& state, const SolvedMass& mass, Vec3f by) {
  const Vec3f spin = SpinBy(mass, by);
  state.spin[0] += spin.x;
  state.spin[1] += spin.y;
  state.spin[2] += spin.z;
}

// A contact without friction whose normal goes through both centres, as that of two balls does: it turns neither body.
// Where it has restitution, such a contact is deflected (see `DeflectAll`).
bool TurnsNeither(const ContactConstraint& contact) {
  constexpr float kBeside2 = 1e-8f;  // square of the sine of the angle between arm and normal
  const Manifold& manifold = *contact.manifold;
  const ManifoldPoint& point = manifold.points[0];
  const PairMaterial& material = contact.material;
  if (material.friction > 0 || material.rolling_m > 0 || material.spinning_m > 0) return false;
  if (manifold.count != 1 || !(manifold.round_a_m > 0) || !(manifold.round_b_m > 0)) return false;
  return LengthSquared(Cross(point.r_a, manifold.normal)) <= kBeside2 * LengthSquared(point.r_a) &&
         LengthSquared(Cross(point.r_b, manifold.normal)) <= kBeside2 * LengthSquared(point.r_b);
}

// Whether a turn gives a body at rest more than kMostTurned times the energy that an impulse gives it.
bool TurnsTooFast(Vec3f turn, Vec3f impulse, const SolvedMass& mass) {
  return LengthSquared(SpinBy(mass, turn)) >
         kMostTurned * mass.inverse_root_mass * mass.inverse_root_mass * LengthSquared(impulse);
}

// Takes back the angular momentum that impulses made because they acted apart from their counterparts. A round surface
// is touched under its middle wherever it goes: then the contact has moved over the other body, which has to bear the
// correction. Of two alike surfaces, the body that is harder to turn bears more; so it is, too, where the contact has
// moved so far over the other body that this would be turned too fast.
template <class Block>
void MakeGood(const ContactConstraint& contact, const Block& block, int lane, bool bounces,
              std::span<const SolvedMass> masses) {
  Manifold& manifold = *contact.manifold;
  Vec3f impulse = manifold.total_friction;
  for (int i = 0; i < manifold.count; ++i) impulse += manifold.normal * block.points[i].total.f[lane];
  const LeverArmLanes& lever_arm = block.lever_arm;
  const Vec3f made{lever_arm.made[0].f[lane], lever_arm.made[1].f[lane], lever_arm.made[2].f[lane]};
  const Vec3f lacks = Cross(manifold.ahead_m, impulse) - made;
  if (bounces && TurnsNeither(contact)) {
    manifold.total_friction = lacks;  // until `Store` deflects the two
    return;
  }
  const bool round_a = manifold.round_a_m > 0, round_b = manifold.round_b_m > 0;
  const SolvedMass &mass_a = masses[contact.a], &mass_b = masses[contact.b];
  const float ease_a = Ease(mass_a), ease_b = Ease(mass_b), alike = ease_b / (ease_a + ease_b);
  const bool other_bears = round_a != round_b && !TurnsTooFast(lacks, impulse, round_a ? mass_b : mass_a);
  const float share_a = !other_bears ? alike : round_a ? 0.0f : 1.0f;
  manifold.turn_on_a = lacks * share_a;
  manifold.turn_on_b = lacks - manifold.turn_on_a;
}

// How much of a change of the relative velocity athwart of the line of centres is paid for by the energy of the motion
// along that line, 0 to 1: the largest share with |velocity + share * athwart|^2 <= |velocity|^2 + along^2.
float ShareFor(Vec3f athwart, Vec3f velocity, float along) {
  const float square = LengthSquared(athwart), with = Dot(athwart, velocity), energy = along * along;
  if (!(2 * with + square > energy)) return 1;
  return std::clamp((std::sqrt(with * with + square * energy) - with) / square, 0.0f, 1.0f);
}

// Makes good what such a contact made (see MakeGood) without turning a body: when it acted, its impulse would have had
// the direction of the two centres, so part of it is given athwart of them. As much energy as that adds is taken from
// the motion along the line of centres, and no more is given than that motion can pay for. `apart` is from the centre
// of a to that of b by now.
Vec3f Deflect(Vec3f apart, Vec3f lacks, const SolvedMass& mass_a, const SolvedMass& mass_b, SolvedState& a,
              SolvedState& b) {
  const float root_a = mass_a.inverse_root_mass, root_b = mass_b.inverse_root_mass;
  const float ease = root_a * root_a + root_b * root_b, square = LengthSquared(apart);
  if (!(square > 0)) return {};
  const Vec3f velocity = Get(b.velocity) * root_b - Get(a.velocity) * root_a;
  const Vec3f whole = Cross(lacks, apart) / square, line = apart / std::sqrt(square);
  const float along = Dot(velocity, line);
  Vec3f impulse = whole * ShareFor(whole * ease, velocity, along);
  const Vec3f athwart = impulse * ease;
  const float left = along * along - Dot(athwart, velocity * 2 + athwart);
  impulse += line * ((std::copysign(std::sqrt(std::max(left, 0.0f)), along) - along) / ease);
  Add(a.velocity, impulse * -root_a);
  Add(b.velocity, impulse * root_b);
  return impulse;
}

// Both of its bodies count what it gives them.
bool IsMutual(const ContactConstraint& contact) {
  return contact.a != kStatic && contact.b != kStatic && !contact.driven;
}

}  // namespace

Softness SoftnessOf(float share, float damping_ratio, float h) {
  const float omega_h = 2 * 3.14159265f * share;
  const float stiff = omega_h * (2 * damping_ratio + omega_h);
  return {stiff / (1 + stiff), 1 / (1 + stiff), omega_h / h / (2 * damping_ratio + omega_h)};
}

const std::array<std::size_t, kContactKinds> ContactBlocks::kLanesOfKind = [] {
  std::array<std::size_t, kContactKinds> lanes{};
  for (int kind = 0; kind < kContactKinds; ++kind) {
    lanes[static_cast<std::size_t>(kind)] = ForKind(kind, [](auto* block) { return sizeof(*block) / sizeof(Lanes); });
  }
  return lanes;
}();

// Runs of one color make a stage; a contact that is left over is one by itself.
void ContactBlocks::AddRun(const ContactRun& run) {
  const bool begins = runs_.empty() || run.color == kLeftOver || runs_.back().color != run.color;
  if (begins) stages_.push_back({.first = static_cast<std::uint32_t>(runs_.size())});
  ContactStage& stage = stages_.back();
  runs_.push_back(run);
  runs_.back().before = stage.blocks;
  ++stage.runs;
  stage.blocks += run.blocks;
}

// Decides on the place of each contact. Contacts with restitution have runs of their own.
void ContactBlocks::Lay(std::span<const ContactConstraint> contacts, const Coloring& coloring, const ThreadTeam& team) {
  constexpr std::size_t kBuckets = 2 * kContactKinds;  // in each color
  const std::span<const std::uint8_t> colors = coloring.contacts();
  const auto bucket_of = [&](std::size_t i) {
    return colors[i] * kBuckets + (places_[i].bounces ? kContactKinds : 0) + places_[i].kind;
  };
  counts_.assign(static_cast<std::size_t>(coloring.used()) * kBuckets, 0);
  starts_.resize(counts_.size());
  if (places_.size() < contacts.size()) places_.resize(contacts.size());  // those of a larger batch may stay
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    places_[i].kind = KindOf(contacts[i]);
    places_[i].bounces = contacts[i].material.restitution > 0;
    if (colors[i] != kLeftOver) ++counts_[bucket_of(i)];
  }
  runs_.clear();
  stages_.clear();
  std::size_t end = 0;
  for (std::size_t bucket = 0; bucket < counts_.size(); ++bucket) {
    if (counts_[bucket] == 0) continue;
    const std::size_t kind = bucket % kContactKinds;
    const std::uint32_t blocks = (counts_[bucket] + kLanes - 1) / kLanes;
    AddRun({.kind = static_cast<std::uint8_t>(kind),
            .color = static_cast<std::uint8_t>(bucket / kBuckets),
            .bounces = bucket % kBuckets >= kContactKinds,
            .blocks = blocks,
            .offset = end});
    starts_[bucket] = {end, runs_.back().before};
    end += blocks * kLanesOfKind[kind];
    counts_[bucket] = 0;
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    ContactPlace& place = places_[i];
    if (colors[i] == kLeftOver) {
      AddRun({.kind = place.kind, .color = kLeftOver, .bounces = place.bounces, .blocks = 1, .offset = end});
      place.lane = place.thread = 0;
      place.offset = end;
      end += kLanesOfKind[place.kind];
      continue;
    }
    const std::size_t bucket = bucket_of(i);
    const std::uint32_t n = counts_[bucket]++, block = n / kLanes;
    place.lane = static_cast<std::uint8_t>(n % kLanes);
    place.thread = static_cast<std::uint8_t>(team.ThreadOf(starts_[bucket].before + block, kChunkBlocks));
    place.offset = starts_[bucket].offset + block * kLanesOfKind[place.kind];
  }
  if (memory_.size() < end) memory_.resize(end);
}

void ContactBlocks::Fill(std::span<const ContactConstraint> contacts, const Coloring& coloring, std::uint32_t nobody,
                         float h, ThreadTeam& team) {
  const Softness softness = SoftnessOf(kContactShare, kContactDamping, h);
  // A contact that is soft by the mass of the lighter body gives way by decimetres under a thousand times that mass.
  const Softness rigid{.bias_rate = softness.bias_rate};
  Lay(contacts, coloring, team);
  for (const ContactRun& run : runs_) {
    // Empty lanes name a body that stands for the world on both sides; everything else in them is 0.
    const auto world = static_cast<std::int32_t>(nobody + team.ThreadOf(run.before + run.blocks - 1, kChunkBlocks));
    ForKind(run.kind, [&](auto* type) {
      auto* last = static_cast<decltype(type)>(BlocksOf(run)) + (run.blocks - 1);
      std::memset(static_cast<void*>(last), 0, sizeof(*last));
      std::fill_n(last->head.a, kLanes, world * kStateUnits);
      std::fill_n(last->head.b, kLanes, world * kStateUnits);
    });
  }
  team.For(
      contacts.size(), kChunkContacts, [this, contacts, nobody, softness, rigid](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          if (i + kAhead < end) Prefetch(*contacts[i + kAhead].manifold, places_[i + kAhead].kind);
          const ContactPlace& place = places_[i];
          const Softness& give = contacts[i].bears ? rigid : softness;
          Visit(place, [&](auto& block) { FillLane(contacts[i], place.lane, nobody + place.thread, give, block); });
        }
      });
}

// Several threads may store contacts of one body at once; their corrections are applied after, in the order of
// contacts.
void ContactBlocks::Store(std::span<const ContactConstraint> contacts, std::span<SolvedState> states,
                          std::span<const SolvedMass> masses, ThreadTeam& team) {
  const bool alone = team.size() == 1;
  if (!alone) corrections_.resize(contacts.size());
  const auto apply = [&](const ContactConstraint& contact, const Correction& correction) {
    Turn(states[contact.a], masses[contact.a], correction.on_a);
    Turn(states[contact.b], masses[contact.b], correction.on_b);
  };
  team.For(contacts.size(), kChunkContacts, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (i + kAhead < end) Prefetch(*contacts[i + kAhead].manifold, places_[i + kAhead].kind);
      const ContactConstraint& contact = contacts[i];
      const ContactPlace& place = places_[i];
      Visit(place, [&](auto& block) {
        StoreLane(block, place.lane, *contact.manifold);
        if (IsMutual(contact)) MakeGood(contact, block, place.lane, place.bounces, masses);
      });
      if (!IsMutual(contact)) continue;
      const Correction correction{contact.manifold->turn_on_a, contact.manifold->turn_on_b};
      if (alone) {
        apply(contact, correction);
      } else {
        corrections_[i] = correction;
      }
    }
  });
  if (!alone) {
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      if (IsMutual(contacts[i])) apply(contacts[i], corrections_[i]);
    }
  }
  const auto bounces = [](const ContactRun& run) { return run.bounces; };
  if (std::any_of(runs_.begin(), runs_.end(), bounces)) DeflectAll(contacts, states, masses);
}

// One after the other, since each depends on the velocities that those before it left.
void ContactBlocks::DeflectAll(std::span<const ContactConstraint> contacts, std::span<SolvedState> states,
                               std::span<const SolvedMass> masses) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactConstraint& contact = contacts[i];
    if (!places_[i].bounces || !IsMutual(contact) || !TurnsNeither(contact)) continue;
    Manifold& manifold = *contact.manifold;
    const Vec3f lacks = manifold.total_friction;
    if (lacks == Vec3f()) continue;
    SolvedState &a = states[contact.a], &b = states[contact.b];
    const Vec3f start = manifold.points[0].r_a - manifold.points[0].r_b - manifold.ahead_m;
    const Vec3f apart = start + (Get(b.moved) - Get(a.moved));
    manifold.friction_r_a = manifold.friction_r_b = {};
    manifold.total_friction = Deflect(apart, lacks, masses[contact.a], masses[contact.b], a, b);
  }
}

}  // namespace tessera::physics
