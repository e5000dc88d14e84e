#include "core/physics/solve/joint_angles.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

// Lower bounds of divisors. Below the first an azimuth turns faster than anyone can follow; the others are near opposed
// axes.
constexpr double kLeastAcross = 1e-3, kLeastSum = 0.05, kLeastSine = 0.05;

double& Component(Vec3d& v, std::size_t k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }
double Component(const Vec3d& v, std::size_t k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

std::array<Vec3d, 3> AxesOf(Quatd q) {
  return {Rotate(q, Vec3d{1, 0, 0}), Rotate(q, Vec3d{0, 1, 0}), Rotate(q, Vec3d{0, 0, 1})};
}

Vec3d Out(const std::array<Vec3d, 3>& axes, Vec3d v) { return axes[0] * v.x + axes[1] * v.y + axes[2] * v.z; }

// Gradient of the azimuth of `p` about axis k, all in one frame's coordinates: p' = w x p gives
// azimuth' = w_k - p_k (w . p - w_k p_k) / (|p|^2 - p_k^2).
Vec3d AzimuthGradient(Vec3d p, std::size_t k) {
  const double along = Component(p, k);
  Component(p, k) = 0;
  Vec3d gradient = p * (-along / std::max(LengthSquared(p), kLeastAcross));
  Component(gradient, k) = 1;
  return gradient;
}

// The turn about axis k that is left when the swing of that axis is taken away.
JointAngle TwistOf(const FramePair& f, std::size_t k) {
  const Quatd r = Conjugate(f.q_a) * f.q_b;
  const double sign = r.w < 0 ? -1 : 1;
  const Vec3d sum = f.a[k] + f.b[k];
  return {2 * Atan2(Component(Vec3d{r.x, r.y, r.z}, k) * sign, r.w * sign),
          sum / std::max(1 + Dot(f.a[k], f.b[k]), kLeastSum)};
}

// The angle by which an axis of a and one of b are not perpendicular, as they ought to be.
JointAngle Across(Vec3d of_a, Vec3d of_b) { return {Dot(of_a, of_b), Cross(of_b, of_a)}; }

}  // namespace

FramePair::FramePair(Quatd orientation_a, Quatd orientation_b)
    : q_a(orientation_a), q_b(orientation_b), a(AxesOf(q_a)), b(AxesOf(q_b)) {}

JointAngles RotationAngles(const FramePair& f) {
  const Vec3d v = RotationVectorOf(Normalized(Conjugate(f.q_a) * f.q_b));
  // v' = w - v x w / 2 + c v x (v x w), c = (1 - angle / 2 cot(angle / 2)) / angle^2: the inverse left Jacobian of
  // SO(3).
  const double angle = Length(v);
  double c = 1.0 / 12 + angle * angle / 720;
  if (angle > 0.1) {
    const SinCos half = SinCosOf(angle / 2);
    c = (1 - angle / 2 * half.cos / half.sin) / (angle * angle);
  }
  const auto row = [&](Vec3d axis) { return Out(f.a, axis + Cross(v, axis) * 0.5 + Cross(v, Cross(v, axis)) * c); };
  return {{{v.x, row({1, 0, 0})}, {v.y, row({0, 1, 0})}, {v.z, row({0, 0, 1})}}};
}

JointAngles HingeAngles(const FramePair& f, std::size_t k) {
  const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
  JointAngles angles;
  angles[k] = TwistOf(f, k);
  const Vec3d axis = f.b[k];
  const double along_i = Dot(f.a[i], axis), along_j = Dot(f.a[j], axis), along_k = Dot(f.a[k], axis);
  if (along_k > 0) {
    angles[i] = {-along_j, Cross(f.a[j], axis)};
    angles[j] = {along_i, Cross(axis, f.a[i])};
    return angles;
  }
  // Sines fall again beyond a quarter turn; there the rotation vector itself is taken, and its axes.
  const double across = std::sqrt(along_i * along_i + along_j * along_j);
  const double swing = Atan2(across, along_k);
  angles[i] = {across > 1e-9 ? -along_j / across * swing : swing, f.a[i]};
  angles[j] = {across > 1e-9 ? along_i / across * swing : 0, f.a[j]};
  return angles;
}

JointAngles EulerAngles(const FramePair& f) {
  const Vec3d p = f.InA(f.b[0]), q = f.InB(f.a[2]);
  return {{{Atan2(q.y, q.z), Out(f.b, AzimuthGradient(q, 0))},
           {Atan2(-p.z, std::sqrt(p.x * p.x + p.y * p.y)), Normalized(Cross(f.a[2], f.b[0]), f.a[1])},
           {Atan2(p.y, p.x), Out(f.a, AzimuthGradient(p, 2))}}};
}

JointAngles EulerAnglesWithoutX(const FramePair& f) {
  const Vec3d p = f.InA(f.b[1]), q = f.InB(f.a[2]);
  return {{Across(f.a[2], f.b[1]),
           {Atan2(-q.x, q.z), Out(f.b, AzimuthGradient(q, 1))},
           {Atan2(-p.x, p.y), Out(f.a, AzimuthGradient(p, 2))}}};
}

JointAngles EulerAnglesWithoutZ(const FramePair& f) {
  const Vec3d p = f.InA(f.b[0]), q = f.InB(f.a[1]);
  return {{{Atan2(-q.z, q.y), Out(f.b, AzimuthGradient(q, 0))},
           {Atan2(-p.z, p.x), Out(f.a, AzimuthGradient(p, 1))},
           Across(f.a[1], f.b[0])}};
}

SwingTwist SwingTwistOf(const FramePair& f) {
  SwingTwist result{.twist = TwistOf(f, 0), .swing_y = {}, .swing_z = {}};
  // The swing is scale * (x cross u) with u = b's x as a sees it, scale = angle / sine; u' = w x u.
  const Vec3d u = f.InA(f.b[0]);
  const double sine = std::sqrt(u.y * u.y + u.z * u.z), angle = Atan2(sine, u.x);
  double scale = 1 + angle * angle / 6, growth = angle / 3;  // derivative of the scale by the angle
  Vec3d axis{0, 0, 0};                                       // the swing turns about it: the angle grows by w along it
  if (sine > 1e-4 || u.x < 0) {
    const double s = std::max(sine, kLeastSine * (u.x < 0 ? 1 : 0));
    scale = angle / s;
    growth = (s - angle * u.x) / (s * s);
    if (s < 0.01) growth = angle / 3;
    axis = Vec3d{0, -u.z, u.y} / s;
  }
  result.swing_y = {-u.z * scale, Out(f.a, Vec3d{-u.y, u.x, 0} * scale - axis * (growth * u.z))};
  result.swing_z = {u.y * scale, Out(f.a, Vec3d{-u.z, 0, u.x} * scale + axis * (growth * u.y))};
  return result;
}

}  // namespace tessera::physics
