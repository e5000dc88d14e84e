// Meet: where a query first touches one body's shape, whatever its kind.
//
//   WorkMeter meter(budget);
//   std::optional<SurfaceHit> hit = Meet(geometry, orientation, ray, nullptr, meter);
//
// Thread rule: Bullet's trees of triangles allow one thread at a time.
#pragma once

#include <cstdint>
#include <optional>

#include "core/physics/query/cast.h"
#include "core/physics/query/ray.h"

namespace tessera::physics {

// Counts the work of a query, in instructions as BodyQuery has them. Once it is used up, there is no more.
class WorkMeter {
 public:
  explicit WorkMeter(std::uint64_t most) : left_(most) {}

  // Whether there was so much left.
  bool Spend(std::uint64_t work) {
    exhausted_ = exhausted_ || work > left_;
    left_ -= exhausted_ ? left_ : work;
    return !exhausted_;
  }
  bool exhausted() const { return exhausted_; }
  std::uint64_t left() const { return left_; }

 private:
  std::uint64_t left_;
  bool exhausted_ = false;
};

// In the frame of the body, which is turned by `frame` in the world. Without a probe a point moves along the ray. The
// result means nothing once the meter is exhausted.
std::optional<SurfaceHit> Meet(const Geometry& geometry, Quatd frame, const LocalRay& ray, const Probe* probe,
                               WorkMeter& meter);

}  // namespace tessera::physics
