// HealthWatch: faults of a running instance that only time shows.
//
//   uncovered   a region whose standby has had no whole copy of it, or that has no standby, for kStandbyPatience
//   still       a region that has not made a step, or is not known to, for kStillAfter
//   unknown     a region of which no step is known for kNotKnownAfter and none was since this control plane began: two
//               reports have to show it, its worker's, or its standby's while its agent has not been heard
//   cut         two neighbours without a link for kCutAfter, or with one over which nothing comes to one of them; while
//               one has no lease that time does not count
//
// A world of one region has no standby by its nature, and is not uncovered. Faults of hosts that are lost, and of
// workers that have ended, are reported elsewhere. Time in which nobody looked proves nothing: it does not count.
//
//   const HealthFaults faults = watch.Look(instance, now);
//
// Call it about every kTimerInterval. Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"

namespace tessera::control {

struct HealthFaults {
  std::vector<std::string> uncovered;  // "region 2 on alpha: its standby, region 3 on beta, has no whole copy"
  std::vector<std::uint32_t> still;    // regions, also those that stay unknown
  std::vector<std::uint32_t> unknown;  // regions
  std::vector<CutLink> cut;

  // One line of all; empty in good health.
  std::string Text() const;
};

class HealthWatch {
 public:
  explicit HealthWatch(const ClusterState& state) : state_(state) {}

  HealthFaults Look(const InstanceEntry& instance, Now now);
  void Forget(std::uint64_t number) { watched_.erase(number); }

 private:
  struct Region {
    std::uint64_t tick = 0;     // 0: nobody has reported any
    bool stepped = false;       // another tick than the first one was reported
    Steady stepped_at{0};       // when the tick was first seen, or the first look while none is known
    Steady uncovered_since{0};  // 0: it is covered
  };
  struct Watched {
    std::map<std::uint64_t, Region> regions;                              // by incarnation
    std::map<std::pair<std::uint32_t, std::uint32_t>, Steady> cut_since;  // lower region first
    Steady looked_at{0};
  };

  static void Forgive(Watched& watched, Steady unseen);
  void LookAtRegion(const InstanceEntry& instance, std::size_t index, Region& region, HealthFaults& faults,
                    Now now) const;
  void LookAtLinks(const InstanceEntry& instance, Watched& watched, Steady passed, HealthFaults& faults, Now now) const;
  bool Counts(const InstanceEntry& instance, std::size_t index) const;
  bool Unheard(const InstanceEntry& instance, std::size_t index) const;
  bool Looks(const InstanceEntry& instance, std::size_t index) const;
  std::string NameOfRegion(const InstanceEntry& instance, std::uint32_t region) const;

  const ClusterState& state_;
  std::map<std::uint64_t, Watched> watched_;  // by number of the instance
};

}  // namespace tessera::control
