#include "core/physics/report.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <tuple>
#include <type_traits>

#include "core/physics/exchange.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

constexpr std::size_t kPairBytes = 320;     // that are read of a pair with one manifold
constexpr std::size_t kChunkReported = 64;  // contacts that a thread takes at a time

PairImpulse ImpulseOf(const Pair& pair) {
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

float NormalImpulseOf(const Pair& pair) {
  float sum = 0;
  for (const Manifold& manifold : pair.manifolds) {
    for (int i = 0; i < manifold.count; ++i) sum += manifold.points[static_cast<std::size_t>(i)].total_impulse;
  }
  return sum;
}

// Whether a contact acted, however far away it was at the start of the step. One that pushed while the bodies moved
// within the step, and let go again, has turned them all the same.
bool Acted(const Pair& pair) {
  const auto turned = [](const Manifold& manifold) {
    return manifold.turn_on_a != Vec3f() || manifold.turn_on_b != Vec3f();
  };
  return NormalImpulseOf(pair) > 0 || std::any_of(pair.manifolds.begin(), pair.manifolds.end(), turned);
}

bool Before(const PairImpulse& a, const PairImpulse& b) {
  return std::tie(a.body_a, a.body_b) < std::tie(b.body_a, b.body_b);
}

// Adds an impulse to those of the same pair, or puts it between the others, which ascend by ids.
template <class Reported>
void AddStopImpulse(const PairImpulse& impulse, const BodyStore& bodies, std::vector<Reported>* reported) {
  const RigidBody *low = bodies.Find(impulse.body_a), *high = bodies.Find(impulse.body_b);
  if (low == nullptr || high == nullptr || low->isolated || high->isolated) return;
  const auto at = std::lower_bound(reported->begin(), reported->end(), impulse, Before);
  if (at != reported->end() && !Before(impulse, *at)) {
    at->impulse_on_b += impulse.impulse_on_b;
    at->angular_impulse_on_a += impulse.angular_impulse_on_a;
    at->angular_impulse_on_b += impulse.angular_impulse_on_b;
  } else if constexpr (std::is_same_v<Reported, Contact>) {
    reported->insert(at, Contact{impulse, low->placement().position, {}, 0});
  } else {
    // Places may have shifted since the step.
    PairImpulse& added = *reported->insert(at, impulse);
    added.tag_a = low->tag, added.tag_b = high->tag;
  }
}

}  // namespace

Contact ContactOf(const Pair& pair) {
  Contact contact{ImpulseOf(pair), {}, {}, std::numeric_limits<float>::lowest()};
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
  if (count == 0) contact.depth_m = 0;
  contact.point = pair.low->placement().position + Vec3d(sum / static_cast<float>(std::max(count, 1)));
  return contact;
}

void Report::RunIdle() {
  events_.clear();
  contacts_.clear();
  contacts_known_ = true;
}

void Report::Run(const StepOutcome& outcome, PairTable& pairs) {
  contacts_known_ = false;
  events_.clear();
  pairs.TakeEnded(&events_);
  crossed_.assign(outcome.crossed.begin(), outcome.crossed.end());
  std::sort(crossed_.begin(), crossed_.end(), std::less<>());
  crossed_.erase(std::unique(crossed_.begin(), crossed_.end()), crossed_.end());
  const auto crossed = [this](Pair* pair) {
    return !crossed_.empty() && std::binary_search(crossed_.begin(), crossed_.end(), pair, std::less<>());
  };
  NoteContacts(outcome.contacts, crossed);
  for (Pair* pair : outcome.parting) Note(*pair, crossed(pair), &events_);
  // A pair that only crossed is in neither list.
  for (Pair* pair : crossed_) {
    if (pair->manifolds.empty() && !pair->touching) Note(*pair, true, &events_);
  }
  std::sort(events_.begin(), events_.end(), [](const PairEvent& a, const PairEvent& b) {
    return std::tie(a.body_a, a.body_b, a.begin) < std::tie(b.body_a, b.body_b, b.begin);
  });
}

