// BorderInstance: all regions of one instance in one process, stepped in turn; frames arrive at once.
//
// Counts what borders cost: CPU time of each region, bytes, ghosts, handovers. Received frames can be recorded, and
// the region be run again by itself (`LoneRegion`): then its time is that of a process of its own, with its own caches.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "bench/lockstep.h"
#include "core/region/region.h"

namespace tessera::bench {

// Frames that each region received in each tick: [region - 1][tick].
struct ReceivedFrame {
  RegionId from;
  std::shared_ptr<const region::Bytes> bytes;
};
using ReceivedFrames = std::vector<std::vector<std::vector<ReceivedFrame>>>;

struct BorderSettings {
  region::RegionSettings region;
  bool keep_frames = false;
};

class BorderInstance {
 public:
  BorderInstance(std::shared_ptr<const Scene> scene, const PartitionMap& map, const BorderSettings& settings);

  void Tick();
  void Ticks(int n) {
    for (int i = 0; i < n; ++i) Tick();
  }
  tessera::Tick tick() const { return regions_.region(0).tick(); }
  const Scene& scene() const { return *scene_; }
  // The owner's record of the body; null if nobody owns it.
  const region::OwnedBody* Find(BodyId id) const;
  BodyState StateOf(BodyId id) const;
  RegionId OwnerOf(BodyId id) const;
  std::vector<const region::Region*> regions() const;

  // CPU time of receiving and stepping, by region, s.
  const std::vector<double>& cpu_s() const { return cpu_s_; }
  std::uint64_t frame_bytes() const { return frame_bytes_; }
  std::uint64_t handovers() const { return handovers_; }
  double ghosts_per_body() const { return ghosts_ / bodies_; }  // mean over the ticks
  std::uint64_t lost() const { return lost_; }                  // taken out as not finite
  const ReceivedFrames& received() const { return received_; }
  // Ticks from when a body was first seen beyond the hysteresis, outside its owner's cells, to when another stepped it.
  const std::vector<double>& handover_ticks() const { return handover_ticks_; }

 private:
  void OnStep(const region::Region& region, const region::StepResult& result, double cpu_s);
  void OnFrame(RegionId from, region::OutgoingFrame& frame, double cpu_s);
  void NoteHandovers(RegionId from, const region::StepResult& result);
  void NoteStrays(const region::Region& region);

  std::shared_ptr<const Scene> scene_;
  BorderSettings settings_;
  std::vector<double> cpu_s_;
  std::uint64_t frame_bytes_ = 0, handovers_ = 0, lost_ = 0;
  double ghosts_ = 0, bodies_ = 0;
  ReceivedFrames received_;
  std::map<std::pair<RegionId, BodyId>, std::uint64_t> stray_since_;  // by owner
  std::vector<double> handover_ticks_;
  Lockstep regions_;  // last: its constructor reports frames
};

// One region of an instance, run again on the frames that it received then.
class LoneRegion {
 public:
  LoneRegion(std::shared_ptr<const Scene> scene, const PartitionMap& map, const BorderSettings& settings, RegionId id,
             const ReceivedFrames& received);
  // CPU time of the next `ticks` ticks, at most as many as were recorded, s.
  double Seconds(int ticks);

 private:
  const std::vector<std::vector<ReceivedFrame>>& received_;
  region::Region region_;
};

}  // namespace tessera::bench
