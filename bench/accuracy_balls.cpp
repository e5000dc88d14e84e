// Scenes 4 to 7: balls that bounce, roll and pile up.
#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/accuracy_scenes.h"
#include "scenes/measured/balls.h"

namespace tessera::bench {
namespace {

// Potential and kinetic energy of all dynamic bodies. They must be balls: the inertia is 2/5 m r^2 about any axis.
double EnergyOf(const Run& run, const Scene& scene, double radius_m) {
  double energy = 0;
  for (const BodyDef& body : scene.bodies) {
    if (body.motion == Motion::kStatic) continue;
    const BodyState state = run.StateOf(body.id);
    energy +=
        body.mass_kg * (-scene.gravity_m_s2.y * state.position.y + LengthSquared(Vec3d(state.linear_velocity)) / 2 +
                        0.2 * radius_m * radius_m * LengthSquared(Vec3d(state.angular_velocity)));
  }
  return energy;
}

// Root mean square of (E - E0) / E0, looked at every 1/60 s.
absl::StatusOr<Outcome> EnergyKept(const Trial& trial, const Scene& scene, double seconds, const char* metric) {
  absl::StatusOr<Run> run = Run::Start(trial, scene);
  if (!run.ok()) return run.status();
  const double start = EnergyOf(*run, scene, 0.1);
  double squares = 0, end = start;
  int looks = 0;
  while (run->time_s() < seconds - 1e-9) {
    run->Tick();
    end = EnergyOf(*run, scene, 0.1);
    squares += (end / start - 1) * (end / start - 1);
    ++looks;
  }
  const double rms = std::sqrt(squares / looks);
  return Outcome{std::isfinite(rms) ? rms : kBroken,
                 {{metric, rms, "1"}, {"energy_error_at_end", end / start - 1, "1"}},
                 run->cpu_us_per_tick()};
}

absl::StatusOr<Outcome> Rolling(const Trial& trial, bool oblique) {
  constexpr double kSeconds = 4;
  const scenes::Rolling rolling = scenes::RollingBalls(oblique);
  absl::StatusOr<Run> run = Run::Start(trial, rolling.scene);
  if (!run.ok()) return run.status();
  run->Push(rolling.box, rolling.force_n);
  run->Seconds(kSeconds);
  const auto error = [&](BodyId id, double acceleration) {
    const Vec3d truth = rolling.direction * (acceleration * kSeconds);
    return Length(Vec3d(run->StateOf(id).linear_velocity) - truth) / Length(truth);
  };
  const double box = error(rolling.box, rolling.box_acceleration_m_s2);
  double balls = 0;
  for (std::uint64_t id = rolling.first_ball.value(); id <= rolling.last_ball.value(); ++id) {
    balls = std::max(balls, error(BodyId(id), rolling.ball_acceleration_m_s2));
  }
  const double worst = std::max(box, balls);
  return Outcome{std::isfinite(worst) ? worst : kBroken,
                 {{"box_acceleration_error", box, "1"}, {"ball_acceleration_error", balls, "1"}},
                 run->cpu_us_per_tick()};
}

struct PenetrationSum {
  double squares_m2 = 0, deepest_m = 0;
};

// Between balls, and into the ground.
PenetrationSum PenetrationOf(const Run& run) {
  constexpr double kRadius = scenes::kPileRadius_m;
  std::vector<Vec3d> places;
  places.reserve(scenes::kPileBalls);
  for (int i = 0; i < scenes::kPileBalls; ++i) {
    places.push_back(run.StateOf(BodyId(static_cast<std::uint64_t>(i) + 2)).position);
  }
  PenetrationSum sum;
  const auto add = [&sum](double depth) {
    // Whatever is not finite must not pass for no penetration.
    if (depth <= 0) return;
    sum.squares_m2 += depth * depth;
    sum.deepest_m = std::max(sum.deepest_m, depth);
  };
  for (std::size_t i = 0; i < places.size(); ++i) {
    add(kRadius - places[i].y);
    for (std::size_t j = 0; j < i; ++j) {
      const Vec3d apart = places[i] - places[j];
      const double squared = LengthSquared(apart);
      if (!(squared >= 4 * kRadius * kRadius)) add(2 * kRadius - std::sqrt(squared));
    }
  }
  return sum;
}

absl::StatusOr<Outcome> Pile(const Trial& trial) {
  constexpr double kSeconds = 10;
  const Scene scene = scenes::BallPile(false);
  absl::StatusOr<Run> run = Run::Start(trial, scene);
  if (!run.ok()) return run.status();
  const double start = EnergyOf(*run, scene, scenes::kPileRadius_m);
  double squares = 0, deepest = 0, gain = 0;
  int looks = 0;
  while (run->time_s() < kSeconds - 1e-9) {
    run->Tick();
    const PenetrationSum now = PenetrationOf(*run);
    squares += now.squares_m2;
    deepest = std::max(deepest, now.deepest_m);
    gain = std::max(gain, EnergyOf(*run, scene, scenes::kPileRadius_m) / start - 1);
    ++looks;
  }
  const double mean = squares / looks;
  // Balls without restitution gain no energy: a pile that is blown apart does not touch, and is no success.
  const bool broken = !std::isfinite(mean) || !(gain < 0.01);
  return Outcome{broken ? kBroken : mean,
                 {{"penetration_m2", mean, "1"}, {"deepest_m", deepest, "m"}, {"energy_gain", gain, "1"}},
                 run->cpu_us_per_tick()};
}

}  // namespace

std::vector<AccuracyScene> BallScenes() {
  return {
      {.name = "bounce",
       .error_is = "energy, relative RMS error",
       .floor = 1e-6,
       .mujoco = true,
       .run = [](const Trial& trial) { return EnergyKept(trial, scenes::Bounce(), 20, "bounce_energy_rms"); }},
      {.name = "rolling",
       .error_is = "speed after 4 s, relative error",
       .floor = 1e-5,
       .run = [](const Trial& trial) { return Rolling(trial, false); }},
      {.name = "rolling_oblique",
       .error_is = "speed after 4 s, relative error",
       .floor = 1e-5,
       .run = [](const Trial& trial) { return Rolling(trial, true); }},
      {.name = "666", .error_is = "sum of squared penetration, m^2", .floor = 1e-9, .direct = false, .run = Pile},
      {.name = "elastic_666",
       .error_is = "energy, relative RMS error",
       .floor = 1e-6,
       .direct = false,
       .run = [](const Trial& trial) { return EnergyKept(trial, scenes::BallPile(true), 10, "energy_rms"); }},
  };
}

}  // namespace tessera::bench
