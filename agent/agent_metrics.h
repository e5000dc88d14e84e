// AgentMetrics: the agent's figures on /metrics; docs/metrics.md lists them. Thread rule: any thread.
#pragma once

#include <map>
#include <memory>

#include "agent/state_dir.h"
#include "agent/supervisor.h"
#include "prometheus/counter.h"
#include "prometheus/gauge.h"
#include "prometheus/registry.h"

namespace tessera::agent {

class AgentMetrics {
 public:
  AgentMetrics();

  const std::shared_ptr<prometheus::Registry>& registry() const { return registry_; }
  void SetWorkers(std::size_t count) { workers_.Set(static_cast<double>(count)); }
  // True: its state folder does not take this file.
  void SetStateFailing(StateFile file, bool failing) { state_failing_.at(file)->Set(failing ? 1 : 0); }
  // True: a file of workers that could not be read lies there.
  void SetWorkersAside(bool aside) { workers_aside_.Set(aside ? 1 : 0); }
  void SetConnected(bool connected) { connected_.Set(connected ? 1 : 0); }
  void Started() { starts_.Increment(); }
  void Exited(ExitResult result);
  void Heartbeat() { heartbeats_.Increment(); }
  // A worker's connection was ended, for it said too much.
  void CutOff() { cut_off_.Increment(); }
  // Seconds that are left of this host's certificate, of how many. Both are 0 where it has none.
  void SetCertificate(double left_s, double life_s) {
    certificate_left_.Set(left_s);
    certificate_life_.Set(life_s);
  }

 private:
  std::shared_ptr<prometheus::Registry> registry_;
  prometheus::Gauge &workers_, &connected_, &workers_aside_, &certificate_left_, &certificate_life_;
  prometheus::Counter &starts_, &heartbeats_, &cut_off_, &clean_, &error_, &signal_;
  std::map<StateFile, prometheus::Gauge*> state_failing_;
};

}  // namespace tessera::agent