void Report::NoteContacts(std::span<const ActiveContact> contacts, absl::FunctionRef<bool(Pair*)> crossed) {
  for (std::vector<PairEvent>& events : noted_) events.clear();
  noted_.resize(std::max(noted_.size(), contacts.size() / kChunkReported + 1));
  team_.For(contacts.size(), kChunkReported, [this, contacts, crossed](std::size_t begin, std::size_t end) {
    constexpr std::size_t kAhead = 8;
    for (std::size_t i = begin; i < end; ++i) {
      if (i + kAhead < end) tessera::Prefetch(contacts[i + kAhead].pair, kPairBytes);
      Pair& pair = *contacts[i].pair;
      pair.substeps = contacts[i].substeps;
      Note(pair, crossed(&pair), &noted_[begin / kChunkReported]);
    }
  });
  for (const std::vector<PairEvent>& events : noted_) events_.insert(events_.end(), events.begin(), events.end());
}

void Report::Note(Pair& pair, bool crossed, std::vector<PairEvent>* events) {
  if (pair.low == nullptr || (pair.jointed && !pair.trigger)) return;
  const float impulse = pair.responds() ? NormalImpulseOf(pair) : 0;
  pair.load_ns = std::min(impulse, pair.impulse_ns);
  pair.impulse_ns = impulse;
  const bool touches = crossed || impulse > 0 || pair.separation_m <= (pair.touching ? kTouchEnd_m : kTouchBegin_m);
  if (touches == pair.touching) return;
  pair.touching = touches;
  events->push_back({pair.low->id(), pair.high->id(), pair.trigger, touches});
}

std::span<const Contact> Report::Contacts(const StepOutcome& outcome, const BodyStore& bodies) {
  if (contacts_known_) return contacts_;
  contacts_known_ = true;
  contacts_.clear();
  for (const ActiveContact& active : outcome.contacts) {
    const Pair& pair = *active.pair;
    if (pair.low == nullptr || !pair.responds()) continue;
    if (pair.live || Acted(pair)) contacts_.push_back(ContactOf(pair));
  }
  for (const PairImpulse& impulse : outcome.stop_impulses) AddStopImpulse(impulse, bodies, &contacts_);
  return contacts_;
}

std::span<const PairImpulse> Report::ImpulsesOf(std::span<const std::uint8_t> bits, const StepOutcome& outcome,
                                                const BodyStore& bodies) {
  const auto of = [bits](std::uint32_t tag) { return tag < bits.size() ? bits[tag] : std::uint8_t{0}; };
  const auto both = [&](std::uint32_t low_tag, std::uint32_t high_tag) { return (of(low_tag) | of(high_tag)) == 3; };
  const auto asked = [&](const ActiveContact& contact) {
    return contact.responds && both(contact.low_tag, contact.high_tag);
  };
  constexpr std::size_t kAhead = 16;
  const std::span<const ActiveContact> contacts = outcome.contacts;
  impulses_.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (i + kAhead < contacts.size() && asked(contacts[i + kAhead]))
      tessera::Prefetch(contacts[i + kAhead].pair, kPairBytes);
    if (!asked(contacts[i])) continue;
    const Pair& pair = *contacts[i].pair;
    if (pair.low == nullptr || !(pair.live || Acted(pair))) continue;
    impulses_.push_back(ImpulseOf(pair));
  }
  for (const PairImpulse& impulse : outcome.stop_impulses) {
    if (both(impulse.tag_a, impulse.tag_b)) AddStopImpulse(impulse, bodies, &impulses_);
  }
  return impulses_;
}

bool Report::Validate() const {
  const auto key = [](const PairEvent& event) { return std::tie(event.body_a, event.body_b, event.begin); };
  for (std::size_t i = 0; i < events_.size(); ++i) {
    if (!(events_[i].body_a < events_[i].body_b)) return false;
    if (i > 0 && !(key(events_[i - 1]) < key(events_[i]))) return false;
  }
  return true;
}

}  // namespace tessera::physics
