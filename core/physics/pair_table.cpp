#include "core/physics/pair_table.h"

#include <algorithm>
#include <cmath>

#include "core/physics/joint.h"
#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

void Attach(RigidBody& body, Pair& pair) {
  (&body == pair.low ? pair.index_in_low : pair.index_in_high) = static_cast<std::uint32_t>(body.pairs.size());
  body.pairs.push_back({&pair, &pair.Other(body)});
}

void Detach(RigidBody& body, const Pair& pair) {
  const std::uint32_t index = &body == pair.low ? pair.index_in_low : pair.index_in_high;
  const PairEnd last = body.pairs.back();
  body.pairs[index] = last;
  (&body == last.pair->low ? last.pair->index_in_low : last.pair->index_in_high) = index;
  body.pairs.pop_back();
}

PairMaterial Combine(const Material& a, const Material& b) {
  return {.friction = static_cast<float>(std::sqrt(a.friction * b.friction)),
          .rolling_m = static_cast<float>(std::max(a.rolling_friction, b.rolling_friction)),
          .spinning_m = static_cast<float>(std::max(a.spinning_friction, b.spinning_friction)),
          .restitution = static_cast<float>(std::max(a.restitution, b.restitution))};
}

float InnerRadiusOf(const Pair& pair) {
  const float low = pair.low->geometry().inner_radius_m, high = pair.high->geometry().inner_radius_m;
  if (!pair.low->dynamic()) return high;
  if (!pair.high->dynamic()) return low;
  return std::min(low, high);
}

bool HasBall(const Pair& pair) {
  const auto is_ball = [](const RigidBody* body) { return body->geometry().kind == GeometryKind::kSphere; };
  return is_ball(pair.low) || is_ball(pair.high);
}

}  // namespace

void PairTable::Begin(RigidBody& a, RigidBody& b) {
  if (!a.layer().CollidesWith(b.layer())) return;
  const auto [it, inserted] = pairs_.try_emplace(KeyOf(a.serial, b.serial), nullptr);
  if (!inserted) return;
  if (free_.empty()) {
    pool_.emplace_back();
    free_.push_back(&pool_.back());
  }
  Pair& pair = *free_.back();
  free_.pop_back();
  it->second = &pair;
  pair.low = a.id() < b.id() ? &a : &b;
  pair.high = a.id() < b.id() ? &b : &a;
  pair.trigger = a.trigger() || b.trigger();
  pair.remembers = Remembers(a.geometry(), b.geometry());
  pair.inner_m = InnerRadiusOf(pair);
  pair.slop_m = std::clamp(kSlopShare * pair.inner_m, kLeastSlop_m, HasBall(pair) ? kBallSlop_m : kSlop_m);
  pair.material = Combine(pair.low->material(), pair.high->material());
  pair.jointed = JointForbidsContact(a, b);
  Attach(*pair.low, pair);
  Attach(*pair.high, pair);
  if (a.stirs() || b.stirs()) {
    pair.active = true;
    fresh_.push_back({pair.low->id(), pair.high->id(), &pair});
  }
}

void PairTable::End(Pair& pair) {
  if (pair.touching) ended_.push_back({pair.low->id(), pair.high->id(), pair.trigger, false});
  pairs_.erase(KeyOf(pair.low->serial, pair.high->serial));
  Detach(*pair.low, pair);
  Detach(*pair.high, pair);
  pair.low = pair.high = nullptr;
  if (!pair.active) {
    pair = Pair();
    free_.push_back(&pair);
  }  // An active pair is free once it is off the list.
}

Pair* PairTable::Find(const RigidBody& a, const RigidBody& b) {
  const auto it = pairs_.find(KeyOf(a.serial, b.serial));
  return it != pairs_.end() ? it->second : nullptr;
}

void PairTable::NoteJoints(const RigidBody& a, const RigidBody& b) {
  Pair* pair = Find(a, b);
  if (pair == nullptr) return;
  pair->jointed = JointForbidsContact(a, b);
  if (!pair->jointed || pair->trigger) return;
  if (pair->touching) ended_.push_back({pair->low->id(), pair->high->id(), false, false});
  pair->touching = false;
  pair->manifolds.clear();
}

