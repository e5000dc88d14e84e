// PairTable: the pairs of bodies whose bounds overlap, and which of them there is work for.
//
// A pair is active while one of its bodies is awake. Active pairs are kept ascending by ids, the order in which
// everything is done with them, so that nothing depends on how pairs were found. Pairs of sleepers keep their contacts
// and cost nothing.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <deque>
#include <span>
#include <vector>

#include "core/physics/rigid_body.h"

namespace tessera::physics {

// What every step reads comes first, close together.
struct alignas(64) Pair {
  RigidBody *low = nullptr, *high = nullptr;  // by id
  bool trigger = false;                       // one of them is: overlaps are told, nothing is pushed
  bool jointed = false;                       // a joint forbids them to collide
  bool searched = false;                      // contacts were looked for since it began
  bool active = false;                        // in the list
  bool touching = false;                      // as events were told
  bool crossed = false;                       // they met within this step, and may be apart again at its end
  bool swept = false;                         // its points are where it will meet, not where it is
  bool live = false;                          // in this step its points may touch
  bool apart = false;                         // out of reach of each other, or not to touch: nothing is kept of it
  float separation_m = 0;                     // of its nearest point in this step
  float impulse_ns = 0;                       // along the normals, in the last step
  float load_ns = 0;                          // the lesser of the last two: a blow is no load
  int substeps = 0;                           // of its last solving; its impulses are those of one of them
  float inner_m = 0;                          // of the smaller one that moves: what moves less meets nothing unseen
  float slop_m = 0;                           // how deep it rests
  Manifolds manifolds;
  PairMaterial material;
  PairCache cache;
  std::uint32_t index_in_low = 0, index_in_high = 0;  // in their lists of pairs

  bool responds() const { return !trigger && !jointed; }
  RigidBody& Other(const RigidBody& body) const { return &body == low ? *high : *low; }
};

// Asks for what a step reads of a pair, or of a body, some iterations before it is worked on: they lie all over the
// memory.
inline void AskFor(const void* at, std::size_t bytes) {
  constexpr std::size_t kLine = 64;
  for (std::size_t i = 0; i < bytes; i += kLine) __builtin_prefetch(static_cast<const char*>(at) + i);
}

class PairTable {
 public:
  // Names a pair by the serials of its bodies.
  static std::uint64_t KeyOf(std::uint64_t a, std::uint64_t b) { return a < b ? a << 32 | b : b << 32 | a; }
  bool Has(std::uint64_t key) const { return pairs_.contains(key); }
  // Begins a pair unless it is there.
  void Begin(RigidBody& a, RigidBody& b);
  // Ends it; what it held is gone.
  void End(Pair& pair);
  Pair* Find(const RigidBody& a, const RigidBody& b);

  // Puts all pairs of a body that woke on the list.
  void Activate(RigidBody& body);
  // Visits all active pairs in order, after what became active was sorted in; what has ended or sleeps meanwhile is
  // dropped. A visit may begin and end pairs; what begins is seen by the next walk, or by `News`.
  template <class Visit>
  void Walk(Visit visit);
  // Visits those of the last walk, and of `News` since, that have not ended.
  template <class Visit>
  void Revisit(Visit visit) const;
  // Those that became active since the last call of either, now sorted in too. Good until the next call of either.
  std::span<Pair* const> News();

 private:
  // Its ids beside the pair, so that lists are merged without looking at pairs.
  struct Listed {
    BodyId low, high;
    Pair* pair;
    friend bool operator<(const Listed& a, const Listed& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; }
  };
  void SortIn();
  bool Drop(Pair* pair);
  void Await(std::size_t index) const;

  absl::flat_hash_map<std::uint64_t, Pair*> pairs_;
  std::deque<Pair> pool_;
  std::vector<Pair*> free_, news_;
  std::vector<Listed> active_, fresh_, merged_;
};

template <class Visit>
void PairTable::Walk(Visit visit) {
  SortIn();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < active_.size(); ++i) {
    Await(i);
    const Listed listed = active_[i];
    if (Drop(listed.pair)) continue;
    active_[kept++] = listed;
    visit(*listed.pair);
  }
  active_.resize(kept);
}

template <class Visit>
void PairTable::Revisit(Visit visit) const {
  for (std::size_t i = 0; i < active_.size(); ++i) {
    Await(i);
    if (active_[i].pair->low != nullptr) visit(*active_[i].pair);
  }
}

}  // namespace tessera::physics
