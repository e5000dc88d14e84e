// CutLinks: links between neighbours of a world that stay cut, and the region that has to go for it.
//
// Two neighbours whose link is cut go on, each without the other: no body passes from one to the other, and what meets
// at their border does not touch. A link that is still cut `move_cut_after` after the world is DEGRADED for it, while
// both regions report, is routed around: one of the two is moved to a host from which no link to a neighbour of its is
// known to be cut. It is the one whose host, then which itself, has the most cut links, then the one with fewer bodies.
// One region of a world is moved so within kMovedRegionInterval; for as long the world keeps away from the host that it
// left. A cut that nothing can be done about is news once.
//
// A planned map that moves a region waits until the region has handed over all of its bodies. Those on their way over
// the cut link, or beyond it, wait for the link. So such a region ends by a failover once its standby has all of it:
// inventories settle what was on its way (docs/decisions/0067).
//
//   const CutDecision cut = cut_links.Look(instance, hosts, now);
//   if (cut.move) Move(*cut.move);            // then: cut_links.NoteMoved(instance, cut.move->region, now)
//   if (const auto region = cut_links.HoldingUp(instance, now)) CarryOn(*region);
//
// Not stored: a new life of the control plane finds it again. Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/control_settings.h"
#include "control_plane/now.h"
#include "control_plane/placement.h"

namespace tessera::control {

struct CutMove {
  std::uint32_t region = 0;
  std::set<std::string> shunned;  // ids of hosts on which it would be no better off, its own among them
  std::string what;               // "region 1 on alpha and region 2 on beta have no link"
};

// At most one of these.
struct CutDecision {
  std::optional<CutMove> move;  // to be made now
  std::string stuck;  // why no region is moved for a link that is cut for long enough, and what to do; or empty
};

class CutLinks {
 public:
  CutLinks(const ClusterState& state, const ControlSettings& settings) : state_(state), settings_(settings) {}
  void Forget(std::uint64_t number) { watched_.erase(number); }

  // For a world at rest. `hosts`: those that take regions, with what is free.
  CutDecision Look(const InstanceEntry& instance, std::span<const FreeHost> hosts, Now now) const;
  // True if `stuck` is not what was last passed, nor empty: it is to be an event.
  bool IsNews(std::uint64_t number, const std::string& stuck);
  // A map without the region on its host is planned, or its standby carries it on.
  void NoteMoved(const InstanceEntry& instance, std::uint32_t region, Now now);
  // True while nothing of the instance is to be placed on the host, if there is another.
  bool Avoids(std::uint64_t number, const std::string& host_id, Now now) const;
  // A region that is to be carried on by its standby, which has all of it, because a change cannot end for its cut
  // link. Call it about every kTimerInterval.
  std::optional<std::uint32_t> HoldingUp(const InstanceEntry& instance, Now now);
  // "region 1 on alpha and region 2 on beta have no link"
  std::string Describe(const InstanceEntry& instance, const CutLink& cut) const;

 private:
  struct Watched {
    Steady moved_until{0};                // no other region is moved before, and its host is avoided
    std::uint64_t moved_incarnation = 0;  // the one that was moved: while it is there still, another try is free
    std::string left_host;
    Steady held_up_since{0};  // 0: nothing is held up
    std::string told;
  };

  std::vector<CutLink> Lasting(const InstanceEntry& instance, Now now) const;
  bool MovedLately(const InstanceEntry& instance, Now now) const;
  bool Covered(const InstanceEntry& instance, std::uint32_t region, Now now) const;
  std::string Mend(const InstanceEntry& instance, const CutLink& cut) const;

  const ClusterState& state_;
  ControlSettings settings_;
  std::map<std::uint64_t, Watched> watched_;  // by number of the instance
};

}  // namespace tessera::control
