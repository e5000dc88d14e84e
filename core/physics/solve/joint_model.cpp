#include "core/physics/solve/joint_model.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

// If the two stops are nearer than this on the far side of the circle, rad, one could be taken for the other.
constexpr double kFarSide_rad = 0.5;
// Both stops get a row where they are nearer together than this, m or rad: a step may reach either.
constexpr double kNarrow = 0.2;
// A swing or twist with a smaller limit than the first is locked, rad; one beyond the second, nearly a half turn, is
// free.
constexpr double kLockedSwing_rad = 0.01, kFreeSwing_rad = 3.14;
// Nearer to the middle of a cone than this share of its opening there is no direction to its border.
constexpr double kMiddleOfCone = 1e-3;

constexpr Limit kFree{1, -1};
using Axes = std::array<SixDofAxis, 6>;

// The six axes of a joint: linear x, y, z, angular x, y, z. An axis that is not set is locked.
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

bool Locked(const SixDofAxis& axis) { return axis.limit.lower == axis.limit.upper; }
bool Idle(const SixDofAxis& axis) {
  return axis.limit.free() && axis.motor.max_force <= 0 && axis.spring.stiffness <= 0;
}

// Each axis has four of the joint's stored impulses.
enum SlotOf : std::uint8_t { kLockOrMotor = 0, kSpringSlot = 1, kLower = 2, kUpper = 3 };
std::uint8_t Slot(std::size_t axis, SlotOf which) { return static_cast<std::uint8_t>(4 * axis + which); }

Vec3d AxisOf(std::size_t k) { return {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0}; }

// A distance or angle along an axis, and how it changes with the velocities.
struct Measure {
  double value = 0;
  Vec3d linear, angular_a, angular_b;
};
Measure Of(const JointAngle& angle) { return {angle.value, {}, angle.gradient, angle.gradient}; }
Measure Less(const Measure& m, double from) { return {m.value - from, m.linear, m.angular_a, m.angular_b}; }
Measure Reversed(const Measure& m) { return {-m.value, -m.linear, -m.angular_a, -m.angular_b}; }

Row* Add(RowKind kind, const Measure& measure, std::uint8_t slot, JointRows* rows) {
  assert(rows->count < kJointRows);
  Row& row = rows->rows[static_cast<std::size_t>(rows->count++)];
  row = Row{.linear = Vec3f(measure.linear),
            .angular_a = Vec3f(measure.angular_a),
            .angular_b = Vec3f(measure.angular_b),
            .kind = kind,
            .error = static_cast<float>(measure.value),
            .slot = slot};
  return &row;
}

// Adds stops at both ends, or only the nearer one where the other is out of reach, or where there is no room for both.
void AddLimit(const Measure& measure, Limit limit, bool both, std::size_t axis, JointRows* rows) {
  const bool upper_nearer = limit.upper - measure.value < measure.value - limit.lower;
  both = both && limit.upper - limit.lower < kNarrow;
  if (both || !upper_nearer) Add(RowKind::kLimit, Less(measure, limit.lower), Slot(axis, kLower), rows);
  if (both || upper_nearer) {
    Add(RowKind::kLimit, Reversed(Less(measure, limit.upper)), Slot(axis, kUpper), rows);
  }
}

// Adds the rows of an axis that is not locked. `from_rest` is how far the spring is bent.
void AddFreeAxis(const SixDofAxis& spec, const Measure& measure, double from_rest, std::size_t axis, JointRows* rows) {
  const bool motor = spec.motor.max_force > 0, spring = spec.spring.stiffness > 0;
  if (motor) {
    Row* row = Add(RowKind::kMotor, measure, Slot(axis, kLockOrMotor), rows);
    row->error = 0;
    row->target_velocity = static_cast<float>(spec.motor.target_velocity);
    row->max_force = static_cast<float>(spec.motor.max_force);
  }
  if (spring) {
    Row* row = Add(RowKind::kSpring, measure, Slot(axis, kSpringSlot), rows);
    row->error = static_cast<float>(from_rest);
    row->stiffness = static_cast<float>(spec.spring.stiffness);
    row->damping = static_cast<float>(spec.spring.damping);
  }
  if (!spec.limit.free()) AddLimit(measure, spec.limit, !(motor && spring), axis, rows);
}

// The angle of the same pose that is nearest to another.
double NearestTurn(double angle, double to) {
  return angle + 2 * std::numbers::pi * std::round((to - angle) / (2 * std::numbers::pi));
}

}  // namespace

// The frames where the bodies are now. Positions are relative to the bodies' centres, so nothing is lost far from the
// origin.
struct JointModel::Sides {
  Sides(const Placement& body_a, const Placement& body_b, const Pose& frame_a, const Pose& frame_b)
      : q_a(body_a.orientation * frame_a.orientation),
        q_b(body_b.orientation * frame_b.orientation),
        arm_a(Rotate(body_a.orientation, frame_a.position)),
        arm_b(Rotate(body_b.orientation, frame_b.position)),
        apart((body_b.position - body_a.position) - arm_a + arm_b) {}

