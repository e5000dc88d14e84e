// The control planes of a Deployment.
#include <algorithm>

#include "control_plane/cluster/queries.h"
#include "tests/simulation/deployment.h"

namespace tessera::simulation {

SimulatedControl& Deployment::control() const {
  const auto leads = std::ranges::find_if(controls_, [](const auto& control) { return control->leads(); });
  if (leads != controls_.end()) return **leads;
  const auto alive = std::ranges::find_if(controls_, [](const auto& control) { return control->alive(); });
  return alive != controls_.end() ? **alive : *controls_.front();
}

void Deployment::StartControls() {
  for (const auto& control : controls_) {
    if (!control->running()) control->Start();
  }
}

void Deployment::KillControls() {
  for (const auto& control : controls_) control->Kill();
}

void Deployment::BeginFrom(const std::string& backup) {
  KillControls();
  if (!store_.BeginFrom(backup)) invariants_->Problem(tick(), "the backup cannot be restored");
  StartControls();
}

Said Deployment::SaidBy(const SimulatedControl& control) const {
  const auto instance = GetInstance(control.cluster().state(), id_);
  if (!instance.ok()) return Said::kOver;
  switch (instance->state()) {
    case v1::INSTANCE_STATE_RUNNING:
      return Said::kRunning;
    case v1::INSTANCE_STATE_DEGRADED:
      return Said::kDegraded;
    case v1::INSTANCE_STATE_STOPPING:
    case v1::INSTANCE_STATE_ENDED:
    case v1::INSTANCE_STATE_FAILED:
      return Said::kOver;
    default:
      return Said::kOther;
  }
}

}  // namespace tessera::simulation
