#include "core/physics/continuous/keep_turning.h"

#include <cmath>

namespace tessera::physics {
namespace {

// Angular momentum of a body that turns at `spin`, rad/s, world axes.
Vec3d SpinMomentum(const RigidBody& body, Quatd orientation, Vec3d spin) {
  const Vec3d w = Rotate(Conjugate(orientation), spin), inertia = body.inertia();
  return Rotate(orientation, Vec3d{inertia.x * w.x, inertia.y * w.y, inertia.z * w.z});
}

bool IsFinite(const PairImpulse& impulse) {
  return tessera::IsFinite(impulse.impulse_on_b) && tessera::IsFinite(impulse.angular_impulse_on_a) &&
         tessera::IsFinite(impulse.angular_impulse_on_b);
}

// The solution v of the equations Dot(row_i of [x y z], v) = b, for a symmetric matrix.
Vec3d Solved(Vec3d x, Vec3d y, Vec3d z, Vec3d b) {
  return Vec3d{Dot(b, Cross(y, z)), Dot(x, Cross(b, z)), Dot(x, Cross(y, b))} / Dot(x, Cross(y, z));
}

}  // namespace

std::optional<PairImpulse> KeepTurning(std::span<RigidBody* const> awake, const Stop& stop,
                                       std::span<BodyMotion> motions) {
  constexpr double kMostEnergy = 0.1;
  const RigidBody &one = *awake[stop.index], &other = *stop.by;
  if (!other.awake() || !one.joints.empty() || !other.joints.empty()) return {};
  const bool one_is_low = one.id() < other.id();
  const RigidBody &low = one_is_low ? one : other, &high = one_is_low ? other : one;
  BodyMotion &a = motions[low.awake_index], &b = motions[high.awake_index];
  const Vec3d lacks = Cross(stop.end_m - motions[stop.index].position, Vec3d(stop.velocity_m_s)) * one.mass_kg();
  if (lacks == Vec3d()) return {};
  const double mass = low.mass_kg() * high.mass_kg() / (low.mass_kg() + high.mass_kg());
  const Vec3d apart = b.position - a.position;
  const auto momentum = [&](Vec3d spin) {
    return SpinMomentum(low, a.orientation, spin) + SpinMomentum(high, b.orientation, spin) +
           Cross(apart, Cross(spin, apart)) * mass;
  };
  Vec3d spin = Solved(momentum({1, 0, 0}), momentum({0, 1, 0}), momentum({0, 0, 1}), lacks);
  const double given = Dot(lacks, spin), most = kMostEnergy * mass * LengthSquared(Vec3d(b.velocity - a.velocity));
  if (given > most) spin *= std::sqrt(most / given);
  PairImpulse impulse;
  impulse.body_a = low.id();
  impulse.body_b = high.id();
  impulse.tag_a = low.tag;
  impulse.tag_b = high.tag;
  impulse.impulse_on_b = Vec3f(Cross(spin, apart) * mass);
  impulse.angular_impulse_on_a = Vec3f(SpinMomentum(low, a.orientation, spin));
  impulse.angular_impulse_on_b = Vec3f(SpinMomentum(high, b.orientation, spin));
  if (!IsFinite(impulse)) return {};
  a.velocity -= impulse.impulse_on_b / static_cast<float>(low.mass_kg());
  b.velocity += impulse.impulse_on_b / static_cast<float>(high.mass_kg());
  a.angular_momentum += impulse.angular_impulse_on_a;
  b.angular_momentum += impulse.angular_impulse_on_b;
  return impulse;
}

}  // namespace tessera::physics
