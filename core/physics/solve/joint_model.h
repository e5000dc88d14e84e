// JointModel: a joint of a scene, which makes its rows in each step.
//
// Positions and velocities along a joint's axes are those of body_b against body_a, and the axes are those of frame_a.
// In a joint to the world, the world takes the part of body_a: "turn at 2 rad/s" turns the body by +2.
//
// Angles of three axes are b = a Rz(z) Ry(y) Rx(x). Where two axes are locked the third is the hinge's, -pi to pi, or
// the turn of the same pose that lies nearest to the middle of its limits; limits so wide that this would jump from one
// stop to the other make the joint count its turns.
//
//   JointModel model(def, frame_in_a, frame_in_b);
//   model.MakeRows(placement_a, placement_b, &rows);   // each step
//
// Thread rule: one thread at a time.
#pragma once

#include <array>

#include "core/physics/collide/collide.h"
#include "core/physics/solve/joint_angles.h"
#include "core/physics/solve/rows.h"
#include "core/world/scene.h"

namespace tessera::physics {

class JointModel {
 public:
  // Frames are in the coordinates of the bodies (centre of mass, principal axes); `frame_a` of a joint to the world is
  // in world space, and its placement the identity.
  JointModel(const JointDef& def, const Pose& frame_a, const Pose& frame_b);

  void MakeRows(const Placement& a, const Placement& b, JointRows* rows);

  // Impulses of the last substep by slot, N s or N m s, with which the next step starts.
  std::array<float, kJointSlots> impulses{};

 private:
  enum class Form : std::uint8_t { kPoint, kConeTwist, kGear, kSixAxes };
  struct Sides;

  void HoldAngles();
  double Counted(std::size_t k, double angle);
  void PointRows(const Sides& sides, JointRows* rows) const;
  void ConeTwistRows(const Sides& sides, JointRows* rows) const;
  void GearRow(const Sides& sides, JointRows* rows) const;
  void LinearRows(const Sides& sides, bool locked, JointRows* rows) const;
  void AngularRows(const Sides& sides, JointRows* rows);
  JointAngles Angles(const Sides& sides) const;

  Form form_ = Form::kPoint;
  bool to_world_ = false;
  std::array<SixDofAxis, 6> axes_;  // used by kSixAxes
  ConeTwistJoint cone_;
  double ratio_ = 1;
  Pose frame_a_, frame_b_;
  Quatd turn_a_, turn_b_;               // from the given frames to those whose angles about locked axes are held at 0
  std::array<bool, 3> counts_{};        // about x, y, z: turns are counted
  std::array<double, 3> turned_rad_{};  // angles at the last step, where turns are counted
  bool turned_known_ = false;           // If false, the first step takes the angle nearest to the middle of the limits.
};

}  // namespace tessera::physics
