// FiguresFeed: sends the clients of a region, once a second, what its work costs: the worker's metrics, so that a game
// can show them without the operators' port.
//
//   feed.SendIfDue(region, port, now);   // in each round of the loop
//
// Thread rule: one thread.
#pragma once

#include <chrono>

#include "core/region/region.h"
#include "core/replication/region_figures.h"
#include "region_worker/core/time.h"
#include "region_worker/game_port.h"
#include "region_worker/worker_metrics.h"

namespace tessera::worker {

// As /metrics would show them now; memory is read from /proc.
replication::RegionFigures FiguresOf(const region::Region& region, const WorkerMetrics& metrics, std::size_t clients);

class FiguresFeed {
 public:
  static constexpr Duration kInterval = std::chrono::seconds(1);

  explicit FiguresFeed(const WorkerMetrics& metrics) : metrics_(metrics) {}
  void SendIfDue(const region::Region& region, GamePort& port, TimePoint now);

 private:
  const WorkerMetrics& metrics_;
  TimePoint due_{};
};

}  // namespace tessera::worker
