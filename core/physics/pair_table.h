// PairTable: the pairs of bodies whose bounds overlap, and which of them there is work for.
//
// A pair is active while one of its bodies is awake, or is kinematic and under way. Active pairs are kept ascending by
// ids, the order in which everything is done with them, so that nothing depends on how pairs were found. Pairs of
// sleepers keep their contacts and cost nothing.
//
// Thread rule: one thread at a time, which leads a team in `Walk`.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <deque>
#include <span>
#include <vector>

#include "core/physics/rigid_body.h"
#include "core/physics/thread_team.h"
#include "core/world/prefetch.h"

namespace tessera::physics {

// Each group of fields names the one part that writes it. The order is that of the cache lines: the first line is all
// that a step reads of most pairs that are apart; then the manifold, of which one line more is read for every second
// point; then what only pairs read that are searched anew seldom.
struct alignas(64) Pair {
  // --- The pair table.
  RigidBody *low = nullptr, *high = nullptr;  // by id; null once the pair has ended
  bool trigger : 1 = false;                   // One of the two is a trigger: overlaps are reported, nothing is pushed.
  bool jointed : 1 = false;                   // a joint forbids them to collide
  bool remembers : 1 = false;                 // its search reads `cache`
  bool active = false;                        // in the list of active pairs
  // --- The report; the pair table forgets it where a joint comes between the two.
  bool touching = false;  // as the last event said
  // --- The narrow phase.
  bool searched = false;   // contacts were looked for since the pair began
  bool swept = false;      // its points are where the two will meet, not where they are
  bool live = false;       // its points may touch in this step
  bool apart = false;      // out of reach of each other, or excluded by a filter: nothing is kept of the pair
  float separation_m = 0;  // at its nearest point in this step
  // --- The report; the narrow phase forgets them once the two are apart.
  float impulse_ns = 0;  // along the normals, in the last step
  float load_ns = 0;     // the lesser of the last two steps, because a blow is no load
  int substeps = 0;      // number of its last solve; its impulses are those of one of them
  // --- The pair table.
  float inner_m = 0;  // inner radius of the smaller one that moves: what moves less meets nothing unseen
  float slop_m = 0;   // overlap at rest
  std::uint32_t index_in_low = 0, index_in_high = 0;  // in the bodies' lists of pairs
  // --- The narrow phase finds points, and the solver writes their impulses.
  Manifolds manifolds;
  // --- The pair table.
  PairMaterial material;
  // --- The narrow phase.
  PairCache cache;

  bool responds() const { return !trigger && !jointed; }
  RigidBody& Other(const RigidBody& body) const { return &body == low ? *high : *low; }
};

class PairTable {
 public:
  // Names a pair by the serials of its bodies.
  static std::uint64_t KeyOf(std::uint64_t a, std::uint64_t b) { return a < b ? a << 32 | b : b << 32 | a; }
  // Begins a pair unless it is there, or the layers of the two ignore each other.
  void Begin(RigidBody& a, RigidBody& b);
  // Ends a pair with all that it held. If it touched, that is reported as ended.
  void End(Pair& pair);
  Pair* Find(const RigidBody& a, const RigidBody& b);
  // Looks anew whether a joint forbids the two to touch. If one does, contacts between them are over.
  void NoteJoints(const RigidBody& a, const RigidBody& b);

  // The body is made of something else.
  static void NoteMaterial(const RigidBody& body);

  // Pairs that touched when they ended, or when a joint came between them, since this was last called; appended to
  // `events`.
  void TakeEnded(std::vector<PairEvent>* events);
  bool has_ended() const { return !ended_.empty(); }

  // Makes all pairs of a body that woke active.
  void Activate(const RigidBody& body);
  // Sorts in the pairs that became active, and gives the number that a walk goes through at most.
  std::size_t SortIn();
  // Visits all active pairs; pairs that have ended or sleep are dropped. `examine(i, pair)` is called for each by some
  // thread of the team, and may change that pair alone; after that `settle(i, pair)` by the caller, in order, which may
  // begin and end pairs. New ones are seen by the next walk, or by `News`. `i` ascends, and is below what SortIn gave.
  template <class Examine, class Settle>
  void Walk(ThreadTeam& team, Examine examine, Settle settle);
  // Visits the pairs of the last walk, and of `News` since, that have not ended.
  template <class Visit>
  void Revisit(Visit visit) const;
  // Pairs that became active since the last walk or the last call, now sorted in too. Valid until the next of either.
  std::span<Pair* const> News();

  // Active pairs ascend by id, and pairs and bodies name each other. For assertions; linear in active pairs.
  bool Validate() const;

 private:
  // The cache lines of a pair that the next walk will read, as far as the last one tells.
  enum class Reads : std::uint8_t {
    kAll,
    kFirst,  // apart, and the search remembers nothing
    kCache,  // apart
    kPoint   // one point, and the search remembers nothing
  };
  // A pair with the ids of its bodies, so that lists are merged without looking at pairs.
  struct Listed {
    BodyId low, high;
    Pair* pair;
    Reads reads = Reads::kAll;
    friend bool operator<(const Listed& a, const Listed& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; }
  };
  enum class Due : std::uint8_t { kEnded, kResting, kActive };
  struct Found {
    Due due;
    Reads reads;
  };
  static Due DueOf(Pair& pair);
  static Reads ReadsOf(const Pair& pair);
  static void Prefetch(const Listed& listed);
  void Recycle(Pair* pair);
  void Await(std::size_t index) const;

  absl::flat_hash_map<std::uint64_t, Pair*> pairs_;
  std::deque<Pair> pool_;
  std::vector<Pair*> free_, news_;
  std::vector<Listed> active_, fresh_, merged_;
  std::vector<Found> found_;  // by place in `active_`, in the walk under way
  std::vector<PairEvent> ended_;
};

template <class Examine, class Settle>
void PairTable::Walk(ThreadTeam& team, Examine examine, Settle settle) {
  constexpr std::size_t kChunkPairs = 64;
  const std::size_t count = SortIn();
  found_.resize(count);
  team.For(count, kChunkPairs, [this, examine](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Await(i);
      Pair& pair = *active_[i].pair;
      found_[i].due = DueOf(pair);
      if (found_[i].due != Due::kActive) continue;
      examine(i, pair);
      found_[i].reads = ReadsOf(pair);
    }
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (found_[i].due == Due::kEnded) Recycle(active_[i].pair);
    if (found_[i].due != Due::kActive) continue;
    active_[kept] = active_[i];
    active_[kept].reads = found_[i].reads;  // only now: other threads look ahead
    settle(i, *active_[kept++].pair);
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
