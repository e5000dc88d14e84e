// BorderInstance: all regions of one instance in one process, stepped in turn; what each tells arrives at once.
//
// Counts what borders cost: CPU time of each region, bytes, ghosts, handovers. What a region was told can be kept, and
// the region be run again by itself (`LoneRegion`): then its time is that of a process of its own, with its own caches.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "core/region/region.h"

namespace tessera::bench {

// What each region was told in each tick: [region - 1][tick].
struct ToldFrame {
  RegionId from;
  std::shared_ptr<const region::Bytes> bytes;
};
using Told = std::vector<std::vector<std::vector<ToldFrame>>>;

struct BorderSettings {
  region::Settings region;
  bool keep_told = false;
};

class BorderInstance {
 public:
  BorderInstance(std::shared_ptr<const Scene> scene, const PartitionMap& map, const BorderSettings& settings);

  void Tick();
  void Ticks(int n) {
    for (int i = 0; i < n; ++i) Tick();
  }
  tessera::Tick tick() const { return regions_.front()->tick(); }
  const Scene& scene() const { return *scene_; }
  // Of its owner; null if nobody owns it.
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
  const Told& told() const { return told_; }
  // Ticks from when a body was first seen beyond the hysteresis, outside its owner's cells, to when another stepped it.
  const std::vector<double>& handover_ticks() const { return handover_ticks_; }

 private:
  void Send(RegionId from, std::vector<region::OutgoingFrame> frames);
  void NoteHandovers(RegionId from, const region::StepResult& result);
  void NoteStrays(const region::Region& region);

  std::shared_ptr<const Scene> scene_;
  BorderSettings settings_;
  std::vector<std::unique_ptr<region::Region>> regions_;
  std::vector<double> cpu_s_;
  std::uint64_t frame_bytes_ = 0, handovers_ = 0, lost_ = 0;
  double ghosts_ = 0, bodies_ = 0;
  Told told_;
  std::map<std::pair<RegionId, BodyId>, std::uint64_t> stray_since_;  // by owner
  std::vector<double> handover_ticks_;
};

// One region of an instance, run again on what it was told then.
class LoneRegion {
 public:
  LoneRegion(std::shared_ptr<const Scene> scene, const PartitionMap& map, const BorderSettings& settings, RegionId id,
             const Told& told);
  // CPU time of the next `ticks` ticks, as many as were told, s.
  double Seconds(int ticks);

 private:
  const std::vector<std::vector<ToldFrame>>& told_;
  region::Region region_;
};

}  // namespace tessera::bench
