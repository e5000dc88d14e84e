// Exchange: the impulses that contacts gave the two bodies of a pair over the last step. One body loses what the other
// gets, to the bit; so sums over exchanges keep momentum, and angular momentum but for rounding.
#pragma once

#include "core/physics/collide/manifold.h"

namespace tessera::physics {

template <class T>
struct Exchange {
  Vec3<T> on_b;                        // N s; a got the opposite
  Vec3<T> angular_on_a, angular_on_b;  // N m s, about each body's own centre of mass

  void Add(const Manifold& manifold) {
    const Vec3<T> normal(manifold.normal), friction(manifold.total_friction), rolling(manifold.total_rolling);
    T pushed = 0;
    Vec3<T> at_a, at_b;  // sums of arms times impulses
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      const auto impulse = static_cast<T>(point.total_impulse);
      pushed += impulse;
      at_a += Vec3<T>(point.r_a) * impulse;
      at_b += Vec3<T>(point.r_b) * impulse;
    }
    on_b += normal * pushed + friction;
    angular_on_a -= Cross(at_a, normal);
    angular_on_b += Cross(at_b, normal);
    angular_on_a += Cross(Vec3<T>(manifold.friction_r_a), -friction) - rolling;
    angular_on_b += Cross(Vec3<T>(manifold.friction_r_b), friction) + rolling;
    angular_on_a += Vec3<T>(manifold.turn_on_a);
    angular_on_b += Vec3<T>(manifold.turn_on_b);
  }
};

}  // namespace tessera::physics
