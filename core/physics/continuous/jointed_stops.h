// JointedStops: jointed bodies that a sweep stopped stop together, and their joints stay closed.
//
// A link that is held back alone tears its joints open, so everything that joints connect to a stopped body stops at
// the same share of its motion. Bodies that turn go along arcs, and were moved back along their chords; so from what
// holds still, or from the body that was stopped first, one after the other is put where its joint has it.
//
//   JointedStops jointed(awake, joints, groups);
//   jointed.Spread(&stops);
//   jointed.NoteGaps(stops, motions);   // before any body is moved back
//   MoveBack(awake, stops, motions);
//   jointed.Rejoin(motions);
#pragma once

#include <span>
#include <vector>

#include "core/physics/awake_joints.h"
#include "core/physics/continuous/stops.h"
#include "core/physics/islands.h"

namespace tessera::physics {

class JointedStops {
 public:
  JointedStops(std::span<RigidBody* const> awake, const AwakeJoints& joints, const JointedGroups& groups)
      : awake_(awake), joints_(joints), groups_(groups) {}

  // Stops all bodies of each jointed group at the share at which the first of them is stopped. Afterwards the stops are
  // to be sorted again.
  void Spread(std::vector<Stop>* stops);
  // Notes how far apart the two ends of each joint of stopped bodies are to be.
  void NoteGaps(std::span<const Stop> stops, std::span<const BodyMotion> motions);
  // Puts the ends together.
  void Rejoin(std::span<BodyMotion> motions);

 private:
  // A joint of stopped bodies. A null body stands for what does not move: the world, or something static.
  struct StoppedJoint {
    RigidBody *a = nullptr, *b = nullptr;
    Vec3d arm_a, arm_b;            // from each centre to its end of the joint, as the bodies lay at the start
    Vec3d anchor_a, anchor_b;      // the ends at the start, in the world
    Vec3d start_gap_m, end_gap_m;  // from a's end to b's, as seen from a: at the start, and had nothing stopped it
    double share = 1;              // share of the step that its bodies move

    // Where a's and b's ends are after these motions, and the gap that there is to be between them.
    Vec3d EndA(std::span<const BodyMotion> motions) const;
    Vec3d EndB(std::span<const BodyMotion> motions) const;
    Vec3d Gap(std::span<const BodyMotion> motions) const;
  };
  struct Groups;

  Groups FirstStops(std::span<const Stop> stops) const;

  std::span<RigidBody* const> awake_;
  const AwakeJoints& joints_;
  const JointedGroups& groups_;
  // By awake_index. One body of each group stays where its sweep ended: the one that was stopped first, and none in a
  // group that hangs on something that holds still.
  std::vector<bool> placed_;
  // By awake_index: there is more than one way along joints from one body of the group, or from what holds still, to
  // another.
  std::vector<bool> ring_;
  std::vector<StoppedJoint> held_;  // ascending by id
};

}  // namespace tessera::physics
