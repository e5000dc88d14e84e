// MovingBodies, test worlds for replication: bodies that fly, bounce, roll, collide with nothing in particular, come to
// rest and are kicked awake again, all from one seed. Not physics, but with the changes from tick to tick that physics
// makes.
#pragma once

#include <random>
#include <vector>

#include "core/replication/snapshot_record.h"
#include "core/world/bounds.h"

namespace tessera::replication {

class MovingBodies {
 public:
  struct Options {
    std::size_t count = 100;
    unsigned seed = 1;
    double world_m = 100;      // in x and z, about the origin
    double kicks_per_s = 0.5;  // each gives a body a new velocity
    double ground_drag_per_s = 0.4;
    double rest_speed_m_s = 0;  // slower ones on the ground fall asleep; 0: none ever rests
  };

  explicit MovingBodies(const Options& options) : options_(options), random_(options.seed) {
    for (std::size_t i = 0; i < options.count; ++i) {
      BodyRecord body{.id = BodyId(i + 1), .epoch = Epoch(1), .state = {}};
      const double half = options.world_m / 2 - 2;
      body.state.position = {Uniform(-half, half), Uniform(0.5, 5), Uniform(-half, half)};
      body.state.orientation = Normalized(Quatd(Uniform(-1, 1), Uniform(-1, 1), Uniform(-1, 1), Uniform(-1, 1)));
      Kick(body.state);
      bodies_.push_back(body);
    }
  }

  const std::vector<BodyRecord>& bodies() const { return bodies_; }
  std::vector<BodyRecord>& bodies() { return bodies_; }
  Aabb bounds() const {
    const double half = options_.world_m / 2;
    return {{-half, -2, -half}, {half, 50, half}};
  }
  double Uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  bool Chance(double p) { return Uniform(0, 1) < p; }

  void Step(double dt_s) {
    for (BodyRecord& body : bodies_) StepOne(body.state, dt_s);
  }

 private:
  static constexpr float kRadius_m = 0.5f;

  void Kick(BodyState& s) {
    s.asleep = false;
    s.linear_velocity = Vec3f(Vec3d(Uniform(-5, 5), Uniform(0, 6), Uniform(-5, 5)));
    s.angular_velocity = Vec3f(Vec3d(Uniform(-6, 6), Uniform(-6, 6), Uniform(-6, 6)));
  }

  void StepOne(BodyState& s, double dt_s) {
    if (Chance(options_.kicks_per_s * dt_s)) Kick(s);
    if (s.asleep) return;
    const auto dt = static_cast<float>(dt_s);
    const bool grounded = s.position.y <= kRadius_m + 1e-6 && std::abs(s.linear_velocity.y) < 0.5f;
    if (grounded) {
      s.linear_velocity *= static_cast<float>(1 - options_.ground_drag_per_s * dt_s);
      s.linear_velocity.y = 0;
      s.position.y = double{kRadius_m};
      s.angular_velocity = {s.linear_velocity.z / kRadius_m, 0, -s.linear_velocity.x / kRadius_m};  // rolls
      if (Length(s.linear_velocity) < options_.rest_speed_m_s) {
        s.asleep = true;
        s.linear_velocity = s.angular_velocity = {};
        return;
      }
    } else {
      s.linear_velocity.y -= 9.81f * dt;
    }
    s.position += Vec3d(s.linear_velocity * dt);
    const Vec3d half(s.angular_velocity * (dt / 2));
    s.orientation = Normalized(Quatd(half.x, half.y, half.z, 1) * s.orientation);
    Bounce(s);
  }

  void Bounce(BodyState& s) {
    if (s.position.y < double{kRadius_m} && s.linear_velocity.y < 0) {
      s.position.y = double{kRadius_m};
      s.linear_velocity.y *= -0.5f;
      s.angular_velocity = Vec3f(Vec3d(Uniform(-4, 4), Uniform(-4, 4), Uniform(-4, 4)));
    }
    const double half = options_.world_m / 2;
    if (std::abs(s.position.x) > half) s.linear_velocity.x = std::copysign(s.linear_velocity.x, float(-s.position.x));
    if (std::abs(s.position.z) > half) s.linear_velocity.z = std::copysign(s.linear_velocity.z, float(-s.position.z));
  }

  Options options_;
  std::mt19937 random_;
  std::vector<BodyRecord> bodies_;
};

}  // namespace tessera::replication
