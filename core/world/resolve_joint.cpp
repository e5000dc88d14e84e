#include "core/world/resolve_joint.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"

namespace tessera {
namespace {

using JointKind = v1::Joint::KindCase;

// A whole turn, with room for a rounded pi.
constexpr double kTurn_rad = 6.2832, kHalfTurn_rad = 3.1416;

// Converts the parts of a joint; `field` is the path of a part.
struct Parts {
  Faults& faults;

  // If it is not `given`, the limit is `otherwise`.
  Limit LimitOf(const std::string& field, bool given, const v1::Limit& in, double reach, Limit otherwise = {}) {
    if (!given) return otherwise;
    const bool lower = faults.Range(field + ".lower", in.lower(), -reach, reach);
    if (!faults.Range(field + ".upper", in.upper(), -reach, reach) || !lower) return {};
    if (in.lower() > in.upper()) {
      faults.Add(absl::StrCat(field, ".lower must not exceed upper, got ", in.lower(), " and ", in.upper()));
    }
    return {in.lower(), in.upper()};
  }
  // `turns`: the limit is of an angle.
  Motor MotorOf(const std::string& field, const v1::Motor& in, bool turns) {
    const double fastest = turns ? kMaxAngularSpeed_rad_s : kMaxSpeed_m_s;
    faults.Range(field + ".target_velocity", in.target_velocity(), -fastest, fastest);
    faults.NotNegative(field + ".max_force", in.max_force(), kMaxForce);
    return {in.target_velocity(), in.max_force()};
  }
  Spring SpringOf(const std::string& field, const v1::Spring& in, double reach) {
    faults.NotNegative(field + ".stiffness", in.stiffness(), kMaxForce);
    faults.NotNegative(field + ".damping", in.damping(), kMaxForce);
    faults.Range(field + ".rest", in.rest(), -reach, reach);
    return {in.stiffness(), in.damping(), in.rest()};
  }

  SixDofJoint SixDof(const v1::Joint::SixDof& in) {
    SixDofJoint out;
    if (in.axes_size() > 6) faults.Add(absl::StrCat("six_dof.axes must be at most 6, got ", in.axes_size()));
    for (int i = 0; i < std::min(in.axes_size(), 6); ++i) {
      const auto& axis = in.axes(i);
      const std::string field = absl::StrCat("six_dof.axes[", i, "]");
      if (axis.free() && axis.has_limit()) faults.Add(field + " has a limit and is free");
      const Limit otherwise = axis.free() ? Limit{} : Limit{0, 0};
      const double reach = i < 3 ? kMaxExtent_m : kTurn_rad;
      const auto k = static_cast<std::size_t>(i);
      out.axes[k].limit = LimitOf(field + ".limit", axis.has_limit(), axis.limit(), reach, otherwise);
      out.axes[k].motor = MotorOf(field + ".motor", axis.motor(), i >= 3);
      out.axes[k].spring = SpringOf(field + ".spring", axis.spring(), reach);
    }
    return out;
  }
};

void SetKind(Faults& faults, const v1::Joint& in, JointDef& out) {
  Parts parts{faults};
  switch (in.kind_case()) {
    case JointKind::kPoint:
      out.kind = PointJoint{};
      break;
    case JointKind::kFixed:
      out.kind = FixedJoint{};
      break;
    case JointKind::kHinge:
      out.kind = HingeJoint{parts.LimitOf("hinge.limit", in.hinge().has_limit(), in.hinge().limit(), kTurn_rad),
                            parts.MotorOf("hinge.motor", in.hinge().motor(), true)};
      break;
    case JointKind::kSlider:
      out.kind = SliderJoint{parts.LimitOf("slider.limit", in.slider().has_limit(), in.slider().limit(), kMaxExtent_m),
                             parts.MotorOf("slider.motor", in.slider().motor(), false)};
      break;
    case JointKind::kConeTwist: {
      const auto& cone = in.cone_twist();
      faults.Range("cone_twist.swing_y", cone.swing_y(), 0, kHalfTurn_rad);
      faults.Range("cone_twist.swing_z", cone.swing_z(), 0, kHalfTurn_rad);
      faults.Range("cone_twist.twist", cone.twist(), 0, kHalfTurn_rad);
      out.kind = ConeTwistJoint{cone.swing_y(), cone.swing_z(), cone.twist()};
      break;
    }
    case JointKind::kSixDof:
      out.kind = parts.SixDof(in.six_dof());
      break;
    case JointKind::kUniversal: {
      const auto& universal = in.universal();
      out.kind =
          UniversalJoint{parts.LimitOf("universal.limit_a", universal.has_limit_a(), universal.limit_a(), kTurn_rad),
                         parts.LimitOf("universal.limit_b", universal.has_limit_b(), universal.limit_b(), kTurn_rad)};
      break;
    }
    case JointKind::kHinge2: {
      const auto& wheel = in.hinge2();
      out.kind = Hinge2Joint{parts.LimitOf("hinge2.steering", wheel.has_steering(), wheel.steering(), kTurn_rad),
                             parts.SpringOf("hinge2.suspension", wheel.suspension(), kMaxExtent_m),
                             parts.MotorOf("hinge2.drive", wheel.drive(), true)};
      break;
    }
    case JointKind::kGear:
      if (in.gear().ratio() == 0) {
        faults.Add("gear.ratio must not be 0");
      } else if (faults.Range("gear.ratio", in.gear().ratio(), -kMaxGearRatio, kMaxGearRatio) &&
                 std::abs(in.gear().ratio()) < kMinGearRatio) {
        faults.Add(absl::StrCat("gear.ratio must be at least ", kMinGearRatio, " either way, got ", in.gear().ratio()));
      }
      if (in.body_b() == 0) faults.Add("body_b is missing: a gear needs two bodies");
      out.kind = GearJoint{in.gear().ratio()};
      break;
    case JointKind::KIND_NOT_SET:
      faults.Add(
          "its kind is missing: give one of point, fixed, hinge, slider, cone_twist, six_dof, universal, hinge2, gear");
      break;
  }
}

}  // namespace

JointDef ResolveJoint(Faults& faults, const v1::Joint& in) {
  JointDef out;
  out.id = JointId(in.id());
  out.body_a = BodyId(in.body_a());
  out.body_b = BodyId(in.body_b());
  out.frame_a = faults.Normalised("frame_a", in.frame_a(), kMaxExtent_m);
  out.frame_b = faults.Normalised("frame_b", in.frame_b(), in.body_b() == 0 ? kMaxCoordinate_m : kMaxExtent_m);
  out.bodies_collide = in.bodies_collide();
  SetKind(faults, in, out);
  return out;
}

}  // namespace tessera
