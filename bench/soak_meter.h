// SoakMeter: reads control plane, agents and workers of a cluster every now and then.
//
// Thread rule: one thread.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bench/soak_series.h"
#include "bench/soak_steps.h"
#include "local_cluster/local_cluster.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::bench {

class SoakMeter {
 public:
  // `cluster` outlives it; `interval_s` lies between two samples.
  SoakMeter(local::LocalCluster& cluster, std::uint32_t hosts, double interval_s)
      : cluster_(cluster), hosts_(hosts), interval_s_(interval_s) {}

  // Takes a sample of each process if it is time. The instance is at rest: nothing is being changed.
  void Look(const v1::Instance& instance, double now_s);

  std::vector<SoakSeries> series() const;
  const SoakSteps& steps() const { return steps_; }
  // Workers that it has seen and that run still, after all should have ended. They are killed.
  std::uint64_t KillLeftWorkers() const;

 private:
  using Life = std::pair<pid_t, std::uint64_t>;  // pid and start time: never used twice
  void Read(const std::string& process, pid_t pid, int load, double now_s);

  local::LocalCluster& cluster_;
  std::uint32_t hosts_;
  double interval_s_, next_s_ = 0;
  std::map<Life, SoakSeries> series_;
  SoakSteps steps_;
};

}  // namespace tessera::bench
