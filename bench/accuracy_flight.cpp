// Scenes 1 to 3: what nothing touches, and a top on its tip.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "bench/accuracy_scenes.h"
#include "bench/truth.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/flight.h"

namespace tessera::bench {
namespace {

absl::StatusOr<Outcome> FreeFall(const Trial& trial) {
  absl::StatusOr<Run> run = Run::Start(trial, scenes::FreeFall());
  if (!run.ok()) return run.status();
  run->Seconds(1);
  const double error = std::abs(run->StateOf(scenes::kFaller).position.y - 95);
  return Outcome{error, {{"free_fall_error_m", error, "m"}}, run->cpu_us_per_tick()};
}

// How far a free body's energy and angular momentum have come from where they began, as shares of it.
class SpinWatch {
 public:
  SpinWatch(Vec3d inertia, const BodyState& start)
      : inertia_(inertia), energy_(EnergyOf(start)), momentum_(MomentumOf(start)) {}

  void Look(const BodyState& state) {
    if (!IsFinite(state)) energy_error_ = momentum_error_ = kBroken;
    energy_error_ = std::max(energy_error_, std::abs(EnergyOf(state) / energy_ - 1));
    momentum_error_ = std::max(momentum_error_, Length(MomentumOf(state) - momentum_) / Length(momentum_));
  }
  double energy_error() const { return energy_error_; }
  double momentum_error() const { return momentum_error_; }

 private:
  double EnergyOf(const BodyState& s) const {
    return SpinEnergy(inertia_, Quatd(s.orientation), Vec3d(s.angular_velocity));
  }
  Vec3d MomentumOf(const BodyState& s) const {
    return AngularMomentum(inertia_, Quatd(s.orientation), Vec3d(s.angular_velocity));
  }

