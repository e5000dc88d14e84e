// Single contacts that have a closed form: friction's limit, rolling, a blow, recovery from overlap, inner edges.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/stability_stage.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/impacts.h"

namespace tessera::bench {
namespace {

constexpr double kGravity = 9.81;

double Speed(const BodyState& state) { return Length(Vec3d(state.linear_velocity)); }

absl::Status Slopes(StabilityStage& stage) {
  constexpr double kSeconds = 5, kFriction = 0.5;
  for (const double share : {0.99, 1.01}) {
    const Scene scene = scenes::SlopeAtLimit(share);
    absl::StatusOr<Run> run = stage.Start(scene);
    if (!run.ok()) return run.status();
    run->Seconds(kSeconds);
    const double slid = DisplacementOf(*run, scene).any_m;
    const std::string config = fmt::format("share={:g}", share);
    if (share < 1) {
      stage.Note("slope", config, "slid_m", slid, "m");
    } else {
      const double angle = share * std::atan(kFriction);
      const double truth = kGravity * (std::sin(angle) - kFriction * std::cos(angle)) * kSeconds * kSeconds / 2;
      stage.Note("slope", config, "slide_error", std::abs(slid / truth - 1));
    }
    stage.Cost("slope", config, run->cpu_us_per_tick());
  }
  return absl::OkStatus();
}

// Friction acts until the ball rolls: v = 5/7 v0 from t = 2/7 v0 / (mu g) on.
absl::Status SlidingToRolling(StabilityStage& stage) {
  constexpr double kStart = 7, kEnd = 5, kRadius = 0.5, kFriction = 0.5, kSeconds = 3;
  const Scene scene = scenes::SlidingToRolling();
  absl::StatusOr<Run> run = stage.Start(scene);
  if (!run.ok()) return run.status();
  run->Seconds(kSeconds);
  const BodyState state = run->StateOf(BodyId(2));
  const double slips_s = 2.0 / 7 * kStart / (kFriction * kGravity);
  const double way = (kStart + kEnd) / 2 * slips_s + kEnd * (kSeconds - slips_s);
  stage.Note("sliding_to_rolling", "v0=7", "speed_error", std::abs(state.linear_velocity.x / kEnd - 1));
  stage.Note("sliding_to_rolling", "v0=7", "spin_error", std::abs(-state.angular_velocity.z * kRadius / kEnd - 1));
  stage.Note("sliding_to_rolling", "v0=7", "way_error", std::abs(state.position.x / way - 1));
  stage.Cost("sliding_to_rolling", "v0=7", run->cpu_us_per_tick());
  return absl::OkStatus();
}

// J = (1 + e) v / (1/m + a^2/I), a the level distance from the centre to the end that strikes.
absl::Status ObliqueRods(StabilityStage& stage) {
  for (const double restitution : {0.0, 0.5, 1.0}) {
    const scenes::RodDrop drop = scenes::ObliqueRod(restitution);
    absl::StatusOr<Run> run = stage.Start(drop.scene);
    if (!run.ok()) return run.status();
    const double inertia = scenes::BodyOf(drop.scene, drop.rod).inertia_kg_m2->z;
    const double arm = drop.half_length_m * std::cos(drop.tilt_rad);
    const double impulse = (1 + restitution) * drop.speed_m_s / (1 / drop.mass_kg + arm * arm / inertia);
    const double v = -drop.speed_m_s + impulse / drop.mass_kg, w = impulse * arm / inertia;
    run->Seconds(0.1);  // it strikes after .067 s
    const BodyState state = run->StateOf(drop.rod);
    const std::string config = fmt::format("e={:g}", restitution);
    stage.Note("oblique_rod", config, "velocity_error_m_s", std::abs(state.linear_velocity.y - v), "m/s");
    stage.Note("oblique_rod", config, "spin_error", std::abs(Length(Vec3d(state.angular_velocity)) / w - 1));
    stage.Cost("oblique_rod", config, run->cpu_us_per_tick());
  }
  return absl::OkStatus();
}

absl::Status Overlaps(StabilityStage& stage) {
  for (const double share : {0.25, 0.9}) {
    const Scene scene = scenes::Overlapping(share);
    absl::StatusOr<Run> run = stage.Start(scene);
    if (!run.ok()) return run.status();
    double fastest = 0;
    for (int tick = 0; tick < 300; ++tick) {
      run->Tick();
      fastest = std::max(fastest, Length(Vec3d(run->StateOf(BodyId(3)).linear_velocity) -
                                         Vec3d(run->StateOf(BodyId(2)).linear_velocity)));
    }
    const double apart = run->StateOf(BodyId(3)).position.y - run->StateOf(BodyId(2)).position.y;
    const std::string config = fmt::format("overlap={:g}", share);
    stage.Note("overlap", config, "separation_speed_m_s", fastest, "m/s");
    stage.Note("overlap", config, "distance_after_5s_m", apart, "m");
    stage.Cost("overlap", config, run->cpu_us_per_tick());
  }
  return absl::OkStatus();
}

absl::Status FlatMesh(StabilityStage& stage) {
  const Scene scene = scenes::BallOverFlatMesh();
  absl::StatusOr<Run> run = stage.Start(scene);
  if (!run.ok()) return run.status();
  const BodyState start = scenes::BodyOf(scene, BodyId(2)).initial;
  double bump = 0;
  for (int tick = 0; tick < 420; ++tick) {
    run->Tick();
    bump = std::max(bump, std::abs(run->StateOf(BodyId(2)).position.y - start.position.y));
  }
  const BodyState end = run->StateOf(BodyId(2));
  const Vec3d truth = start.position + Vec3d(start.linear_velocity) * 7.0;
  stage.Note("flat_mesh", "hz=60", "bump_m", bump, "m");
  stage.Note("flat_mesh", "hz=60", "speed_error", std::abs(Speed(end) / Speed(start) - 1));
  stage.Note("flat_mesh", "hz=60", "off_course_m", std::abs(end.position.z - truth.z), "m");
  stage.Cost("flat_mesh", "hz=60", run->cpu_us_per_tick());
  return absl::OkStatus();
}

// It loses energy by friction and blows, and never gains any.
absl::Status Needle(StabilityStage& stage) {
  const Scene scene = scenes::InertiaNeedle();
  const BodyDef& needle = scenes::BodyOf(scene, BodyId(2));
  const auto energy = [&](const BodyState& s) {
    const Vec3d w = Rotate(Conjugate(Quatd(s.orientation)), Vec3d(s.angular_velocity)), i = *needle.inertia_kg_m2;
    return kGravity * s.position.y + LengthSquared(Vec3d(s.linear_velocity)) / 2 +
           (i.x * w.x * w.x + i.y * w.y * w.y + i.z * w.z * w.z) / 2;
  };
  absl::StatusOr<Run> run = stage.Start(scene);
  if (!run.ok()) return run.status();
  const double start = energy(needle.initial);
  double gain = -1;
  bool finite = true;
  for (int tick = 0; tick < 600; ++tick) {
    run->Tick();
    const BodyState state = run->StateOf(needle.id);
    finite = finite && IsFinite(state);
    gain = std::max(gain, energy(state) / start - 1);
  }
  stage.Note("needle", "inertia=1000:1", "finite", finite);
  stage.Note("needle", "inertia=1000:1", "energy_gain", gain);
  stage.Note("needle", "inertia=1000:1", "residual_speed", FastestOf(*run, scene), "m/s");
  stage.Cost("needle", "inertia=1000:1", run->cpu_us_per_tick());
  return absl::OkStatus();
}

}  // namespace

std::vector<Check> ContactChecks() {
  return {{"slope", Slopes, true},
          {"sliding_to_rolling", SlidingToRolling, true},
          {"oblique_rod", ObliqueRods, true},
          {"overlap", Overlaps, true},
          {"flat_mesh", FlatMesh, true},
          {"needle", Needle, true}};
}

}  // namespace tessera::bench
