#include "bench/trial.h"
#include "bench/thread_cpu.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tessera::bench {

std::string ConfigName(const Trial& trial) {
  std::string name = fmt::format("hz={:g}", trial.hz);
  if (trial.config.substeps > 0) name += fmt::format(" substeps={}", trial.config.substeps);
  if (trial.config.iterations > 0) name += fmt::format(" iterations={}", trial.config.iterations);
  if (trial.config.direct) name += " direct";
  if (trial.config.rk4) name += " rk4";
  return name;
}

absl::StatusOr<Run> Run::Start(const Trial& trial, const Scene& scene) {
  Run run;
  run.engine_ = MakeEngine(trial.engine, trial.config);
  if (run.engine_ == nullptr) return absl::UnavailableError(fmt::format("{} was not built", EngineName(trial.engine)));
  run.hz_ = trial.hz;
  if (absl::Status status = run.engine_->Load(scene); !status.ok()) return status;
  return run;
}

void Run::Steps(int n) {
  const double begin = ThreadCpuSeconds();
  for (int i = 0; i < n; ++i) {
    for (const Pushed& push : pushes_) engine_->ApplyForce(push.body, push.force_n, {});
    engine_->Step(1 / hz_);
  }
  cpu_s_ += ThreadCpuSeconds() - begin;
  steps_ += n;
}

void Run::Seconds(double seconds) { Steps(static_cast<int>(std::lround(seconds * hz_))); }

void Run::Until(double time_s) {
  const long until = static_cast<long>(std::ceil(time_s * hz_ - 1e-6));
  if (until > steps_) Steps(static_cast<int>(until - steps_));
}

void Run::Tick() {
  const long until = static_cast<long>((std::floor(time_s() * 60 + 1e-6) + 1) * hz_ / 60 + 1e-6);
  Steps(static_cast<int>(std::max(1L, until - steps_)));
}

double Run::cpu_us_per_tick() const { return steps_ == 0 ? 0 : cpu_s_ * 1e6 / (time_s() * 60); }

bool IsFinite(const BodyState& state) {
  return IsFinite(state.position) && IsFinite(Quatd(state.orientation)) && IsFinite(state.linear_velocity) &&
         IsFinite(state.angular_velocity);
}

}  // namespace tessera::bench
