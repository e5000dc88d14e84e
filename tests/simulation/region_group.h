// RegionGroup: all regions of one instance in one process, on a virtual network, from one seed.
//
// Frames travel on links that are reliable and ordered, each with a delay in virtual rounds; which region acts first in
// a round is drawn anew each time. Whatever the network does, the world must not differ: `hash()` says so. After each
// tick on which all regions have stepped, the invariants are checked: every body has exactly one owner, none is lost or
// made, epochs never shrink, all is finite.
//
//   RegionGroup group(scene, *MakeGridMap(scene->ground(), 4), {.seed = 7});
//   group.RunTo(Tick(600));
//   EXPECT_THAT(group.problems(), IsEmpty());
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "core/region/region.h"

namespace tessera::simulation {

struct RegionGroupOptions {
  std::uint64_t seed = 1;
  std::uint32_t max_delay_rounds = 3;
  region::RegionSettings settings;
  // Called with each frame as it is sent.
  std::function<void(RegionId from, const region::OutgoingFrame&)> on_frame;
};

struct Totals {
  std::uint64_t handovers = 0, frame_bytes = 0, frames = 0;
  std::uint64_t max_ghosts = 0;
  std::vector<physics::PairEvent> events;
  std::vector<BodyId> nonfinite;
};

class RegionGroup {
 public:
  RegionGroup(std::shared_ptr<const Scene> scene, const PartitionMap& map, const RegionGroupOptions& options);

  void RunTo(Tick target);
  Tick tick() const;  // that all regions have reached

  region::Region& region(std::uint32_t id) { return *regions_.at(id - 1); }
  std::size_t size() const { return regions_.size(); }
  RegionId OwnerOf(BodyId id) const;  // RegionId() if nobody
  BodyState StateOf(BodyId id) const;
  std::map<BodyId, BodyState> States() const;
  void SpawnPlayer(PlayerNumber player, std::uint32_t region);
  void RemovePlayer(PlayerNumber player);
  // Offered to the region that owns the body now.
  absl::Status QueueInput(const PlayerInput& input);

  // Called with each result of each region, in the order of stepping.
  std::function<void(RegionId, const region::StepResult&)> on_step;

  const std::vector<std::string>& problems() const { return problems_; }
  const Totals& totals() const { return totals_; }
  std::uint64_t hash() const { return hash_; }  // over every state of every tick

 private:
  struct Message {
    std::uint64_t due = 0;  // round
    region::Bytes bytes;
  };
  using Link = std::pair<RegionId, RegionId>;
  struct Owned {
    RegionId region;
    Epoch epoch;
    BodyState state;
  };
  struct Record {  // for one tick
    std::size_t regions = 0;
    std::vector<std::pair<BodyId, Owned>> bodies;
    std::vector<BodyId> removed;
  };

  void Round(Tick target);
  void Send(RegionId from, std::vector<region::OutgoingFrame> frames);
  void Deliver();
  void StepOne(region::Region& region);
  void Check(Tick tick, Record& record);
  void Problem(Tick tick, const std::string& what);

  std::shared_ptr<const Scene> scene_;
  RegionGroupOptions options_;
  std::mt19937_64 random_;
  std::vector<std::unique_ptr<region::Region>> regions_;
  std::map<Link, std::deque<Message>> links_;
  std::uint64_t round_ = 0;
  std::map<Tick, Record> records_;
  std::map<BodyId, Epoch> bodies_;  // at the last checked tick
  std::set<BodyId> awaited_;        // spawned, not seen yet
  std::vector<std::string> problems_;
  Totals totals_;
  std::uint64_t hash_ = 0xcbf29ce484222325;
};

}  // namespace tessera::simulation
