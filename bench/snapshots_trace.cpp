#include "bench/snapshots_trace.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "bench/statistics.h"
#include "core/physics/world.h"

namespace tessera::bench {
namespace {

using replication::QuantizedState;

constexpr double kTick_s = 1.0 / 60;
constexpr double kCube_m = 0.4, kPlayer_m = 1.5, kDensity_kg_m3 = 1;
constexpr double kFriction = 10;  // the most that a scene may ask for; his is 200
constexpr double kDrive_n = 120;
// The script of the player: keys are let go when it is this fast, and turned about at this edge. Chosen, with the
// lengths of its phases, so that the bit packer needs per cube what is published: 5.5, 26.1 and 23.3 bits.
constexpr double kCruise_m_s = 12, kEdge_m = 11;
constexpr double kTraceSpeed_m_s = 32, kMaxSpin_rad_s = 16;
constexpr BodyId kPlayer(1), kGround(10'000);

BodyDef Cube(BodyId id, double side_m, Vec3d position) {
  BodyDef def;
  def.id = id;
  def.shape = std::make_shared<const Shape>(Shape{BoxShape{{side_m / 2, side_m / 2, side_m / 2}}});
  def.mass_kg = kDensity_kg_m3 * side_m * side_m * side_m;
  def.material.friction = kFriction;
  def.linear_damping = def.angular_damping = 0.01;
  def.initial.position = position;
  return def;
}

Vec3f Held(Vec3f v, double limit) {
  const double length = Length(Vec3d(v));
  return length > limit ? v * static_cast<float>(limit / length) : v;
}

double DegreesBetween(Quatd a, Quatd b) {
  const Quatd d = a * Conjugate(b);
  return 2 * std::atan2(Length(Vec3d(d.x, d.y, d.z)), std::abs(d.w)) * 180 / std::numbers::pi;
}

class Playground {
 public:
  Playground(CubeDrive drive, unsigned seed) : drive_(drive), random_(seed), world_({.gravity_m_s2 = {0, -20, 0}}) {
    BodyDef ground;
    ground.id = kGround;
    ground.motion = Motion::kStatic;
    ground.mass_kg = 0;
    ground.shape = std::make_shared<const Shape>(Shape{PlaneShape{}});
    ground.material.friction = kFriction;
    world_.Add(ground, ground.initial);
    Add(Cube(kPlayer, kPlayer_m, {0, drive == CubeDrive::kNone ? kPlayer_m / 2 : 10, 0}));
    for (int z = 0; z < 30; ++z) {
      for (int x = 0; x < 30; ++x) {
        // Nobody drives: the player's cube stands beside the field instead of in it.
        const double aside = drive == CubeDrive::kNone ? 20 : 0;
        Add(Cube(BodyId(ids_.size() + 1), kCube_m, {x - 14.5 + aside, kCube_m / 2, z - 14.5}));
      }
    }
  }

  void Step() {
    if (drive_ == CubeDrive::kMixed) Drive();
    world_.Step(kTick_s);
    for (const BodyId id : ids_) HoldSpeed(id);
    ++tick_;
  }
  std::size_t size() const { return ids_.size(); }
  BodyState StateOf(std::size_t index) const { return world_.StateOf(ids_[index]); }

 private:
  void Add(const BodyDef& def) {
    world_.Add(def, def.initial);
    ids_.push_back(def.id);
  }
  double Uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  // Like a person at four keys: a direction for a while, back towards the middle when the edge is near. Two seconds
  // plain, four pulling, four pushing.
  void Drive() {
    const BodyState player = world_.StateOf(kPlayer);
    if (tick_ >= turn_at_) {
      turn_at_ = tick_ + static_cast<int>(Uniform(20, 90));
      const double angle = std::floor(Uniform(0, 8)) * std::numbers::pi / 4;
      heading_ = {std::cos(angle), 0, std::sin(angle)};
      const Vec3d p = player.position;
      if (std::abs(p.x) > kEdge_m) heading_.x = -std::copysign(1, p.x);
      if (std::abs(p.z) > kEdge_m) heading_.z = -std::copysign(1, p.z);
    }
    const int cycle = tick_ % 600;
    const int phase = cycle < 120 ? 0 : cycle < 360 ? 1 : 2;
    Vec3d force = heading_ * kDrive_n;
    if (Dot(heading_, Vec3d(player.linear_velocity)) > kCruise_m_s) force = {};
    if (phase != 2 && Dot(force, Vec3d(player.linear_velocity)) < 0) force = force * 2.0;
    world_.ApplyForce(kPlayer, Vec3f(force), {});
    if (phase == 1) Pull(player.position);
    if (phase == 2) Push(player);
  }

  void Pull(Vec3d center) {
    ForEachCube([&](BodyId id, const BodyState& state, double mass) {
      const Vec3d away = state.position - center;
      const double d2 = LengthSquared(away);
      if (d2 <= 0.2 * 0.2 || d2 >= 1.8 * 1.8) return;
      world_.ApplyForce(id, Vec3f(away * (-std::min(200 / d2, 2000.0) * mass / std::sqrt(d2))), {});
    });
  }

  void Push(const BodyState& player) {
    Vec3d origin = player.position;
    origin.y = -0.1;
    ForEachCube([&](BodyId id, const BodyState& state, double mass) {
      const Vec3d away = state.position - origin;
      const double d2 = LengthSquared(away);
      if (d2 <= 0.01 * 0.01 || d2 >= 4) return;
      world_.ApplyForce(id, Vec3f(away * (std::min(200 / d2, 500.0) * mass / std::sqrt(d2))), {});
    });
    // The player's cube floats upright on its own push, wobbling, and is damped.
    const Vec3d away = player.position - origin - Vec3d(0, 0.7, 0);
    const double d2 = LengthSquared(away);
    Vec3d force;
    if (d2 > 0.01 * 0.01 && d2 < 4) force = away * (std::min(200 / d2, 500.0) / std::sqrt(d2));
    const double t = tick_;
    const auto wobble = [t](double a, double b, double c) {
      return std::sin(t * 0.1 + a) + std::sin(t * 0.05 + b) + std::sin(t + c);
    };
    force = force + Vec3d(wobble(1, 3, 10), wobble(3, 5, 12), wobble(2, 4, 11)) * 2.0;
    const Vec3d up = Rotate(player.orientation, Vec3d(0, 1, 0));
    const Vec3d upright = Cross(up, Vec3d(0, 1, 0)) * 50.0;
    world_.ApplyForce(kPlayer, Vec3f(force), Vec3f(upright));
    BodyState damped = player;
    damped.angular_velocity *= 0.95f;
    damped.linear_velocity.x *= 0.96f;
    damped.linear_velocity.z *= 0.96f;
    world_.SetState(kPlayer, damped);
  }

  template <class Do>
  void ForEachCube(const Do& apply) {
    for (const BodyId id : ids_) {
      if (id != kPlayer) apply(id, world_.StateOf(id), world_.MassOf(id));
    }
  }

  void HoldSpeed(BodyId id) {
    BodyState state = world_.StateOf(id);
    const Vec3f linear = Held(state.linear_velocity, kTraceSpeed_m_s),
                angular = Held(state.angular_velocity, kMaxSpin_rad_s);
    if (linear == state.linear_velocity && angular == state.angular_velocity) return;
    state.linear_velocity = linear;
    state.angular_velocity = angular;
    world_.SetState(id, state);
  }

  CubeDrive drive_;
  std::mt19937 random_;
  physics::World world_;
  std::vector<BodyId> ids_;
  int tick_ = 0, turn_at_ = 60;
  Vec3d heading_;
};

}  // namespace

replication::SnapshotSettings CubeSettings() {
  replication::SnapshotSettings settings;
  settings.position_step_m = 1.0 / 512;
  settings.orientation_bits = 9;
  return settings;
}

// With the quantiser's margin of 8 m: 512 m across, 18 bits, and from the ground 32 m up, 14 bits, as his.
Aabb CubeBounds() { return {{-247.9, 7.9, -247.9}, {247.9, 23.8, 247.9}}; }

replication::StandingBoxes CubeBoxes() {
  const replication::Quantizer quantizer(CubeBounds(), CubeSettings());
  replication::StandingBoxes boxes;
  for (std::size_t i = 0; i < CubeTrace::kCubes; ++i) {
    const double half_m = (i == 0 ? kPlayer_m : kCube_m) / 2;
    boxes[BodyId(i + 1)] = replication::StandingBox::Of(quantizer, 0, {half_m, half_m, half_m});
  }
  return boxes;
}

CubeTrace RecordCubes(double seconds, CubeDrive drive, unsigned seed) {
  const replication::Quantizer quantizer(CubeBounds(), CubeSettings());
  Playground playground(drive, seed);
  CubeTrace trace;
  std::vector<double> errors_m;
  double sum_deg = 0;
  std::size_t count = 0;
  for (int n = 0; n < static_cast<int>(seconds / kTick_s); ++n) {
    playground.Step();
    std::vector<QuantizedState>& states = trace.ticks.emplace_back(playground.size());
    std::size_t moving = 0;
    for (std::size_t i = 0; i < playground.size(); ++i) {
      const BodyState truth = playground.StateOf(i);
      QuantizedState& state = states[i];
      state = quantizer.Quantize(truth);
      state.linear = state.angular = {};
      if (truth.asleep) continue;
      ++moving;
      const BodyState seen = quantizer.Dequantize(state);
      errors_m.push_back(Length(seen.position - truth.position));
      const double error_deg = DegreesBetween(seen.orientation, truth.orientation);
      sum_deg += error_deg;
      ++count;
      trace.angle_error_max_deg = std::max(trace.angle_error_max_deg, error_deg);
    }
    trace.moving_share.push_back(static_cast<double>(moving) / static_cast<double>(playground.size()));
  }
  if (count > 0) {
    trace.angle_error_mean_deg = sum_deg / static_cast<double>(count);
    trace.position_error_max_m = *std::max_element(errors_m.begin(), errors_m.end());
    trace.position_error_p50_m = Median(std::move(errors_m));
  }
  return trace;
}

}  // namespace tessera::bench
