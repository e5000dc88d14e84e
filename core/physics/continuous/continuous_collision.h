// ContinuousCollision: nothing passes through anything unseen.
//
// Contacts were found along the predicted motion of each body. A body that is fast, and was deflected or meets one that
// was, is swept along the motion that it made, and stopped where it meets something; the next step finds the contact
// there.
//
//   candidates -> sweeps -> stops, of whole jointed groups -> moved back and rejoined -> carried on -> turning kept
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/awake_joints.h"
#include "core/physics/broad_phase.h"
#include "core/physics/continuous/stops.h"
#include "core/physics/islands.h"
#include "core/physics/pair_table.h"

namespace tessera::physics {

struct ContinuousInput {
  double dt_s;
  std::span<RigidBody* const> awake;
  const AwakeJoints& joints;
  const JointedGroups& groups;
};

class ContinuousCollision {
 public:
  // Changes the motions, by awake_index, of bodies that are stopped. Asks the broad phase what is in the way of a
  // deflected body, and begins pairs with that.
  void Run(const ContinuousInput& in, BroadPhase& broad_phase, PairTable& pairs, std::span<BodyMotion> motions);
  // Forgets the last step.
  void Clear();

  // Pairs with a trigger that met within the step, though they may be apart at its end. A pair may be listed twice.
  std::span<Pair* const> crossed() const { return crossed_; }
  // Impulses that pairs got because one body was stopped at the other; in no order.
  std::span<const PairImpulse> impulses() const { return impulses_; }
  // Bodies that were stopped, ascending by id.
  std::span<const Stop> stops() const { return stops_; }

  // For assertions; linear in stops.
  bool Validate(std::span<RigidBody* const> awake) const;

 private:
  void FindCandidates(const ContinuousInput& in, std::span<const BodyMotion> motions);
  void BeginPairs(RigidBody& body, const Bounds& swept, BroadPhase& broad_phase, PairTable& pairs);
  void Sweep(RigidBody& body, std::span<const BodyMotion> motions);
  void StopBodies(const ContinuousInput& in, BroadPhase& broad_phase, std::span<BodyMotion> motions);

  std::vector<std::uint8_t> deflected_;    // by awake_index: the body was pushed off its predicted motion
  std::vector<std::uint32_t> candidates_;  // awake_index of bodies to sweep, ascending
  std::vector<RigidBody*> nearby_;
  std::vector<Stop> stops_;
  std::vector<Pair*> crossed_;
  std::vector<PairImpulse> impulses_;
};

}  // namespace tessera::physics
