// BroadPhase: which bodies' bounds overlap, by two trees of bounds: one of dynamic bodies, one of all others.
//
// Each step it predicts how every awake body moves, bounds that motion, and begins a pair in the pair table where two
// bounds come to overlap. The trees hold bounds with a margin, so that most bodies leave theirs in few steps. Those
// that do are noted with the bounds they had, and the trees are asked about them alone: a pair is found once, when it
// begins, and the pair table keeps it. So a body that sleeps costs nothing.
//
// Thread rule: one thread at a time, which leads the team. It changes the trees; the team asks them.
#pragma once

#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/physics/bounds_tree.h"
#include "core/physics/motion/sweep.h"
#include "core/physics/pair_table.h"
#include "core/physics/query/way.h"
#include "core/physics/rigid_body.h"
#include "core/physics/thread_team.h"

namespace tessera::physics {

// How an awake body moves in a step of `dt_s` if nothing hinders it.
PredictedMotion PredictMotion(const RigidBody& body, double dt_s);

class BroadPhase {
 public:
  // Bounds are in single precision about `origin`.
  explicit BroadPhase(Vec3d origin, ThreadTeam& team = ThreadTeam::Alone());
  BroadPhase(const BroadPhase&) = delete;
  BroadPhase& operator=(const BroadPhase&) = delete;

  void Add(RigidBody& body);
  void Remove(RigidBody& body);
  // Takes note that a body was moved outside a step.
  void Move(RigidBody& body);

  // The pass: predicts the motion of each awake body and of the kinematic ones under way, and bounds all that it can
  // touch in the step. Afterwards `BeginPairs` begins the pairs.
  void Predict(std::span<RigidBody* const> awake, double dt_s, std::span<RigidBody* const> moving = {});
  // Begins a pair wherever bounds came to overlap since the last call.
  void BeginPairs(PairTable* pairs);

  // Bounds of the body where it is, without any margin.
  Bounds TightBounds(const RigidBody& body) const;
  // Bounds of all that a body may touch while it moves so.
  Bounds SweptBounds(const SweptMotion& motion) const;
  // Appends the bodies whose fat bounds overlap these.
  void Overlapping(const Bounds& bounds, std::vector<RigidBody*>* bodies);

  // Visits the bodies whose fat bounds a box of half extents `half_m` crosses on its way, about the origin, until a
  // visit returns false; in no order.
  void Along(const Way& way, Vec3d half_m, absl::FunctionRef<bool(RigidBody&)> visit) const;

  // The trees hold all that each awake body can touch. For assertions; linear in awake bodies.
  static bool Validate(std::span<RigidBody* const> awake);
  // The trees are whole. For tests; linear in all bodies.
  bool ValidateTrees() const { return trees_[0].Validate() && trees_[1].Validate(); }

 private:
  // A body whose bounds in the trees have changed since pairs were begun last.
  struct Noted {
    RigidBody* body;  // null: it has been removed
    Bounds before;    // bounds then; kNowhere if it was not there, or has changed again
  };
  // Where a leaf is in the list of noted ones, if it is there in this round.
  struct Note {
    std::uint64_t round = 0;
    std::uint32_t index = 0;
  };
  struct Meeting {
    RigidBody *a, *b;
  };
  static std::size_t TreeOf(const RigidBody& body) { return body.dynamic() ? 0 : 1; }
  Note& NoteOf(const RigidBody& body);
  void NoteChange(RigidBody& body, const Bounds& before);
  void FindMeetings(const Noted& noted, std::size_t index, std::vector<Meeting>* met) const;
  // Whether the trees hold too little of the body now.
  bool Predict(RigidBody& body, double dt_s) const;
  // Bounds for the trees, around the reach of a body that has left those it had.
  static Bounds Widened(const RigidBody& body);
  void Refit(RigidBody& body, const Bounds& before);

  Vec3d origin_;
  ThreadTeam& team_;
  std::vector<std::uint8_t> outgrown_;  // by awake_index: the body's reach has left its fat bounds
  std::vector<Bounds> before_;          // likewise, of those that have: the bounds that they left
  BoundsTree trees_[2];
  std::vector<Note> notes_[2];  // by leaf
  std::vector<Noted> noted_;
  std::vector<std::vector<Meeting>> met_;  // by chunk of noted bodies
  std::uint64_t round_ = 1;                // grows whenever pairs are begun
};

}  // namespace tessera::physics