  // The distance along an axis that turns with a.
  Measure Along(Vec3d axis) const { return {Dot(axis, apart), axis, Cross(arm_a + apart, axis), Cross(arm_b, axis)}; }
  // The distance along an axis that stands still in the world, for distances that are to vanish.
  Measure AlongFixed(Vec3d axis) const { return {Dot(axis, apart), axis, Cross(arm_a, axis), Cross(arm_b, axis)}; }

  Quatd q_a, q_b;
  Vec3d arm_a, arm_b;  // from each centre of mass to its frame, world axes
  Vec3d apart;         // from a's frame to b's
};

JointModel::JointModel(const JointDef& def, const Pose& frame_a, const Pose& frame_b)
    : to_world_(def.body_b == BodyId()),
      frame_a_{frame_a.position, Normalized(frame_a.orientation)},
      frame_b_{frame_b.position, Normalized(frame_b.orientation)} {
  if (const auto* cone = std::get_if<ConeTwistJoint>(&def.kind)) {
    form_ = Form::kConeTwist;
    cone_ = *cone;
  } else if (const auto* gear = std::get_if<GearJoint>(&def.kind)) {
    form_ = Form::kGear;
    ratio_ = gear->ratio;
  } else if (!std::holds_alternative<PointJoint>(def.kind)) {
    form_ = Form::kSixAxes;
    axes_ = std::visit(
        [](const auto& kind) {
          if constexpr (requires { AxesOf(kind); }) return AxesOf(kind);
          return Axes{};
        },
        def.kind);
    HoldAngles();
  }
}

// Turns the frames so that locked angles are 0, and decides which angles are counted.
void JointModel::HoldAngles() {
  const SixDofAxis &x = axes_[3], &y = axes_[4], &z = axes_[5];
  if (Locked(z)) turn_a_ = TurnBy({0, 0, z.limit.lower});
  if (Locked(x)) turn_b_ = TurnBy({-x.limit.lower, 0, 0});
  if (Locked(y) && Locked(z)) {
    turn_a_ = turn_a_ * TurnBy({0, y.limit.lower, 0});
  } else if (Locked(y) && Locked(x)) {
    turn_b_ = turn_b_ * TurnBy({0, -y.limit.lower, 0});
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const Limit& limit = axes_[3 + k].limit;
    counts_[k] = !limit.free() && (limit.upper - limit.lower) / 2 > std::numbers::pi - kFarSide_rad;
  }
}

double JointModel::Counted(std::size_t k, double angle) {
  const Limit& limit = axes_[3 + k].limit;
  if (limit.free()) return angle;
  const double middle = (limit.lower + limit.upper) / 2;
  if (!counts_[k]) return NearestTurn(angle, middle);
  turned_rad_[k] = NearestTurn(angle, turned_known_ ? turned_rad_[k] : middle);
  return turned_rad_[k];
}

void JointModel::MakeRows(const Placement& a, const Placement& b, JointRows* rows) {
  rows->count = 0;
  const Sides sides(a, b, frame_a_, frame_b_);
  rows->arm_a = to_world_ ? Vec3f() : Vec3f(sides.arm_a);
  rows->arm_b = Vec3f(sides.arm_b);
  rows->gap = Vec3f(sides.apart);
  switch (form_) {
    case Form::kPoint:
      PointRows(sides, rows);
      break;
    case Form::kConeTwist:
      PointRows(sides, rows);
      ConeTwistRows(sides, rows);
      break;
    case Form::kGear:
      GearRow(sides, rows);
      break;
    case Form::kSixAxes:
      LinearRows(sides, true, rows);
      AngularRows(sides, rows);
      LinearRows(sides, false, rows);
      break;
  }
  if (!to_world_) return;
  for (int i = 0; i < rows->count; ++i) rows->rows[static_cast<std::size_t>(i)].angular_a = {};
}

void JointModel::PointRows(const Sides& sides, JointRows* rows) const {
  for (std::size_t k = 0; k < 3; ++k) {
    Add(RowKind::kLocked, sides.AlongFixed(AxisOf(k)), Slot(k, kLockOrMotor), rows);
  }
}

// A gear holds velocities alone: if its teeth slip, they stay slipped.
void JointModel::GearRow(const Sides& sides, JointRows* rows) const {
  const Vec3d axis_a = Rotate(sides.q_a, Vec3d{0, 0, 1}), axis_b = Rotate(sides.q_b, Vec3d{0, 0, 1});
  Add(RowKind::kLocked, {0, {}, axis_a * -ratio_, axis_b}, Slot(5, kLockOrMotor), rows);
}

