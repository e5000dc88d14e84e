#include "agent/agent_metrics.h"

#include <string>

namespace tessera::agent {
namespace {

prometheus::Gauge& Gauge(prometheus::Registry& registry, const std::string& name, const std::string& help,
                         const prometheus::Labels& labels = {}) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add(labels);
}

prometheus::Counter& Counter(prometheus::Registry& registry, const std::string& name, const std::string& help,
                             const prometheus::Labels& labels = {}) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add(labels);
}

constexpr char kExits[] = "tessera_agent_worker_exits_total";
constexpr char kExitsHelp[] = "Workers ended";

}  // namespace

AgentMetrics::AgentMetrics()
    : registry_(std::make_shared<prometheus::Registry>(prometheus::Registry::InsertBehavior::Merge)),
      workers_(Gauge(*registry_, "tessera_agent_workers", "Workers that run")),
      connected_(Gauge(*registry_, "tessera_agent_control_connected", "1 while connected to the control plane")),
      workers_aside_(Gauge(*registry_, "tessera_agent_workers_file_set_aside",
                           "1 while a workers.json that could not be read lies in the state folder, else 0")),
      certificate_left_(Gauge(*registry_, "tessera_agent_certificate_left_seconds",
                              "Life that is left of this host's certificate; 0: it has none")),
      certificate_life_(
          Gauge(*registry_, "tessera_agent_certificate_life_seconds", "Whole life of this host's certificate")),
      starts_(Counter(*registry_, "tessera_agent_worker_starts_total", "Workers started")),
      heartbeats_(Counter(*registry_, "tessera_agent_heartbeats_total", "Heartbeats sent")),
      cut_off_(Counter(*registry_, "tessera_agent_workers_cut_off_total",
                       "Connections of workers that were ended because they said too much")),
      clean_(Counter(*registry_, kExits, kExitsHelp, {{"result", "clean"}})),
      error_(Counter(*registry_, kExits, kExitsHelp, {{"result", "error"}})),
      signal_(Counter(*registry_, kExits, kExitsHelp, {{"result", "signal"}})) {
  for (const StateFile file : kStateFiles) {
    state_failing_[file] =
        &Gauge(*registry_, "tessera_agent_state_failing",
               "1 if the last write of this file to the agent's state folder failed, else 0", {{"file", NameOf(file)}});
  }
}

void AgentMetrics::Exited(ExitResult result) {
  switch (result) {
    case ExitResult::kClean:
      return clean_.Increment();
    case ExitResult::kError:
      return error_.Increment();
    case ExitResult::kSignal:
      return signal_.Increment();
  }
}

}  // namespace tessera::agent