  Vec3d inertia_;
  double energy_;
  Vec3d momentum_;
  double energy_error_ = 0, momentum_error_ = 0;
};

absl::StatusOr<Outcome> FreeBox(const Trial& trial, bool simple) {
  constexpr int kSeconds = 10;
  const Vec3d inertia{10.0 / 12 * 0.97, 10.0 / 12 * 0.82, 10.0 / 12 * 0.17};
  const Scene scene = scenes::FreeBox(simple);
  absl::StatusOr<Run> run = Run::Start(trial, scene);
  if (!run.ok()) return run.status();
  const BodyState& start = scenes::BodyOf(scene, scenes::kFreeBox).initial;
  SpinWatch watch(inertia, start);
  double position_error = 0;
  for (int second = 1; second <= kSeconds; ++second) {
    run->Seconds(1);
    const BodyState state = run->StateOf(scenes::kFreeBox);
    watch.Look(state);
    const double t = second;
    const Vec3d truth = Vec3d(start.linear_velocity) * t + scene.gravity_m_s2 * (t * t / 2);
    position_error = std::max(position_error, Length(state.position - truth) / Length(truth));
  }
  const double error = std::max({position_error, watch.energy_error(), watch.momentum_error()});
  return Outcome{error,
                 {{"position_error", position_error, "1"},
                  {"energy_error", watch.energy_error(), "1"},
                  {"momentum_error", watch.momentum_error(), "1"}},
                 run->cpu_us_per_tick()};
}

// --- Scene 2

constexpr Vec3d kHandleInertia{1, 2, 3};
constexpr double kHandleSeconds = 20, kLook_s = 0.1;

struct HandleTruth {
  Quatd attitude;
  int flips = 0;
};

// The handle flips when the axis that it mainly turns about, y, or z in the stable twin, points the other way.
bool Upright(Quatd orientation, bool stable) {
  return stable ? Rotate(orientation, Vec3d{0, 0, 1}).z > 0 : Rotate(orientation, Vec3d{0, 1, 0}).y > 0;
}

const HandleTruth& TruthOf(bool stable) {
  static std::map<bool, HandleTruth> known;
  auto [entry, is_new] = known.try_emplace(stable);
  if (is_new) {
    const BodyState start = scenes::THandle(stable).bodies[0].initial;
    Spin spin{Quatd(start.orientation), Vec3d(start.angular_velocity)};
    bool up = true;
    for (int look = 0; look < std::lround(kHandleSeconds / kLook_s); ++look) {
      spin = SpinAfter(kHandleInertia, spin, kLook_s, 2e-5);
      if (Upright(spin.orientation, stable) != up) ++entry->second.flips;
      up = Upright(spin.orientation, stable);
    }
    entry->second.attitude = spin.orientation;
  }
  return entry->second;
}

absl::StatusOr<Outcome> Handle(const Trial& trial, bool stable) {
  const Scene scene = scenes::THandle(stable);
  absl::StatusOr<Run> run = Run::Start(trial, scene);
  if (!run.ok()) return run.status();
  SpinWatch watch(kHandleInertia, scene.bodies[0].initial);
  int flips = 0;
  bool up = true;
  for (int look = 0; look < std::lround(kHandleSeconds / kLook_s); ++look) {
    run->Until((look + 1) * kLook_s);
    const BodyState state = run->StateOf(scenes::kTHandle);
    watch.Look(state);
    if (Upright(Quatd(state.orientation), stable) != up) ++flips;
    up = Upright(Quatd(state.orientation), stable);
  }
  const HandleTruth& truth = TruthOf(stable);
  const double attitude_error = AngleBetween(Quatd(run->StateOf(scenes::kTHandle).orientation), truth.attitude);
  const double flip_error = std::abs(flips - truth.flips) / std::max(1.0, static_cast<double>(truth.flips));
  return Outcome{std::max({watch.energy_error(), watch.momentum_error(), flip_error}),
                 {{"energy_error", watch.energy_error(), "1"},
                  {"momentum_error", watch.momentum_error(), "1"},
                  {"flips", static_cast<double>(flips), "1"},
                  {"t_handle_attitude_error_rad", attitude_error, "rad"}},
                 run->cpu_us_per_tick()};
}

absl::StatusOr<Outcome> HandleForTenMinutes(const Trial& trial) {
  const Scene scene = scenes::THandle();
  absl::StatusOr<Run> run = Run::Start(trial, scene);
  if (!run.ok()) return run.status();
  SpinWatch watch(kHandleInertia, scene.bodies[0].initial);
  for (int second = 0; second < 600; ++second) {
    run->Seconds(1);
    watch.Look(run->StateOf(scenes::kTHandle));
  }
  return Outcome{
      std::max(watch.energy_error(), watch.momentum_error()),
      {{"t_handle_energy_error", watch.energy_error(), "1"}, {"t_handle_momentum_error", watch.momentum_error(), "1"}},
      run->cpu_us_per_tick()};
}

// --- Scene 3: the angle by which the axis has gone round from .5 s to 5.5 s.

absl::StatusOr<Outcome> Top(const Trial& trial) {
  constexpr double kPi = std::numbers::pi;
  const scenes::SpinningTop top = scenes::MakeSpinningTop();
  absl::StatusOr<Run> run = Run::Start(trial, top.scene);
  if (!run.ok()) return run.status();
  const auto axis = [&] { return Rotate(Quatd(run->StateOf(top.top).orientation), Vec3d{0, 1, 0}); };
  const auto azimuth = [&] { return std::atan2(-axis().z, axis().x); };  // counted as a turn about +y
  run->Until(0.5);
  const double start_s = run->time_s();
  double before = azimuth(), turned = 0, tilt_error = 0;
  for (int look = 1; look <= 50; ++look) {
    run->Until(0.5 + look * 0.1);
    const double now = azimuth();
    turned += std::remainder(now - before, 2 * kPi);
    before = now;
    tilt_error = std::max(tilt_error, std::abs(std::acos(std::clamp(axis().y, -1.0, 1.0)) - kPi / 12));
  }
  const bool finite = IsFinite(run->StateOf(top.top));
  const double error = finite ? std::abs(turned / (run->time_s() - start_s) / top.precession_rad_s - 1) : kBroken;
  return Outcome{
      error, {{"precession_error", error, "1"}, {"tilt_error_rad", tilt_error, "rad"}}, run->cpu_us_per_tick()};
}

}  // namespace

std::vector<AccuracyScene> FlightScenes() {
  const auto spin = "largest share of position, energy, angular momentum lost";
  return {
      {.name = "free_fall", .error_is = "m", .sweep = Sweep::kNone, .mujoco = true, .run = FreeFall},
      {.name = "free_box",
       .error_is = spin,
       .floor = 1e-6,
       .sweep = Sweep::kStep,
       .mujoco = true,
       .run = [](const Trial& trial) { return FreeBox(trial, false); }},
      {.name = "free_box_simple",
       .error_is = spin,
       .floor = 1e-6,
       .sweep = Sweep::kStep,
       .mujoco = true,
       .run = [](const Trial& trial) { return FreeBox(trial, true); }},
      {.name = "t_handle",
       .error_is = "share of energy, angular momentum, flips lost",
       .floor = 1e-6,
       .sweep = Sweep::kStep,
       .mujoco = true,
       .run = [](const Trial& trial) { return Handle(trial, false); }},
      {.name = "t_handle_stable",
       .error_is = "share of energy, angular momentum lost",
       .floor = 1e-6,
       .sweep = Sweep::kStep,
       .mujoco = true,
       .run = [](const Trial& trial) { return Handle(trial, true); }},
      {.name = "t_handle_10min",
       .error_is = "share of energy, angular momentum lost",
       .sweep = Sweep::kNone,
       .mujoco = true,
       .run = HandleForTenMinutes},
      {.name = "top", .error_is = "rate of precession, relative error", .floor = 1e-6, .mujoco = true, .run = Top},
  };
}

}  // namespace tessera::bench
