#include "core/physics/solve/impacts.h"

#include <algorithm>
#include <bit>

#include "core/physics/solve/solved_access.h"
#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

// A body flies if the square of all other impulses of a substep is below this share of that of its acceleration. The
// share is well above the rounding of a fast body's velocity.
constexpr float kFlies = 1e-4f;

constexpr std::uint32_t kNoContact = 0xffffffff;

// The place of a block among all, where each takes as much memory as the smallest kind does: no two have the same.
std::size_t ImpactSlot(std::size_t offset, int lane) {
  constexpr std::size_t kLeast = sizeof(ContactBlock<1, Tangent::kNone>) / sizeof(Lanes);
  return offset / kLeast * kLanes + At(lane);
}

}  // namespace

void Impacts::Fill(std::span<const ContactConstraint> contacts, std::size_t bodies, std::size_t worlds) {
  bodies_.clear();
  contacts_ = contacts;
  connected_ = false;
  for (const ContactConstraint& contact : contacts) {
    if (!(contact.material.restitution > 0)) continue;
    if (bodies_.empty()) {
      listed_.assign(bodies, false);
      shifts_.assign(bodies + worlds, {});
      setbacks_.assign(bodies + worlds, {});
      pushes_.assign(bodies + worlds, {});
    }
    for (const std::uint32_t body : {contact.a, contact.b}) {
      if (body == kStatic || listed_[body]) continue;
      listed_[body] = true;
      bodies_.push_back(body);
    }
  }
}

// A drift by the velocity after the kick runs ahead of the parabola by half a kick. A body that nothing but its
// acceleration acts on is shifted back onto the parabola. Any other is pushed.
bool Impacts::FindPaths(SolvedState* states, const SolvedMass* masses, const SolvedMemory* before,
                        const SolvedKick* kicks, float h) {
  bool any = false;
  for (const std::uint32_t i : bodies_) {
    const Vec3f kick = Get(kicks[i].velocity);
    const Vec3f others = (Get(states[i].velocity) - Get(before[i].velocity)) - kick;
    const bool flies = LengthSquared(others) <= kFlies * LengthSquared(kick);
    shifts_[i] = flies ? kick * (-0.5f * h * masses[i].inverse_root_mass) : Vec3f();
    const Vec3f spun = (Get(states[i].spin) - Get(before[i].spin)) - Get(kicks[i].spin);
    pushes_[i] = flies ? Pushed() : Pushed{others, spun};
    Add(states[i].moved, shifts_[i]);
    any |= shifts_[i] != Vec3f();
  }
  return any;
}

// Lists the contacts of each body, when the first of them approaches.
void Impacts::Connect(const ContactBlocks& blocks) {
  if (connected_) return;
  connected_ = true;
  blows_.assign(contacts_.size(), {});
  next_.resize(2 * contacts_.size());
  first_.assign(listed_.size(), kNoContact);
  at_slot_.resize(ImpactSlot(blocks.lanes(), kLanes));
  for (std::uint32_t i = 0; i < contacts_.size(); ++i) {
    const ContactConstraint& contact = contacts_[i];
    if (!(contact.material.restitution > 0)) continue;
    const ContactPlace& place = blocks.PlaceOf(i);
    at_slot_[ImpactSlot(place.offset, place.lane)] = i;
    std::size_t side = 2 * static_cast<std::size_t>(i);
    for (const std::uint32_t body : {contact.a, contact.b}) {
      if (body != kStatic) {
        next_[side] = first_[body];
        first_[body] = i;
      }
      ++side;
    }
  }
}

void Impacts::ForeseeAll(const Kernels& kernels, ContactBlocks& blocks, const StruckBodies& bodies) {
  for (const ContactRun& run : blocks.runs()) {
    if (!run.bounces) continue;
    lanes_.resize(std::max<std::size_t>(lanes_.size(), run.blocks));
    kernels.contacts[run.kind].approach(blocks.BlocksOf(run), run.blocks, bodies.states, kBounce_m_s, lanes_.data());
    for (std::size_t k = 0; k < run.blocks; ++k) {
      if (lanes_[k] == 0) continue;
      Connect(blocks);
      for (unsigned lanes = lanes_[k]; lanes != 0; lanes &= lanes - 1) {
        Foresee(blocks, bodies, at_slot_[ImpactSlot(ContactBlocks::OffsetOf(run, k), std::countr_zero(lanes))], 0);
      }
    }
  }
}

// Finds when the contact strikes next, as its bodies move since `from`.
void Impacts::Foresee(ContactBlocks& blocks, const StruckBodies& bodies, std::uint32_t contact, float from) {
  Blow& blow = blows_[contact];
  if (blow.struck == kMostBlows) return;
  if (blow.foreseen++ == 0) foreseen_.push_back(contact);
  blow.from = from;
  const ContactPlace& place = blocks.PlaceOf(contact);
  blocks.Visit(place, [&](auto& block) {
    const std::optional<float> time = Striking(block, place.lane, bodies).FirstHit(from);
    if (!time) return;
    events_.push_back({*time, contact, blow.foreseen});
    std::push_heap(events_.begin(), events_.end());
  });
}

void Impacts::StrikeAll(ContactBlocks& blocks, const StruckBodies& bodies) {
  while (!events_.empty()) {
    const Event event = events_.front();
    std::pop_heap(events_.begin(), events_.end());
    events_.pop_back();
    Blow& blow = blows_[event.contact];
    if (blow.foreseen != event.foreseen) continue;
    ++blow.struck;
    const ContactPlace& place = blocks.PlaceOf(event.contact);
    SpeedChange change;
    blocks.Visit(place,
                 [&](auto& block) { change = Striking(block, place.lane, bodies).Strike(blow.from, event.time); });
    Foresee(blocks, bodies, event.contact, event.time);
    const ContactConstraint& contact = contacts_[event.contact];
    if (change.of_a > kUnmoved_m_s) ForeseeOthers(blocks, bodies, contact.a, event);
    if (change.of_b > kUnmoved_m_s) ForeseeOthers(blocks, bodies, contact.b, event);
  }
}

// Those of a body that was struck, but for the contact that struck it.
void Impacts::ForeseeOthers(ContactBlocks& blocks, const StruckBodies& bodies, std::uint32_t body, const Event& event) {
  if (body == kStatic) return;
  for (std::uint32_t i = first_[body]; i != kNoContact; i = next_[2 * std::size_t{i} + (contacts_[i].b == body)]) {
    if (i != event.contact) Foresee(blocks, bodies, i, event.time);
  }
}

void Impacts::Forget() {
  for (const std::uint32_t i : foreseen_) {
    blows_[i] = {};
    for (const std::uint32_t body : {contacts_[i].a, contacts_[i].b}) {
      if (body != kStatic) setbacks_[body] = {};
    }
  }
  foreseen_.clear();
}

bool Impacts::Bounce(const Kernels& kernels, ContactBlocks& blocks, SolvedState* states, const SolvedMass* masses,
                     SolvedMemory* before, const SolvedKick* kicks, float h) {
  const bool shifted = FindPaths(states, masses, before, kicks, h);
  const StruckBodies bodies{states, masses, before, shifts_.data(), setbacks_.data(), pushes_.data(), h};
  ForeseeAll(kernels, blocks, bodies);
  const bool strikes = !events_.empty();
  StrikeAll(blocks, bodies);
  Forget();
  return shifted || strikes;
}

}  // namespace tessera::physics
