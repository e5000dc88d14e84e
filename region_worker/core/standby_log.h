// StandbyLog: this region's tick log on its way to the standby, what the standby has of it, and the lease that its
// acknowledgements renew.
//
// Follows the link: whenever there is a new one, or the standby has a gap, the log begins anew with a whole state. A
// standby that takes nothing for kJam is not waited for: nothing more is sent, the region goes on unprotected, and the
// log begins anew once the standby has caught up. As long as there is a standby, the region acknowledges nothing that
// the standby lacks: its copy, however old, is all that there is if the region dies.
//
//   StandbyLog log;
//   log.SetStandby(RegionId(2), region, actions);
//   each round: log.Follow(links, now, region, actions);   after a step: log.Send(result.log, tick, now, links,
//   actions);
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "core/region/region.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/lease.h"
#include "region_worker/core/link_table.h"

namespace tessera::worker {

class StandbyLog {
 public:
  static constexpr Duration kJam = std::chrono::seconds(2);

  // RegionId(): none; then no lease is needed.
  void SetStandby(RegionId standby, region::Region& region, Actions& actions);
  RegionId standby() const { return standby_; }
  // The log begins as the link comes, and ends as it goes.
  void Follow(const LinkTable& links, TimePoint now, region::Region& region, Actions& actions);
  // The log of the tick that was just stepped; empty without a standby.
  void Send(std::span<const std::uint8_t> log, Tick tick, TimePoint now, const LinkTable& links, Actions& actions);
  // The standby has the log up to `tick`.
  void OnTaken(RegionId from, Tick tick, region::Region& region, Actions& actions);
  // The standby has a gap and wants a whole state.
  void OnAgain(RegionId from, region::Region& region, Actions& actions);

  // --- The lease.
  bool LeaseHeld(TimePoint now) const { return lease_.Held(now); }
  // The number of a request that is to go out now, if one is.
  std::optional<std::uint64_t> AskForLease(TimePoint now) { return lease_.Ask(now); }
  // The standby, or the control plane, answered a request and promises to wait for `ttl`.
  void LeaseGranted(std::uint64_t number, Duration ttl) { lease_.Answered(number, ttl); }

  // Has a standby that does not have a whole tick.
  bool unprotected() const { return standby_ != RegionId() && !taken_; }
  Tick acknowledged() const { return taken_.value_or(Tick()); }
  std::uint64_t bytes_sent() const { return bytes_sent_; }

 private:
  struct Sent {
    Tick tick;
    TimePoint at;
  };
  void Begin(region::Region& region);
  void End();

  Lease lease_;
  RegionId standby_{};
  LinkTable::LinkNumber link_ = 0;  // over which the log goes; 0: nowhere
  bool jammed_ = false;
  std::deque<Sent> sent_;  // not taken, oldest first
  std::optional<Tick> taken_;
  std::uint64_t bytes_sent_ = 0;
};

}  // namespace tessera::worker
