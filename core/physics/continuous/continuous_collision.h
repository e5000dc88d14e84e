// ContinuousCollision: nothing passes through anything unseen.
//
// Contacts were found along the predicted motion of each body. A body that is fast, and was deflected or meets one that
// was, is swept along the motion that it made, and stopped where it meets something; the next step finds the contact
// there.
//
//   candidates -> sweeps -> stops, of whole jointed groups -> moved back and rejoined -> carried on -> turning kept
//
// Thread rule: one thread at a time, which leads the team.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/awake_joints.h"
#include "core/physics/broad_phase.h"
#include "core/physics/continuous/stops.h"
#include "core/physics/islands.h"
#include "core/physics/pair_table.h"
#include "core/physics/thread_team.h"

namespace tessera::physics {

struct ContinuousInput {
  double dt_s;
  std::span<RigidBody* const> awake;
  const AwakeJoints& joints;
  const JointedGroups& groups;
};

class ContinuousCollision {
 public:
  explicit ContinuousCollision(ThreadTeam& team = ThreadTeam::Alone()) : team_(team) {}

  // Changes the motions, by awake_index, of bodies that are stopped. Asks the broad phase what is in the way of a
  // deflected body, and begins pairs with that.
  void Run(const ContinuousInput& in, BroadPhase& broad_phase, PairTable& pairs, std::span<BodyMotion> motions);
  // Forgets the last step.
  void Clear();

  // Pairs with a trigger that met within the step, though they may be apart at its end.
  std::span<Pair* const> crossed() const { return crossed_; }
  // Impulses that pairs got because one body was stopped at the other; in no order.
  std::span<const PairImpulse> impulses() const { return impulses_; }
  // Bodies that were stopped, ascending by id.
  std::span<const Stop> stops() const { return stops_; }

  // For assertions; linear in stops.
  bool Validate(std::span<RigidBody* const> awake) const;

 private:
  // The outcome of a sweep of one pair.
  struct Encounter {
    std::size_t candidate;  // place in the list of the body that was swept
    Pair* crossed;          // a pair with a trigger; null: the stop holds
    Stop stop;
  };
  void FindCandidates(const ContinuousInput& in, std::span<const BodyMotion> motions);
  bool IsCandidate(const RigidBody& body) const;
  void BeginPairs(RigidBody& body, const Bounds& swept, BroadPhase& broad_phase, PairTable& pairs);
  void SweepKnownPairs(std::span<RigidBody* const> awake, std::span<const BodyMotion> motions);
  void Sweep(std::size_t candidate, RigidBody& body, const PairEnd& end, std::span<const BodyMotion> motions,
             std::vector<Encounter>* encounters) const;
  void Take(const Encounter& encounter);
  void StopBodies(const ContinuousInput& in, BroadPhase& broad_phase, std::span<BodyMotion> motions);

  ThreadTeam& team_;
  // By awake_index: the body was pushed off its predicted motion; it is to be swept.
  std::vector<std::uint8_t> deflected_, suspect_;
  std::vector<std::uint32_t> candidates_;           // awake_index of bodies to sweep, ascending
  std::vector<std::vector<Encounter>> encounters_;  // by chunk of candidates
  std::vector<Encounter> late_;                     // with bodies in the way of a deflected one
  std::vector<RigidBody*> nearby_;
  std::vector<Stop> stops_;
  std::vector<Pair*> crossed_;
  std::vector<PairImpulse> impulses_;
};

}  // namespace tessera::physics
