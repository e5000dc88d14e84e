#include "core/physics/joints.h"

#include <BulletDynamics/ConstraintSolver/btConeTwistConstraint.h>
#include <BulletDynamics/ConstraintSolver/btGearConstraint.h>
#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpring2Constraint.h>
#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>

#include <algorithm>
#include <array>

#include "core/physics/bullet_math.h"

namespace tessera::physics {
namespace {

using SixDof = btGeneric6DofSpring2Constraint;
using Axes = std::array<SixDofAxis, 6>;

const Limit kFree{1, -1};
const SixDofAxis kFreeAxis{.limit = kFree, .motor = {}, .spring = {}};

// Each joint with up to six axes of freedom, said as six axes: linear x, y, z, angular x, y, z; locked unless set.
Axes AxesOf(const FixedJoint&) { return {}; }
Axes AxesOf(const SixDofJoint& joint) { return joint.axes; }
Axes AxesOf(const HingeJoint& joint) {
  Axes axes;
  axes[5] = {.limit = joint.limit_rad, .motor = joint.motor, .spring = {}};
  return axes;
}
Axes AxesOf(const SliderJoint& joint) {
  Axes axes;
  axes[0] = {.limit = joint.limit_m, .motor = joint.motor, .spring = {}};
  return axes;
}
// Bullet's angles turn about a's z first, then about the new y, then about b's x.
Axes AxesOf(const UniversalJoint& joint) {
  Axes axes;
  axes[5].limit = joint.limit_a_rad;
  axes[4].limit = joint.limit_b_rad;
  return axes;
}
Axes AxesOf(const Hinge2Joint& joint) {
  Axes axes;
  axes[2] = {.limit = kFree, .motor = {}, .spring = joint.suspension};
  axes[3] = {.limit = kFree, .motor = joint.drive, .spring = {}};
  axes[5].limit = joint.steering_rad;
  return axes;
}

// Bullet counts angles of a against b, and velocities of either kind too.
void SetAxis(SixDof& constraint, int index, const SixDofAxis& axis) {
  const bool angular = index >= 3;
  const auto lower = static_cast<btScalar>(angular ? -axis.limit.upper : axis.limit.lower);
  const auto upper = static_cast<btScalar>(angular ? -axis.limit.lower : axis.limit.upper);
  if (axis.limit.free()) {
    constraint.setLimit(index, 1, -1);
  } else if (angular) {
    // Not by setLimit, which takes a whole turn for none.
    constraint.getRotationalLimitMotor(index - 3)->m_loLimit = lower;
    constraint.getRotationalLimitMotor(index - 3)->m_hiLimit = upper;
  } else {
    constraint.setLimit(index, lower, upper);
  }
  if (axis.motor.max_force > 0) {
    constraint.enableMotor(index, true);
    constraint.setTargetVelocity(index, static_cast<btScalar>(-axis.motor.target_velocity));
    constraint.setMaxMotorForce(index, static_cast<btScalar>(axis.motor.max_force));
  }
  if (axis.spring.stiffness > 0) {
    constraint.enableSpring(index, true);
    constraint.setStiffness(index, static_cast<btScalar>(axis.spring.stiffness), false);
    constraint.setDamping(index, static_cast<btScalar>(axis.spring.damping), true);
    constraint.setEquilibriumPoint(index, static_cast<btScalar>(angular ? -axis.spring.rest : axis.spring.rest));
  }
}

// What a spring between the two has to move: their reduced mass, or for a turn the least it can be.
double MovedBySpring(int axis, const Body& a, const Body* b) {
  const auto inverse = [axis](const Body* body) {
    if (body == nullptr || !body->dynamic()) return 0.0;
    if (axis < 3) return 1 / body->mass_kg();
    const Vec3d inertia = body->inertia();
    return 1 / std::min({inertia.x, inertia.y, inertia.z});
  };
  const double sum = inverse(&a) + inverse(b);
  return sum > 0 ? 1 / sum : 0;
}

// The two sides as Bullet gets them.
struct Sides {
  btRigidBody &a, &b;
  btTransform frame_a, frame_b;
};

std::unique_ptr<btTypedConstraint> Make(const PointJoint&, Sides& s) {
  return std::make_unique<btPoint2PointConstraint>(s.a, s.b, s.frame_a.getOrigin(), s.frame_b.getOrigin());
}

std::unique_ptr<btTypedConstraint> Make(const ConeTwistJoint& joint, Sides& s) {
  auto constraint = std::make_unique<btConeTwistConstraint>(s.a, s.b, s.frame_a, s.frame_b);
  constraint->setLimit(static_cast<btScalar>(joint.swing_z_rad), static_cast<btScalar>(joint.swing_y_rad),
                       static_cast<btScalar>(joint.twist_rad));
  return constraint;
}

// Bullet: w_a + ratio' w_b = 0; ours: ratio w_a + w_b = 0.
std::unique_ptr<btTypedConstraint> Make(const GearJoint& joint, Sides& s) {
  return std::make_unique<btGearConstraint>(s.a, s.b, s.frame_a.getBasis().getColumn(2),
                                            s.frame_b.getBasis().getColumn(2), static_cast<btScalar>(1 / joint.ratio));
}

std::unique_ptr<btTypedConstraint> Make(const auto& joint, Sides& s) {
  auto constraint = std::make_unique<SixDof>(s.a, s.b, s.frame_a, s.frame_b, RO_XYZ);
  const Axes axes = AxesOf(joint);
  for (int i = 0; i < 6; ++i) SetAxis(*constraint, i, axes[static_cast<std::size_t>(i)]);
  return constraint;
}

}  // namespace

Joint::Joint(const JointDef& def, Body& a, Body* b, btRigidBody& world, Vec3d origin)
    : id_(def.id), body_a_(def.body_a), body_b_(def.body_b), bodies_collide_(def.bodies_collide) {
  const btTransform frame_a = a.LocalFrame(def.frame_a);
  const btTransform frame_b = b != nullptr ? b->LocalFrame(def.frame_b)
                                           : ToBullet(Pose{def.frame_b.position - origin, def.frame_b.orientation});
  Sides sides =
      b != nullptr ? Sides{a.bullet(), b->bullet(), frame_a, frame_b} : Sides{world, a.bullet(), frame_b, frame_a};
  constraint_ = std::visit([&](const auto& kind) { return Make(kind, sides); }, def.kind);
  const auto note_springs = [&](const Axes& axes) {
    for (int i = 0; i < 6; ++i) {
      const double stiffness = axes[static_cast<std::size_t>(i)].spring.stiffness;
      if (stiffness > 0) springs_.push_back({i, stiffness, MovedBySpring(i, a, b)});
    }
  };
  if (const auto* six = std::get_if<SixDofJoint>(&def.kind)) note_springs(AxesOf(*six));
  if (const auto* wheel = std::get_if<Hinge2Joint>(&def.kind)) note_springs(AxesOf(*wheel));
}

void Joint::Tune(double dt_s) {
  for (const Stiff& spring : springs_) {
    const double stiffest = spring.mass / (dt_s * dt_s);
    static_cast<SixDof&>(*constraint_)
        .setStiffness(spring.axis, static_cast<btScalar>(std::min(spring.stiffness, stiffest)), false);
  }
}

}  // namespace tessera::physics
