#include "core/physics/solve/strike.h"

#include <cmath>

#include "core/physics/solve/tuning.h"

namespace tessera::physics {

std::optional<float> HitTime(const PointPath& path, float from, float h) {
  const float start = std::max(path.PlaceAt(from, h), 0.0f), velocity = path.VelocityAt(from, h);
  const float acceleration = 2 * path.bend / (h * h), rest = h - from;
  if (start + rest * (velocity + 0.5f * rest * acceleration) >= 0) return std::nullopt;
  // At the surface v^2 = v0^2 - 2 a y0; the time follows without a difference of numbers that are nearly equal.
  const float speed = std::sqrt(std::max(velocity * velocity - 2 * acceleration * start, 0.0f));
  if (!(speed > kBounce_m_s)) return std::nullopt;
  const float time = velocity > 0 ? (speed + velocity) / -acceleration : start > 0 ? 2 * start / (speed - velocity) : 0;
  return from + std::min(time, rest);
}

}  // namespace tessera::physics
