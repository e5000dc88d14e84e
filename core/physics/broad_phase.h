// BroadPhase: which bodies' bounds overlap, by Bullet's pair of dynamic trees.
//
// Each step it predicts how every awake body moves, bounds that motion, and begins a pair in the pair table where two
// bounds come to overlap. Bullet asks a cache to keep every pair and walks all of it in each step; here the trees
// report a pair once, when it begins, and the pair table keeps it. So a body that sleeps costs nothing.
//
// Thread rule: one thread at a time, which leads the team; Bullet's trees are for that thread alone.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
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

  // The body of a proxy in the trees.
  static RigidBody& BodyOf(const btBroadphaseProxy& proxy);

  // The trees hold all that each awake body can touch. For assertions; linear in awake bodies.
  static bool Validate(std::span<RigidBody* const> awake);

 private:
  // Two bodies whose bounds overlap, at least one of them dynamic.
  struct Meeting {
    std::uint64_t key;  // as PairTable has it
    const btBroadphaseProxy *a, *b;
  };
  // Bullet's trees report overlaps to their pair cache, which is this.
  struct Sink : btNullPairCache {
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override;
    std::vector<Meeting> met;
  };
  // Whether the trees hold too little of the body now.
  bool Predict(RigidBody& body, double dt_s) const;
  void Refit(RigidBody& body);
  void UpdateTrees(RigidBody& body);

  Vec3d origin_;
  ThreadTeam& team_;
  std::vector<std::uint8_t> outgrown_;  // by awake_index: the body's reach has left its fat bounds
  Sink sink_;                           // Pairs that may have begun; a pair may be in there again. Order means nothing.
  btDbvtBroadphase trees_;
  std::uint64_t passes_ = 0;
};

}  // namespace tessera::physics
