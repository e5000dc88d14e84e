// Stability of joints: the chain, a closed loop, the cradle, a pendulum, a spring, ragdolls.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "bench/chain_watch.h"
#include "bench/stability_stage.h"
#include "bench/truth.h"
#include "scenes/measured/balls.h"
#include "scenes/measured/linkages.h"

namespace tessera::bench {
namespace {

absl::Status Chains(StabilityStage& stage) {
  for (const double ratio : {1.0, 100.0, 1000.0}) {
    const absl::StatusOr<ChainFigures> figures = SwingChain({.engine = stage.engine(), .config = {}, .hz = 60}, ratio);
    if (!figures.ok()) return figures.status();
    const std::string config = fmt::format("ratio={:g}", ratio);
    stage.Note("chain", config, "chain_gap_m", figures->gap_m, "m");
    if (ratio > 1) stage.Note("chain", config, "chain_period_error", figures->period_error);  // a light one whips
    stage.Cost("chain", config, figures->cpu_us);
  }
  return absl::OkStatus();
}

double WidestGap(const Run& run, const Scene& scene) {
  double widest = 0;
  for (const JointDef& joint : scene.joints) {
    const BodyState a = run.StateOf(joint.body_a);
    const BodyState b = joint.body_b == BodyId() ? BodyState() : run.StateOf(joint.body_b);
    const double gap = scenes::GapOf(joint, a, joint.body_b == BodyId() ? nullptr : &b);
    if (!(gap <= widest)) widest = gap;
  }
  return widest;
}

// The widest gap at any joint of a scene while it runs.
absl::Status Holds(StabilityStage& stage, const std::string& name, const Scene& scene, double seconds) {
  absl::StatusOr<Run> run = stage.Start(scene);
  if (absl::IsUnimplemented(run.status())) return absl::OkStatus();
  if (!run.ok()) return run.status();
  double widest = 0;
  while (run->time_s() < seconds - 1e-6) {
    run->Tick();
    const double gap = WidestGap(*run, scene);
    if (!(gap <= widest)) widest = gap;
  }
  stage.Note(name, "hz=60", "gap_m", widest, "m");
  stage.Note(name, "hz=60", "residual_speed", FastestOf(*run, scene), "m/s");
  stage.Cost(name, "hz=60", run->cpu_us_per_tick());
  return absl::OkStatus();
}

absl::Status Loops(StabilityStage& stage) { return Holds(stage, "closed_loop", scenes::ClosedLoop(), 10); }
absl::Status Figures(StabilityStage& stage) { return Holds(stage, "ragdolls", scenes::Ragdolls(8), 10); }

// Share of the last ball in all momentum after the blow, when it is fastest.
absl::Status NewtonsCradle(StabilityStage& stage) {
  const scenes::Cradle cradle = scenes::NewtonsCradle();
  absl::StatusOr<Run> run = stage.Start(cradle.scene);
  if (!run.ok()) return run.status();
  double fastest = 0, share = 0;
  while (run->time_s() < 2.5) {  // the first ball falls for 1.02 s; the last comes back after 3 s
    run->Tick();
    double sum = 0;
    for (const BodyDef& body : cradle.scene.bodies) sum += Length(Vec3d(run->StateOf(body.id).linear_velocity));
    const double last = Length(Vec3d(run->StateOf(cradle.last_ball).linear_velocity));
    if (last > fastest) {
      fastest = last;
      share = last / sum;
    }
  }
  // From 30 degrees: v = sqrt(2 g l (1 - cos)), with the ball's own inertia beside that of its arm.
  const double arm = 4, truth = std::sqrt(2 * 9.81 * arm * (1 - std::cos(std::numbers::pi / 6)) /
                                          (1 + 0.4 * 0.25 / (arm * arm)));
  stage.Note("cradle", "balls=5", "momentum_share", share);
  stage.Note("cradle", "balls=5", "speed_ratio", fastest / truth);
  stage.Cost("cradle", "balls=5", run->cpu_us_per_tick());
  return absl::OkStatus();
}

// Times at which a sampled motion crosses 0.
class Crossings {
 public:
  void Look(double time, double value) {
    if (before_ * value < 0) times_.push_back(before_s_ + (time - before_s_) * before_ / (before_ - value));
    before_ = value;
    before_s_ = time;
    if (value > 0) largest_ = std::max(largest_, value);
  }
  // Twice the mean time between crossings; infinite below two.
  double period() const {
    if (times_.size() < 2) return std::numeric_limits<double>::infinity();
    return 2 * (times_.back() - times_.front()) / static_cast<double>(times_.size() - 1);
  }
  double TakeLargest() { return std::exchange(largest_, 0); }

 private:
  std::vector<double> times_;
  double before_ = 0, before_s_ = 0, largest_ = 0;
};

absl::Status Pendulum(StabilityStage& stage) {
  constexpr double kAmplitude = 1, kSeconds = 20;
  const scenes::Pendulum pendulum = scenes::RodPendulum(kAmplitude);
  absl::StatusOr<Run> run = stage.Start(pendulum.scene);
  if (!run.ok()) return run.status();
  Crossings crossings;
  const auto angle = [&] {
    const Vec3d arm = Rotate(Quatd(run->StateOf(pendulum.rod).orientation), Vec3d{0, -1, 0});
    return std::atan2(arm.x, -arm.y);
  };
  while (run->time_s() < kSeconds - 1e-6) {
    run->Tick();
    crossings.Look(run->time_s(), angle());
    if (run->time_s() < kSeconds - 3) crossings.TakeLargest();
  }
  const double truth = PendulumPeriod(pendulum.length_m * 2 / 3, pendulum.gravity_m_s2, kAmplitude);
  stage.Note("pendulum", "amplitude=1", "period_error", std::abs(crossings.period() / truth - 1));
  stage.Note("pendulum", "amplitude=1", "amplitude_kept", crossings.TakeLargest() / kAmplitude);
  stage.Cost("pendulum", "amplitude=1", run->cpu_us_per_tick());
  return absl::OkStatus();
}

absl::Status Spring(StabilityStage& stage) {
  for (const double frequency : {1.0, 5.0}) {
    const scenes::SpringMass spring = scenes::MassOnSpring(frequency);
    absl::StatusOr<Run> run = stage.Start(spring.scene);
    if (absl::IsUnimplemented(run.status())) return absl::OkStatus();
    if (!run.ok()) return run.status();
    Crossings crossings;
    const double seconds = 10 / frequency;
    while (run->time_s() < seconds - 1e-6) {
      run->Tick();
      crossings.Look(run->time_s(), run->StateOf(spring.mass).position.x);
      if (run->time_s() < seconds - 1.2 / frequency) crossings.TakeLargest();
    }
    const std::string config = fmt::format("hz={:g}", frequency);
    stage.Note("spring", config, "frequency_error", std::abs(1 / crossings.period() / frequency - 1));
    stage.Note("spring", config, "amplitude_kept", crossings.TakeLargest() / spring.amplitude_m);
    stage.Cost("spring", config, run->cpu_us_per_tick());
  }
  return absl::OkStatus();
}

}  // namespace

std::vector<Check> JointChecks() {
  return {{"chain", Chains, true},         {"closed_loop", Loops, true}, {"ragdolls", Figures, true},
          {"cradle", NewtonsCradle, true}, {"pendulum", Pendulum, true}, {"spring", Spring, true}};
}

}  // namespace tessera::bench
