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

struct Pair {
  RigidBody *low = nullptr, *high = nullptr;  // by id
  PairCache cache;
  std::vector<Manifold> manifolds;
  PairMaterial material;
  float slop_m = 0;                                   // how deep it rests
  bool trigger = false;                               // one of them is: overlaps are told, nothing is pushed
  bool jointed = false;                               // a joint forbids them to collide
  bool searched = false;                              // contacts were looked for since it began
  bool active = false;                                // in the list
  bool touching = false;                              // as events were told
  bool crossed = false;                               // they met within this step, and may be apart again at its end
  float impulse_ns = 0;                               // along the normals, in the last step
  float load_ns = 0;                                  // the lesser of the last two: a blow is no load
  int substeps = 0;                                   // of its last solving; its impulses are those of one of them
  float separation_m = 0;                             // of its nearest point in this step
  bool swept = false;                                 // its points are where it will meet, not where it is
  bool live = false;                                  // in this step its points may touch
  std::uint32_t index_in_low = 0, index_in_high = 0;  // in their lists of pairs

  bool responds() const { return !trigger && !jointed; }
  RigidBody& Other(const RigidBody& body) const { return &body == low ? *high : *low; }
};

// Of the smaller one that moves, m: what moves less than this meets nothing unseen.
float InnerRadiusOf(const Pair& pair);

class PairTable {
 public:
  // Begins a pair unless it is there.
  void Begin(RigidBody& a, RigidBody& b);
  // Ends it; what it held is gone.
  void End(Pair& pair);
  Pair* Find(const RigidBody& a, const RigidBody& b);

  // Puts all pairs of a body that woke on the list.
  void Activate(RigidBody& body);
  // All active pairs, after what became active was sorted in and what is so no more was dropped. Good until the next
  // call of this or `News`.
  std::span<Pair* const> Refresh();
  // Those that became active since the last call of either, now sorted in too.
  std::span<Pair* const> News();
  std::span<Pair* const> active() const { return active_; }  // some may have ended: `low` is null

 private:
  static std::uint64_t KeyOf(const RigidBody& a, const RigidBody& b);
  bool Bury(Pair* pair);

  absl::flat_hash_map<std::uint64_t, Pair*> pairs_;
  std::deque<Pair> pool_;
  std::vector<Pair*> free_;
  std::vector<Pair*> active_, news_, merged_, fresh_;
};

}  // namespace tessera::physics
