// SlowHosts: hosts on which a body costs a world much more than elsewhere, for so long that the world is slow.
//
// A region is its host's fault if its steps take longer than a tick, and a body in it takes kSlowHostCost times what
// one takes on the world's other hosts, both for kSlowHostAfter on end. Another host is then to run it: one region
// within kSlowHostInterval, since what made the host slow may end by itself. For as long the world keeps away from that
// host where others have room. A world that is all on one host, or slow everywhere alike, proves nothing about hosts.
//
//   if (const auto slow = slow_hosts.Look(instance, now)) Move(*slow);   // then: slow_hosts.NoteMoved(...)
//
// Not stored: a new life of the control plane finds it again. Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"

namespace tessera::control {

struct SlowRegion {
  std::uint32_t region = 0;
  std::string host_id;
  double step_s = 0, tick_s = 0;  // a step takes the one, and may take the other
  double cost_ratio = 0;          // a body's, by that of the world's other hosts
};

class SlowHosts {
 public:
  // The worst of the regions that are to be moved now; nothing if there is none. Call it as often as reports come.
  std::optional<SlowRegion> Look(const InstanceEntry& instance, Now now);
  // A map without the region on that host is planned.
  void NoteMoved(std::uint64_t number, const SlowRegion& moved, Now now);
  // True while nothing of the instance is to be placed on the host, if there is another.
  bool Avoids(std::uint64_t number, const std::string& host_id, Now now) const;
  void Forget(std::uint64_t number) { watched_.erase(number); }

 private:
  struct Watched {
    std::map<std::uint64_t, Steady> slow_since;   // by incarnation
    std::map<std::string, Steady> avoided_until;  // by host
  };
  std::map<std::uint64_t, Watched> watched_;  // by number of the instance
};

// "region 3 on beta: 41 ms a step of 17 ms, and a body costs 2.6 times what it does elsewhere"
std::string Describe(const SlowRegion& slow, const std::string& host_name);

}  // namespace tessera::control
