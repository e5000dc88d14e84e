// HeirLog: this region's tick log on its way to the heir, and what the heir has of it.
//
// Follows the link: whenever there is a new one, or the heir has a gap, the log begins anew with a whole state. An heir
// that takes nothing for kJam is not waited for: nothing more is sent, the region goes on unprotected, and it begins
// anew once the heir has caught up. As long as there is an heir, the region confirms nothing that the heir lacks: its
// copy, however old, is all that there is if the region dies.
//
//   HeirLog log(links, region, lease, metrics);
//   log.SetHeir(RegionId(2));
//   each round: log.Follow(now);   after a step: log.Send(result.log, now);
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "core/region/region.h"
#include "region_worker/lease.h"
#include "region_worker/link_port.h"
#include "region_worker/worker_metrics.h"

namespace tessera::worker {

class HeirLog {
 public:
  static constexpr Duration kJam = std::chrono::seconds(2);

  HeirLog(LinkPort& links, region::Region& region, Lease& lease, WorkerMetrics& metrics)
      : links_(links), region_(region), lease_(lease), metrics_(metrics) {}

  // RegionId(): none; then no lease is needed.
  void SetHeir(RegionId heir);
  RegionId heir() const { return heir_; }
  // Begins as the link comes, and ends as it goes.
  void Follow(TimePoint now);
  // The log of the tick that was just stepped; empty without an heir.
  void Send(std::span<const std::uint8_t> log, Tick tick, TimePoint now);
  // What the heir says.
  void OnTaken(RegionId from, Tick tick);
  void OnAgain(RegionId from);

  // Has an heir that does not have a whole tick.
  bool unprotected() const { return heir_ != RegionId() && !taken_; }
  Tick acknowledged() const { return taken_.value_or(Tick()); }
  std::uint64_t bytes_sent() const { return bytes_sent_; }

 private:
  struct Sent {
    Tick tick;
    TimePoint at;
  };
  void Begin();
  void End();

  LinkPort& links_;
  region::Region& region_;
  Lease& lease_;
  WorkerMetrics& metrics_;
  RegionId heir_{};
  net::PeerHandle link_{};  // over which the log goes; PeerHandle(): nowhere
  bool jammed_ = false;
  std::deque<Sent> sent_;  // not taken, oldest first
  std::optional<Tick> taken_;
  std::uint64_t bytes_sent_ = 0;
};

}  // namespace tessera::worker
