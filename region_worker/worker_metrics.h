// WorkerMetrics: what a worker tells Prometheus. docs/metrics.md lists the names and meanings.
//
// Every series exists from the start. Counting costs an atomic add, a histogram an uncontended lock; the loop does so a
// few times a tick, never per body. Thread rule: the loop writes, the HTTP server reads; the objects lock themselves.
#pragma once

#include <array>
#include <memory>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "net/door.h"
#include "prometheus/counter.h"
#include "prometheus/gauge.h"
#include "prometheus/histogram.h"
#include "prometheus/registry.h"

namespace tessera::worker {

// Why a neighbour's frame was not used.
enum class DropReason : std::uint8_t {
  kMalformed,    // truncated, or not a frame
  kBadBody,      // names a body that it may not, or a state that cannot be
  kNotNeighbor,  // of a region that sends none here, or under another's name
  kMapVersion,   // made under another map
  kOldTick,      // sent again after a link broke; harmless
  kOutOfOrder,   // one before it is missing
  kOther,
};

inline constexpr std::array<std::string_view, 7> kDropReasonNames = {
    "malformed", "bad_body", "not_neighbor", "map_version", "old_tick", "out_of_order", "other"};

// From what Region::Receive says.
DropReason ReasonOf(const absl::Status& status);

// What came of the datagrams at the door of one port.
class DoorMetrics {
 public:
  DoorMetrics(prometheus::Registry& registry, const char* port);
  // `now` counts from the start of the port.
  void Take(const net::DoorStats& now);

 private:
  struct Series {
    prometheus::Counter* counter;
    std::uint64_t net::DoorStats::*count;
  };
  std::vector<Series> series_;
  net::DoorStats before_;
};

class WorkerMetrics {
 public:
  WorkerMetrics();

  std::shared_ptr<prometheus::Registry> registry() const { return registry_; }

 private:
  std::shared_ptr<prometheus::Registry> registry_;

 public:
  prometheus::Gauge& tick;
  prometheus::Counter &ticks, &late_ticks;
  prometheus::Histogram &step, &physics, &prediction, &snapshot_full, &snapshot_delta, &frame_wait;
  prometheus::Gauge &owned, &ghosts, &asleep;
  prometheus::Counter &handovers_in, &handovers_out;
  prometheus::Counter &frame_bytes_in, &frame_bytes_out;
  prometheus::Counter& snapshot_bytes;
  prometheus::Gauge& clients;
  prometheus::Counter &inputs_applied, &inputs_refused, &inputs_late;
  prometheus::Counter &links_of_other_rules, &links_refused;
  std::array<prometheus::Counter*, kDropReasonNames.size()> frames_dropped{};
  prometheus::Counter& nonfinite_bodies;
  prometheus::Gauge &unprotected, &paused, &failover_gap, &takeover_age, &longest_tick, &longest_tick_cpu;
  prometheus::Counter &standby_bytes, &standby_gaps, &failovers, &borders_closed;
  DoorMetrics game_door, link_door;

  void CountDropped(DropReason reason) { frames_dropped[static_cast<std::size_t>(reason)]->Increment(); }
};

}  // namespace tessera::worker
