// Continuous collision: nothing passes through a wall, rebounds are as fast as they should be, near misses are misses.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/stability_stage.h"
#include "bench/thread_cpu.h"
#include "core/physics/world.h"
#include "scenes/measured/impacts.h"

namespace tessera::bench {
namespace {

constexpr double kFlight_s = 0.3;

// Over so many offsets of the start by parts of one step's way: calls look(run, shot) after each run.
template <class Make, class Look>
absl::Status Shoot(StabilityStage& stage, const std::string& name, const std::string& config, int shots, double seconds,
                   Make make, Look look) {
  double cpu_us = 0;
  for (int i = 0; i < shots; ++i) {
    const scenes::Shot shot = make((i + 0.5) / shots);
    absl::StatusOr<Run> run = stage.Start(shot.scene);
    if (!run.ok()) return run.status();
    run->Seconds(seconds);
    cpu_us += run->cpu_us_per_tick() / shots;
    look(*run, shot);
  }
  stage.Cost(name, config, cpu_us);
  return absl::OkStatus();
}

bool Escaped(const Run& run, const scenes::Shot& shot) {
  return !(run.StateOf(shot.bullet).position.x < -shot.wall_face_m);  // past the far face
}

struct Wall {
  double speed_m_s, half_thickness_m;
};

absl::Status Escapes(StabilityStage& stage) {
  const int shots = stage.Repeats(1000, 100);
  for (const Wall wall : {Wall{500, 0.1}, Wall{50, 0.005}, Wall{200, 0.005}, Wall{500, 0.005}}) {
    const std::string config = fmt::format("speed={:g} wall={:g}", wall.speed_m_s, 2 * wall.half_thickness_m);
    int escapes = 0;
    const absl::Status status = Shoot(
        stage, "ccd_ball", config, shots, kFlight_s,
        [&](double offset) { return scenes::ShotAtWall(wall.speed_m_s, wall.half_thickness_m, offset); },
        [&](const Run& run, const scenes::Shot& shot) { escapes += Escaped(run, shot); });
    if (!status.ok()) return status;
    stage.Note("ccd_ball", config, "ccd_escapes", escapes);
  }
  return absl::OkStatus();
}

absl::Status RodEscapes(StabilityStage& stage) {
  const int shots = stage.Repeats(1000, 100);
  for (const double speed : {50.0, 200.0, 500.0}) {
    const std::string config = fmt::format("speed={:g} wall=0.01", speed);
    int escapes = 0;
    const absl::Status status = Shoot(
        stage, "ccd_rod", config, shots, kFlight_s,
        [&](double offset) { return scenes::SpinningRodAtWall(speed, offset); },
        [&](const Run& run, const scenes::Shot& shot) { escapes += Escaped(run, shot); });
    if (!status.ok()) return status;
    stage.Note("ccd_rod", config, "ccd_escapes", escapes);
  }
  return absl::OkStatus();
}

// Ten boxes behind the wall: the bullet stops at it, and nothing behind it stirs.
absl::Status Guarded(StabilityStage& stage) {
  int escapes = 0;
  double stirred = 0;
  const absl::Status status = Shoot(
      stage, "ccd_guarded", "speed=500", stage.Repeats(20, 4), 1,
      [](double offset) { return scenes::ShotAtGuardedBoxes(offset); },
      [&](const Run& run, const scenes::Shot& shot) {
        escapes += Escaped(run, shot);
        for (const BodyDef& body : shot.scene.bodies) {
          if (body.motion == Motion::kStatic || body.id == shot.bullet) continue;
          stirred = std::max(stirred, Length(run.StateOf(body.id).position - body.initial.position));
        }
      });
  stage.Note("ccd_guarded", "speed=500", "ccd_escapes", escapes);
  stage.Note("ccd_guarded", "speed=500", "behind_moved_m", stirred, "m");
  return status;
}

absl::Status Rebounds(StabilityStage& stage) {
  constexpr double kSpeed = 500;
  double worst = 0;
  const absl::Status status = Shoot(
      stage, "ccd_rebound", "speed=500", stage.Repeats(100, 10), kFlight_s,
      [](double offset) { return scenes::ShotAtWall(kSpeed, 0.1, offset, 1); },
      [&](const Run& run, const scenes::Shot& shot) {
        const BodyState state = run.StateOf(shot.bullet);
        const Vec3d error = Vec3d(state.linear_velocity) + Vec3d{kSpeed, 0, 0};
        worst = IsFinite(state) ? std::max(worst, Length(error) / kSpeed) : std::numeric_limits<double>::infinity();
      });
  stage.Note("ccd_rebound", "speed=500", "ccd_rebound_error", worst);
  return status;
}

// Equal bullets with restitution 1 change velocities.
absl::Status HeadOns(StabilityStage& stage) {
  for (const double speed : {50.0, 500.0}) {
    const std::string config = fmt::format("speed={:g}", speed);
    double worst = 0;
    int escapes = 0;
    const absl::Status status = Shoot(
        stage, "ccd_head_on", config, stage.Repeats(200, 20), kFlight_s,
        [&](double offset) { return scenes::HeadOn(speed, offset); },
        [&](const Run& run, const scenes::Shot& shot) {
          const BodyState one = run.StateOf(shot.bullet), other = run.StateOf(BodyId(shot.bullet.value() + 1));
          escapes += !(one.position.x < other.position.x);
          for (const double v : {one.linear_velocity.x + speed, other.linear_velocity.x - speed}) {
            worst = std::max(worst, std::abs(v) / speed);
          }
        });
    if (!status.ok()) return status;
    stage.Note("ccd_head_on", config, "ccd_escapes", escapes);
    stage.Note("ccd_head_on", config, "ccd_rebound_error", worst);
  }
  return absl::OkStatus();
}

// Pushed on by another, it meets the wall again and again; each blow may keep its energy, and none adds to it. Not by
// stock Bullet, where two bodies' restitutions are multiplied: that wall would give nothing back.
absl::Status Driven(StabilityStage& stage) {
  constexpr double kSpeed = 10;
  const auto energy_in = [](const scenes::Shot& shot, auto speed_of) {
    double sum = 0;
    for (const BodyDef& body : shot.scene.bodies) {
      if (body.motion != Motion::kStatic) sum += body.mass_kg * LengthSquared(speed_of(body)) / 2;
    }
    return sum;
  };
  for (const double driver : {1.0, 5.0, 40.0, 400.0}) {
    const std::string config = fmt::format("speed={:g} driver={:g}", kSpeed, driver);
    double worst = 0;
    const absl::Status status = Shoot(
        stage, "driven", config, stage.Repeats(200, 20), 2,
        [&](double offset) { return scenes::DrivenAtWall(kSpeed, driver, offset); },
        [&](const Run& run, const scenes::Shot& shot) {
          const double before =
              energy_in(shot, [](const BodyDef& body) { return Vec3d(body.initial.linear_velocity); });
          const double after =
              energy_in(shot, [&](const BodyDef& body) { return Vec3d(run.StateOf(body.id).linear_velocity); });
          worst = std::isfinite(after) ? std::max(worst, after / before) : std::numeric_limits<double>::infinity();
        });
    if (!status.ok()) return status;
    stage.Note("driven", config, "energy_kept", worst);
  }
  return absl::OkStatus();
}

absl::Status NearMisses(StabilityStage& stage) {
  for (const double speed : {50.0, 500.0}) {
    const std::string config = fmt::format("speed={:g}", speed);
    double worst = 0;
    const absl::Status status = Shoot(
        stage, "ccd_miss", config, stage.Repeats(200, 20), kFlight_s,
        [&](double offset) { return scenes::NearMiss(speed, offset); },
        [&](const Run& run, const scenes::Shot& shot) {
          const Vec3d v(run.StateOf(shot.bullet).linear_velocity);
          worst = std::max(worst, Length(v - Vec3d{speed, 0, 0}) / speed);
        });
    if (!status.ok()) return status;
    stage.Note("ccd_miss", config, "ccd_miss_deflection", worst);
  }
  return absl::OkStatus();
}

// Events are the world's own, so it is asked directly.
absl::Status Triggers(StabilityStage& stage) {
  const int shots = stage.Repeats(1000, 100);
  for (const double speed : {5.0, 50.0, 500.0}) {
    int once = 0;
    double cpu_s = 0;
    const int steps = static_cast<int>(10 + 60 * 7 / speed);
    for (int i = 0; i < shots; ++i) {
      const scenes::Shot shot = scenes::ThroughTrigger(speed, (i + 0.5) / shots);
      physics::World world({.gravity_m_s2 = shot.scene.gravity_m_s2});
      for (const BodyDef& body : shot.scene.bodies) world.Add(body, body.initial);
      int begins = 0, ends = 0;
      for (int step = 0; step < steps; ++step) {
        const double begin = ThreadCpuSeconds();
        world.Step(1.0 / 60);
        cpu_s += ThreadCpuSeconds() - begin;
        for (const physics::PairEvent& event : world.events()) {
          if (event.trigger) ++(event.begin ? begins : ends);
        }
      }
      once += begins == 1 && ends == 1;
    }
    const std::string config = fmt::format("speed={:g}", speed);
    stage.Note("ccd_trigger", config, "fired_once", static_cast<double>(once) / shots);
    stage.Cost("ccd_trigger", config, cpu_s * 1e6 / (static_cast<double>(shots) * steps));
  }
  return absl::OkStatus();
}

}  // namespace

std::vector<Check> ShotChecks() {
  return {{"ccd_ball", Escapes, true},
          {"ccd_rod", RodEscapes, true},
          {"ccd_guarded", Guarded, true},
          {"ccd_rebound", Rebounds, true},
          {"ccd_head_on", HeadOns, true},
          {"ccd_miss", NearMisses, true},
          {"driven", Driven},
          {"ccd_trigger", Triggers}};
}

}  // namespace tessera::bench
