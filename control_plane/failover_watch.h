// FailoverWatch: the evidence that a failover under way waits for: an inventory of each living region, and proof that
// the dead stand still.
//
// A dead worker stands still once its exit was seen, or once nobody can have renewed its lease any more: the control
// plane and the standby, which are all who renew it, say when they last did. Where that is not known, because this
// control plane has just started, a whole lease is waited for.
//
// None of it is stored: the living send it again to a control plane that has started anew.
// Thread rule: none of its own. Time is passed in.
#pragma once

#include <map>
#include <set>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/failover.h"
#include "control_plane/now.h"

namespace tessera::control {

class FailoverWatch {
 public:
  // The failover of `record` is stored or loaded. Knowledge of its dead from an earlier failover stays; inventories
  // from that one do not. `leased_at`: when this control plane last renewed their leases, by incarnation; 0: never.
  void Begin(const records::Instance& record, const std::map<std::uint64_t, Steady>& leased_at, Now now);

  // Takes the inventory of a living region. False: it belongs to another failover, or there is none to resolve.
  // INVALID_ARGUMENT names the field.
  absl::StatusOr<bool> Add(const records::Instance& record, std::uint32_t region, const v1::Inventory& inventory,
                           Now now);
  // The end of a dead worker was seen.
  void AddExit(std::uint64_t incarnation) { exited_.insert(incarnation); }

  // A description of what is missing: "the inventories of regions 2, 3", "the lease of region 3 to run out"; empty when
  // the failover can be resolved.
  std::string WaitsFor(const records::Instance& record, Now now) const;

  Steady since() const { return since_; }
  const Inventories& inventories() const { return inventories_; }

 private:
  Steady since_{0};
  Inventories inventories_;
  std::map<std::uint64_t, Steady>
      stands_still_at_;             // by incarnation of the dead: when its lease has run out for certain
  std::set<std::uint64_t> exited_;  // incarnations of the dead
};

}  // namespace tessera::control
