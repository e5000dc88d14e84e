#include "core/physics/pair_table.h"

#include <algorithm>
#include <cmath>

#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

bool Before(const Pair* a, const Pair* b) {
  return a->low->id() != b->low->id() ? a->low->id() < b->low->id() : a->high->id() < b->high->id();
}

void Attach(RigidBody& body, Pair& pair) {
  (&body == pair.low ? pair.index_in_low : pair.index_in_high) = static_cast<std::uint32_t>(body.pairs.size());
  body.pairs.push_back(&pair);
}

void Detach(RigidBody& body, const Pair& pair) {
  const std::uint32_t index = &body == pair.low ? pair.index_in_low : pair.index_in_high;
  Pair* last = body.pairs.back();
  body.pairs[index] = last;
  (&body == last->low ? last->index_in_low : last->index_in_high) = index;
  body.pairs.pop_back();
}

PairMaterial Combine(const Material& a, const Material& b) {
  return {.friction = static_cast<float>(std::sqrt(a.friction * b.friction)),
          .rolling_m = static_cast<float>(std::max(a.rolling_friction, b.rolling_friction)),
          .spinning_m = static_cast<float>(std::max(a.spinning_friction, b.spinning_friction)),
          .restitution = static_cast<float>(std::max(a.restitution, b.restitution))};
}

}  // namespace

float InnerRadiusOf(const Pair& pair) {
  const float low = pair.low->geometry().inner_radius_m, high = pair.high->geometry().inner_radius_m;
  if (!pair.low->dynamic()) return high;
  if (!pair.high->dynamic()) return low;
  return std::min(low, high);
}

std::uint64_t PairTable::KeyOf(const RigidBody& a, const RigidBody& b) {
  return a.serial < b.serial ? a.serial << 32 | b.serial : b.serial << 32 | a.serial;
}

void PairTable::Begin(RigidBody& a, RigidBody& b) {
  const auto [it, inserted] = pairs_.try_emplace(KeyOf(a, b), nullptr);
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
  pair.slop_m = std::clamp(kSlopShare * InnerRadiusOf(pair), kLeastSlop_m, kSlop_m);
  pair.material = Combine(pair.low->material(), pair.high->material());
  Attach(*pair.low, pair);
  Attach(*pair.high, pair);
  if (a.awake() || b.awake()) {
    pair.active = true;
    fresh_.push_back(&pair);
  }
}

void PairTable::End(Pair& pair) {
  pairs_.erase(KeyOf(*pair.low, *pair.high));
  Detach(*pair.low, pair);
  Detach(*pair.high, pair);
  pair.low = pair.high = nullptr;
  if (!pair.active) {
    pair = Pair();
    free_.push_back(&pair);
  }  // else `Refresh` takes it off the list first
}

Pair* PairTable::Find(const RigidBody& a, const RigidBody& b) {
  const auto it = pairs_.find(KeyOf(a, b));
  return it != pairs_.end() ? it->second : nullptr;
}

void PairTable::Activate(RigidBody& body) {
  for (Pair* pair : body.pairs) {
    if (pair->active) continue;
    pair->active = true;
    fresh_.push_back(pair);
  }
}

// Frees it if it has ended meanwhile.
bool PairTable::Bury(Pair* pair) {
  if (pair->low != nullptr) return false;
  *pair = Pair();
  free_.push_back(pair);
  return true;
}

std::span<Pair* const> PairTable::News() {
  news_.clear();
  std::swap(news_, fresh_);
  const auto bury = [this](Pair* pair) { return Bury(pair); };
  std::erase_if(news_, bury);
  if (news_.empty()) return news_;
  std::sort(news_.begin(), news_.end(), Before);
  std::erase_if(active_, bury);
  merged_.resize(active_.size() + news_.size());
  std::merge(active_.begin(), active_.end(), news_.begin(), news_.end(), merged_.begin(), Before);
  std::swap(active_, merged_);
  return news_;
}

std::span<Pair* const> PairTable::Refresh() {
  std::erase_if(active_, [this](Pair* pair) {
    if (Bury(pair)) return true;
    if (pair->low->awake() || pair->high->awake()) return false;
    pair->active = false;
    return true;
  });
  News();
  return active_;
}

}  // namespace tessera::physics
