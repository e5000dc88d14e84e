#include "core/region/fields.h"

namespace tessera::region {
namespace {

Vec3d Acceleration(const VortexField& field, const BodyState& state) {
  const Vec3d r = state.position - field.center;
  if (r.x * r.x + r.z * r.z > field.radius_m * field.radius_m) return {};
  // (0, w, 0) x r = (w r.z, 0, -w r.x)
  const Vec3d wanted{field.angular_velocity_rad_s * r.z, 0, -field.angular_velocity_rad_s * r.x};
  const Vec3d v(state.linear_velocity);
  return Vec3d{wanted.x - v.x, 0, wanted.z - v.z} * field.gain_per_s;
}

Vec3d Acceleration(const UniformField& field, const BodyState& state) {
  return field.bounds.Contains(state.position) ? field.acceleration_m_s2 : Vec3d{};
}

}  // namespace

Vec3d FieldAcceleration(std::span<const Field> fields, const BodyState& state) {
  Vec3d sum;
  for (const Field& field : fields) {
    sum += std::visit([&](const auto& kind) { return Acceleration(kind, state); }, field);
  }
  return sum;
}

}  // namespace tessera::region
