#include "core/physics/prediction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/physics/linear.h"

namespace tessera::physics {
namespace {

// Motion along one axis with damping, dv/dt = a - k v. The solution is
//
//   v(t) = v e^(-k t) + a s(t),   p(t) = p + v s(t) + a (t - s(t)) / k,   s(t) = (1 - e^(-k t)) / k,
//
// and Algorithm 1 itself where k = 0. A body loses the share d of its velocity in a second: k = -ln(1 - d).
class DampedMotion {
 public:
  explicit DampedMotion(double share_a_second) : k_(-std::log1p(-std::clamp(share_a_second, 0.0, 1.0))) {}

  double Kept(double t) const { return k_ == 0 || t == 0 ? 1 : std::exp(-k_ * t); }
  double S(double t) const {
    if (k_ == 0 || t == 0) return t;
    return std::isinf(k_) ? 0 : -std::expm1(-k_ * t) / k_;
  }
  // (t - s(t)) / k. The series replaces it where k t is so small that the difference would be rounding.
  double Q(double t) const {
    const double x = k_ * t;
    if (std::isinf(k_)) return 0;
    if (x < 1e-3) return t * t * (0.5 - x / 6 + x * x / 24 - x * x * x / 120);
    return (t - S(t)) / k_;
  }
  // The time at which the velocity passes through zero; infinite if it never does.
  double Turn(double v, double a) const {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    if (a == 0 || v == 0 || (v > 0) == (a > 0) || std::isinf(k_)) return kNever;
    return k_ == 0 ? -v / a : std::log1p(-k_ * v / a) / k_;
  }

 private:
  double k_;
};

Vec3d PositionAfter(const BodyState& state, Vec3d acceleration_m_s2, const DampedMotion& damping, double t) {
  return state.position + Vec3d(state.linear_velocity) * damping.S(t) + acceleration_m_s2 * damping.Q(t);
}

}  // namespace

BodyState Predict(const BodyDef& def, const BodyState& state, const Forces& forces, double dt_s) {
  if (state.asleep || def.motion == Motion::kStatic || dt_s <= 0) return state;
  const DampedMotion linear(def.linear_damping), angular(def.angular_damping);
  const Vec3d v(state.linear_velocity), w(state.angular_velocity);
  BodyState result = state;
  result.position = PositionAfter(state, forces.acceleration_m_s2, linear, dt_s);
  result.linear_velocity = Vec3f(v * linear.Kept(dt_s) + forces.acceleration_m_s2 * linear.S(dt_s));
  result.angular_velocity = Vec3f(w * angular.Kept(dt_s));
  result.angular_momentum = Vec3f(Vec3d(state.angular_momentum) * angular.Kept(dt_s));
  const double speed = Length(w), half_angle = speed * angular.S(dt_s) / 2;
  if (half_angle > 0) {
    const Vec3d axis = w * (std::sin(half_angle) / speed);
    const Quatd turn{axis.x, axis.y, axis.z, std::cos(half_angle)};
    result.orientation = Normalized(turn * state.orientation);
  }
  return result;
}

Aabb SweptBounds(const BodyDef& def, const BodyState& state, const Forces& forces, double radius_m, double dt_s) {
  const Vec3d start = state.position;
  Aabb path{start, start};
  if (state.asleep || def.motion == Motion::kStatic || dt_s <= 0) return path.Expanded(radius_m);
  const DampedMotion damping(def.linear_damping);
  const auto pass = [&](double t) {
    const Vec3d p = PositionAfter(state, forces.acceleration_m_s2, damping, t);
    path = path.United({p, p});
  };
  pass(dt_s);
  const auto v = ArrayOf(Vec3d(state.linear_velocity)), a = ArrayOf(forces.acceleration_m_s2);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (const double turn = damping.Turn(v[axis], a[axis]); turn < dt_s) pass(turn);
  }
  return path.Expanded(radius_m);
}

}  // namespace tessera::physics