void JointModel::LinearRows(const Sides& sides, bool locked, JointRows* rows) const {
  const auto held = [this](std::size_t k) { return Locked(axes_[k]) && axes_[k].limit.lower == 0; };
  if (held(0) && held(1) && held(2)) {
    if (locked) PointRows(sides, rows);
    return;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const SixDofAxis& spec = axes_[k];
    if (Locked(spec) != locked || Idle(spec)) continue;
    const Measure measure = sides.Along(Rotate(sides.q_a, AxisOf(k)));
    if (locked) {
      Add(RowKind::kLocked, Less(measure, spec.limit.lower), Slot(k, kLockOrMotor), rows);
    } else {
      AddFreeAxis(spec, measure, measure.value - spec.spring.rest, k, rows);
    }
  }
}

JointAngles JointModel::Angles(const Sides& sides) const {
  const FramePair frames(sides.q_a * turn_a_, sides.q_b * turn_b_);
  const bool x = Locked(axes_[3]), y = Locked(axes_[4]), z = Locked(axes_[5]);
  if (x && y && z) return RotationAngles(frames);
  if (x && y) return HingeAngles(frames, 2);
  if (x && z) return HingeAngles(frames, 1);
  if (y && z) return HingeAngles(frames, 0);
  if (x) return EulerAnglesWithoutX(frames);
  if (z) return EulerAnglesWithoutZ(frames);
  JointAngles angles = EulerAngles(frames);
  if (y) angles[1].value -= axes_[4].limit.lower;
  return angles;
}

void JointModel::AngularRows(const Sides& sides, JointRows* rows) {
  if (Idle(axes_[3]) && Idle(axes_[4]) && Idle(axes_[5])) return;
  const JointAngles angles = Angles(sides);
  for (std::size_t k = 0; k < 3; ++k) {
    if (Locked(axes_[3 + k])) Add(RowKind::kLocked, Of(angles[k]), Slot(3 + k, kLockOrMotor), rows);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const SixDofAxis& spec = axes_[3 + k];
    if (Locked(spec) || Idle(spec)) continue;
    Measure measure = Of(angles[k]);
    measure.value = Counted(k, measure.value);
    const double bent = measure.value - spec.spring.rest;
    AddFreeAxis(spec, measure, counts_[k] ? bent : NearestTurn(bent, 0), 3 + k, rows);
  }
  turned_known_ = true;
}

namespace {

// Adds the limit of a swing about one axis, or of the twist, to `half` rad on either side.
void AddSwing(const JointAngle& angle, double half, std::size_t axis, JointRows* rows) {
  if (half >= kFreeSwing_rad) return;
  if (half <= kLockedSwing_rad) {
    Add(RowKind::kLocked, Of(angle), Slot(axis, kLockOrMotor), rows);
  } else {
    AddLimit(Of(angle), {-half, half}, true, axis, rows);
  }
}

// Adds the border of the ellipse in the direction of the swing. The distance left is (1 - rho) times the lesser half
// angle, where rho^2 = (y / half_y)^2 + (z / half_z)^2; that scale does not move the border.
void AddCone(const SwingTwist& swing, double half_y, double half_z, JointRows* rows) {
  const double y = swing.swing_y.value / half_y, z = swing.swing_z.value / half_z;
  const double rho = std::sqrt(y * y + z * z), scale = std::min(half_y, half_z);
  if (rho < kMiddleOfCone) return;
  const Vec3d outward = swing.swing_y.gradient * (y / (rho * half_y)) + swing.swing_z.gradient * (z / (rho * half_z));
  Add(RowKind::kLimit, Of({scale * (1 - rho), outward * -scale}), Slot(4, kUpper), rows);
}

}  // namespace

void JointModel::ConeTwistRows(const Sides& sides, JointRows* rows) const {
  const SwingTwist swing = SwingTwistOf(FramePair(sides.q_a, sides.q_b));
  const auto locked = [](double half) { return half <= kLockedSwing_rad; };
  const auto open = [&](double half) { return !locked(half) && half < kFreeSwing_rad; };
  const bool cone = open(cone_.swing_y_rad) && open(cone_.swing_z_rad);
  // Locked rows come first.
  if (locked(cone_.twist_rad)) AddSwing(swing.twist, cone_.twist_rad, 3, rows);
  if (locked(cone_.swing_y_rad)) AddSwing(swing.swing_y, cone_.swing_y_rad, 4, rows);
  if (locked(cone_.swing_z_rad)) AddSwing(swing.swing_z, cone_.swing_z_rad, 5, rows);
  if (cone) AddCone(swing, cone_.swing_y_rad, cone_.swing_z_rad, rows);
  if (!cone && open(cone_.swing_y_rad)) AddSwing(swing.swing_y, cone_.swing_y_rad, 4, rows);
  if (!cone && open(cone_.swing_z_rad)) AddSwing(swing.swing_z, cone_.swing_z_rad, 5, rows);
  if (open(cone_.twist_rad)) AddSwing(swing.twist, cone_.twist_rad, 3, rows);
}

}  // namespace tessera::physics
