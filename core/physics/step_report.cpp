// What a step tells: contacts with their impulses, and which pairs began or ceased to touch.
#include <algorithm>
#include <limits>
#include <tuple>
#include <type_traits>

#include "core/physics/exchange.h"
#include "core/physics/tuning.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {
namespace {

constexpr std::size_t kTold = 320;  // bytes of a pair with one manifold

PairImpulse Summed(const Pair& pair) {
  Exchange<float> exchange;
  for (const Manifold& manifold : pair.manifolds) exchange.Add(manifold);
  PairImpulse sum;
  sum.body_a = pair.low->id();
  sum.body_b = pair.high->id();
  sum.tag_a = pair.low->tag;
  sum.tag_b = pair.high->tag;
  sum.impulse_on_b = exchange.on_b;
  if (pair.low->dynamic()) sum.angular_impulse_on_a = exchange.angular_on_a;
  if (pair.high->dynamic()) sum.angular_impulse_on_b = exchange.angular_on_b;
  return sum;
}

Contact Located(const Pair& pair) {
  Contact contact{Summed(pair), {}, {}, std::numeric_limits<float>::lowest()};
  Vec3f sum;
  int count = 0;
  for (const Manifold& manifold : pair.manifolds) {
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      sum += point.r_a;
      ++count;
      if (-point.separation_m > contact.depth_m) {
        contact.depth_m = -point.separation_m;
        contact.normal = manifold.normal;
      }
    }
  }
  contact.point = pair.low->placement().position + Vec3d(sum / static_cast<float>(std::max(count, 1)));
  return contact;
}

float ImpulseOf(const Pair& pair) {
  float sum = 0;
  for (const Manifold& manifold : pair.manifolds) {
    for (int i = 0; i < manifold.count; ++i) sum += manifold.points[static_cast<std::size_t>(i)].total_impulse;
  }
  return sum;
}

// One that was pushed with while bodies moved within the step, and let go again, has turned them all the same.
bool Acted(const Pair& pair) {
  return ImpulseOf(pair) > 0 || std::any_of(pair.manifolds.begin(), pair.manifolds.end(), [](const Manifold& manifold) {
           return manifold.turn_on_a != Vec3f() || manifold.turn_on_b != Vec3f();
         });
}

bool Before(const PairImpulse& a, const PairImpulse& b) {
  return std::tie(a.body_a, a.body_b) < std::tie(b.body_a, b.body_b);
}

}  // namespace

// Points are where they were at the start of the step; what pushed in it touched, however far away it began.
void World::Impl::ReportContacts() {
  if (contacts_told) return;
  contacts_told = true;
  contacts.clear();
  for (const Touch& touch : touching) {
    const Pair& pair = *touch.pair;
    if (pair.low == nullptr || !pair.responds()) continue;
    if (pair.live || Acted(pair)) contacts.push_back(Located(pair));
  }
  for (const PairImpulse& turning : turnings) AddTurning(turning, &contacts);
}

std::span<const PairImpulse> World::Impl::ReportImpulsesOf(std::span<const std::uint8_t> bits) {
  const auto of = [bits](std::uint32_t tag) { return tag < bits.size() ? bits[tag] : std::uint8_t{0}; };
  const auto both = [&](std::uint32_t low_tag, std::uint32_t high_tag) { return (of(low_tag) | of(high_tag)) == 3; };
  const auto named = [&](const Touch& touch) { return touch.responds && both(touch.low_tag, touch.high_tag); };
  constexpr std::size_t kAhead = 16;
  asked_impulses.clear();
  for (std::size_t i = 0; i < touching.size(); ++i) {
    if (i + kAhead < touching.size() && named(touching[i + kAhead])) AskFor(touching[i + kAhead].pair, kTold);
    const Touch& touch = touching[i];
    if (!named(touch)) continue;
    const Pair& pair = *touch.pair;
    if (pair.low == nullptr || !(pair.live || Acted(pair))) continue;
    asked_impulses.push_back(Summed(pair));
  }
  for (const PairImpulse& turning : turnings) {
    if (both(turning.tag_a, turning.tag_b)) AddTurning(turning, &asked_impulses);
  }
  return asked_impulses;
}

// To those that are told already, which ascend by ids.
template <class Told>
void World::Impl::AddTurning(const PairImpulse& turning, std::vector<Told>* told) const {
  const auto low = bodies.find(turning.body_a), high = bodies.find(turning.body_b);
  if (low == bodies.end() || high == bodies.end() || low->second->isolated || high->second->isolated) return;
  const auto at = std::lower_bound(told->begin(), told->end(), turning, Before);
  if (at != told->end() && !Before(turning, *at)) {
    at->impulse_on_b += turning.impulse_on_b;
    at->angular_impulse_on_a += turning.angular_impulse_on_a;
    at->angular_impulse_on_b += turning.angular_impulse_on_b;
  } else if constexpr (std::is_same_v<Told, Contact>) {
    told->insert(at, Contact{turning, low->second->placement().position, {}, 0});
  } else {
    told->insert(at, turning);
  }
}

void World::Impl::ReportEvents() {
  std::swap(events, ended);
  ended.clear();
  const auto tell = [this](Pair& pair) {
    if (pair.low == nullptr || (pair.jointed && !pair.trigger)) return;
    const float impulse = pair.responds() ? ImpulseOf(pair) : 0;
    pair.load_ns = std::min(impulse, pair.impulse_ns);
    pair.impulse_ns = impulse;
    const bool now =
        pair.crossed || pair.impulse_ns > 0 || pair.separation_m <= (pair.touching ? kTouchEnd_m : kTouchBegin_m);
    pair.crossed = false;
    if (now == pair.touching) return;
    pair.touching = now;
    events.push_back({pair.low->id(), pair.high->id(), pair.trigger, now});
  };
  constexpr std::size_t kAhead = 8;
  for (std::size_t i = 0; i < touching.size(); ++i) {
    if (i + kAhead < touching.size()) AskFor(touching[i + kAhead].pair, kTold);
    touching[i].pair->substeps = touching[i].substeps;
    tell(*touching[i].pair);
  }
  for (Pair* pair : parting) tell(*pair);
  std::sort(events.begin(), events.end(), [](const PairEvent& a, const PairEvent& b) {
    return std::tie(a.body_a, a.body_b, a.begin) < std::tie(b.body_a, b.body_b, b.begin);
  });
}

}  // namespace tessera::physics
