// Lockstep: all regions of one instance in one process, stepped in turn. Frames of a tick arrive before the next tick.
//
// Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/region/region.h"

namespace tessera::bench {

class Lockstep {
 public:
  struct Observer {
    // After a region's step, with the CPU time that it took, s.
    std::function<void(const region::Region& region, const region::StepResult& result, double cpu_s)> stepped;
    // After `frame.to` has received a frame, with the CPU time that it took, s. The bytes may be moved away.
    std::function<void(RegionId from, region::OutgoingFrame& frame, double cpu_s)> received;
  };

  // Makes the game of a region.
  using GameMaker = std::function<std::shared_ptr<game::GameHost>(RegionId)>;

  // Region n of the map has incarnation n. The frames of tick 0 have arrived when the constructor returns.
  Lockstep(const std::shared_ptr<const Scene>& scene, const PartitionMap& map, const region::RegionSettings& settings,
           Observer observer = {}, const GameMaker& game = {});

  // Steps all regions once. Throws if a frame is refused.
  void Tick(const region::PhaseObserver& phases = {});

  std::size_t size() const { return regions_.size(); }
  const region::Region& region(std::size_t index) const { return *regions_[index]; }  // in the order of the map
  region::Region& region(std::size_t index) { return *regions_[index]; }

 private:
  void Send(RegionId from, std::vector<region::OutgoingFrame> frames);

  std::vector<std::unique_ptr<region::Region>> regions_;
  Observer observer_;
};

}  // namespace tessera::bench
