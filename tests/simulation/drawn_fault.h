// DrawnFault: what a fault of a deployment is, whatever its kinds are: when it begins, how long it lasts, whom it
// strikes. Thread rule: free functions on values.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/simulation/deployment.h"

namespace tessera::simulation {

template <class Kind>
struct DrawnFault {
  Kind kind{};
  Micros after = 0;  // the one before has begun
  Micros lasts = 0;
  std::uint32_t whom = 0;  // a host, a region or a control plane, by a number to be taken modulo how many there are
  double strength = 0;     // 0 to 1
};

// " agent dies (+120 ms, for 800 ms), scale (+5 ms, for 40 ms)". `names`: by kind.
template <class Kind, std::size_t kKinds>
std::string FaultsText(const std::vector<DrawnFault<Kind>>& faults, const std::array<const char*, kKinds>& names) {
  std::string text;
  for (const DrawnFault<Kind>& fault : faults) {
    absl::StrAppend(&text, text.empty() ? " " : ", ", names[static_cast<std::size_t>(fault.kind)], " (+",
                    fault.after / 1000, " ms, for ", fault.lasts / 1000, " ms)");
  }
  return text;
}

// Any worker, or all of one host, may be taken from a deployment that is still (Deployment::Still): each region has a
// standby that lives on, by `whole_host` on another host.
inline bool StandbysOutlive(Deployment& deployment, bool whole_host) {
  const std::vector<SimulatedWorker*> workers = deployment.Workers();
  return workers.size() > 1 && std::ranges::all_of(workers, [&](const SimulatedWorker* worker) {
           const SimulatedWorker* standby = deployment.Find(worker->order().standby);
           return standby != nullptr && (!whole_host || standby->place() != worker->place());
         });
}

}  // namespace tessera::simulation