void PairTable::NoteMaterial(const RigidBody& body) {
  for (const auto& [pair, other] : body.pairs) pair->material = Combine(pair->low->material(), pair->high->material());
}

void PairTable::TakeEnded(std::vector<PairEvent>* events) {
  events->insert(events->end(), ended_.begin(), ended_.end());
  ended_.clear();
}

void PairTable::Activate(const RigidBody& body) {
  for (const auto& [pair, other] : body.pairs) {
    if (pair->active) continue;
    pair->active = true;
    fresh_.push_back({pair->low->id(), pair->high->id(), pair});
  }
}

// Whether the pair leaves the list: it has ended, and so is free again, or it sleeps.
PairTable::Due PairTable::DueOf(Pair& pair) {
  if (pair.low == nullptr) return Due::kEnded;
  pair.active = pair.low->stirs() || pair.high->stirs();
  return pair.active ? Due::kActive : Due::kResting;
}

void PairTable::Recycle(Pair* pair) {
  *pair = Pair();
  free_.push_back(pair);
}

std::size_t PairTable::SortIn() {
  if (fresh_.empty()) return active_.size();
  std::sort(fresh_.begin(), fresh_.end());
  merged_.resize(active_.size() + fresh_.size());
  std::merge(active_.begin(), active_.end(), fresh_.begin(), fresh_.end(), merged_.begin());
  std::swap(active_, merged_);
  fresh_.clear();
  return active_.size();
}

std::span<Pair* const> PairTable::News() {
  news_.clear();
  std::sort(fresh_.begin(), fresh_.end());
  for (const Listed& listed : fresh_) {
    if (listed.pair->low != nullptr) news_.push_back(listed.pair);
  }
  SortIn();
  return news_;
}

PairTable::Reads PairTable::ReadsOf(const Pair& pair) {
  if (pair.manifolds.empty()) return pair.remembers ? Reads::kCache : Reads::kFirst;
  return pair.remembers || pair.manifolds[0].count > 1 ? Reads::kAll : Reads::kPoint;
}

[[gnu::always_inline]] inline void PairTable::Prefetch(const Listed& listed) {
  constexpr std::size_t kLine = 64;
  const Pair& pair = *listed.pair;
  switch (listed.reads) {
    case Reads::kFirst:
      __builtin_prefetch(&pair);
      return;
    case Reads::kCache:
      __builtin_prefetch(&pair);
      tessera::Prefetch(&pair.material, 3 * kLine);  // as far as the axis of the last search
      return;
    case Reads::kPoint:
      tessera::Prefetch(&pair, 4 * kLine);
      __builtin_prefetch(&pair.material);
      return;
    case Reads::kAll:
      tessera::Prefetch(&pair, sizeof(Pair));
  }
}

void PairTable::Await(std::size_t index) const {
  constexpr std::size_t kPairsAhead = 12, kBodiesAhead = 8, kHotOfBody = 384;
  if (index + kPairsAhead < active_.size()) Prefetch(active_[index + kPairsAhead]);
  if (index + kBodiesAhead >= active_.size()) return;
  const Listed& soon = active_[index + kBodiesAhead];
  if (soon.low != active_[index + kBodiesAhead - 1].low) tessera::Prefetch(soon.pair->low, kHotOfBody);
  tessera::Prefetch(soon.pair->high, kHotOfBody);
}

bool PairTable::Validate() const {
  const auto holds = [](const RigidBody& body, std::uint32_t index, const Pair* pair) {
    return index < body.pairs.size() && body.pairs[index].pair == pair && body.pairs[index].other == &pair->Other(body);
  };
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Listed& listed = active_[i];
    if (i > 0 && listed < active_[i - 1]) return false;
    const Pair& pair = *listed.pair;
    if (!pair.active) return false;
    if (pair.low == nullptr) continue;  // It has ended and leaves the list in the next walk.
    if (pair.low->id() != listed.low || pair.high->id() != listed.high || !(listed.low < listed.high)) return false;
    if (!holds(*pair.low, pair.index_in_low, &pair) || !holds(*pair.high, pair.index_in_high, &pair)) return false;
  }
  return true;
}

}  // namespace tessera::physics
