// The packed form of joints.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <type_traits>
#include <variant>

#include "core/world/packed_io.h"
#include "core/world/scene.h"

namespace tessera::packed {

// Limits and springs of lengths and angles alike.
template <class Io, class T>
void LimitOf(Io& io, T& limit) {
  io.Real("limit", limit.lower, -kMaxExtent_m, kMaxExtent_m);
  io.Real("limit", limit.upper, -kMaxExtent_m, kMaxExtent_m);
}
template <class Io, class T>
void MotorOf(Io& io, T& motor) {
  io.Real("motor.target_velocity", motor.target_velocity, -kMaxSpeed_m_s, kMaxSpeed_m_s);
  io.Real("motor.max_force", motor.max_force, 0, kMaxForce);
}
template <class Io, class T>
void SpringOf(Io& io, T& spring) {
  io.Real("spring.stiffness", spring.stiffness, 0, kMaxForce);
  io.Real("spring.damping", spring.damping, 0, kMaxForce);
  io.Real("spring.rest", spring.rest, -kMaxExtent_m, kMaxExtent_m);
}

template <class Io, class K>
void KindOf(Io& io, K& kind) {
  using T = std::remove_const_t<K>;
  if constexpr (std::is_same_v<T, HingeJoint>) {
    LimitOf(io, kind.limit_rad);
    MotorOf(io, kind.motor);
  } else if constexpr (std::is_same_v<T, SliderJoint>) {
    LimitOf(io, kind.limit_m);
    MotorOf(io, kind.motor);
  } else if constexpr (std::is_same_v<T, ConeTwistJoint>) {
    io.Real("swing_y_rad", kind.swing_y_rad, 0, 4);
    io.Real("swing_z_rad", kind.swing_z_rad, 0, 4);
    io.Real("twist_rad", kind.twist_rad, 0, 4);
  } else if constexpr (std::is_same_v<T, SixDofJoint>) {
    for (auto& axis : kind.axes) {
      LimitOf(io, axis.limit);
      MotorOf(io, axis.motor);
      SpringOf(io, axis.spring);
    }
  } else if constexpr (std::is_same_v<T, UniversalJoint>) {
    LimitOf(io, kind.limit_a_rad);
    LimitOf(io, kind.limit_b_rad);
  } else if constexpr (std::is_same_v<T, Hinge2Joint>) {
    LimitOf(io, kind.steering_rad);
    SpringOf(io, kind.suspension);
    MotorOf(io, kind.drive);
  } else if constexpr (std::is_same_v<T, GearJoint>) {
    io.Real("ratio", kind.ratio, -kMaxGearRatio, kMaxGearRatio);
    if constexpr (Io::kReads) {
      if (io.ok() && std::abs(kind.ratio) < kMinGearRatio) io.Fail("ratio", "is too small");
    }
  }
}

// Makes `kind` the alternative of this place.
template <std::size_t kPlace = 0>
void BecomeKind(decltype(JointDef::kind)& kind, std::size_t place) {
  if constexpr (kPlace < std::variant_size_v<decltype(JointDef::kind)>) {
    if (place != kPlace) return BecomeKind<kPlace + 1>(kind, place);
    kind.emplace<kPlace>();
  }
}

template <class Io, class T>
void JointOf(Io& io, T& joint) {
  io.Number("id", joint.id, 1, ~0ull);
  io.Number("body_a", joint.body_a, 1, kFirstPlayerBody - 1);
  io.Number("body_b", joint.body_b, 0, kFirstPlayerBody - 1);
  PoseOf(io, "frame_a", joint.frame_a, kMaxExtent_m);
  PoseOf(io, "frame_b", joint.frame_b, joint.body_b == BodyId() ? kMaxCoordinate_m : kMaxExtent_m);
  io.Flag("bodies_collide", joint.bodies_collide);
  auto place = static_cast<std::uint8_t>(joint.kind.index());
  io.Choice("kind", place, static_cast<std::uint8_t>(std::variant_size_v<decltype(JointDef::kind)> - 1));
  if constexpr (Io::kReads) BecomeKind(joint.kind, place);
  std::visit([&](auto& kind) { KindOf(io, kind); }, joint.kind);
  if constexpr (Io::kReads) {
    if (io.ok() && joint.body_a == joint.body_b) io.Fail("body_b", "is body_a");
    if (io.ok() && std::holds_alternative<GearJoint>(joint.kind) && joint.body_b == BodyId()) {
      io.Fail("body_b", "is missing: a gear needs two bodies");
    }
  }
}

}  // namespace tessera::packed
