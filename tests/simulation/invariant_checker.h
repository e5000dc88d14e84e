// InvariantChecker: what must hold in an instance, whatever its network does, checked after each step of each region.
//
//   - an epoch of a body has one owner ever, and owns it at later ticks than the epoch before: at most one owner
//   - a body is owned, or kept by whoever granted it, or excused as dead with its last region: never no copy
//   - nobody owns what was not in the scene, was not spawned, or was removed
//   - what a game made is there once clients may know of it, and what it removed is not, whoever dies
//   - all is finite
//   - momentum of a scene that nothing acts on from outside is kept, and its energy does not grow
//
// Ticks of regions may jump when a link comes up again; no rule here depends on that. Thread rule: one thread at a
// time.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/region/region.h"

namespace tessera::simulation {

// Sum over the bodies of a tick.
struct Motions {
  std::size_t regions = 0, bodies = 0;
  Vec3d momentum;       // kg m/s
  double size = 0;      // sum of the lengths of the momenta
  double energy_j = 0;  // kinetic, and potential by the scene's gravity
};

class InvariantChecker {
 public:
  explicit InvariantChecker(const Scene& scene);

  void Spawned(BodyId id) { expected_.insert(id); }
  void Removing(BodyId id) { leaving_.insert(id); }  // from now on it may go at any time
  // The game may remove this body of the scene; those that it makes it always may.
  void GameMayRemove(BodyId id) { removable_.insert(id); }
  // The region steps no more, and what only it knew is gone.
  void Died(RegionId region);
  // Nobody has this body any more, and rightly so.
  void Excuse(BodyId id) { excused_.insert(id); }

  void Stepped(RegionId region, Tick tick, std::span<const region::OwnedBody> owned, const region::StepResult& result);
  // At a moment between steps. `held`: what each live region owns or keeps as granter, any order, with repeats.
  void CheckCopies(Tick tick, std::span<const BodyId> held);
  // At a moment when all regions stand at the same tick and all borders are open: each body has exactly one owner.
  void CheckOwners(Tick tick, std::span<const BodyId> owned);

  // After a step of a region that runs a game: what clients may know by now.
  void Told(const region::Region& region);
  struct Made {
    std::uint64_t made = 0, removed = 0;  // by a game, and told
    std::uint64_t came_back = 0;          // those that came back after they were reported removed
  };
  const Made& made() const { return made_; }

  // Order of steps does not matter to it.
  std::uint64_t hash() const { return hash_; }
  // Sums by tick, for ticks at which all `regions` have stepped; the caller forgets those before.
  std::map<Tick, Motions>& motions() { return motions_; }
  // Inertia counts only where a shape makes it plain: balls; others by their box.
  void set_weighs(bool weighs) { weighs_ = weighs; }

  const std::vector<std::string>& problems() const { return problems_; }
  void Problem(Tick tick, const std::string& what);
  std::size_t lost() const { return lost_.size(); }
  std::size_t doubled() const { return doubled_.size(); }
  const std::set<BodyId>& expected() const { return expected_; }

 private:
  struct Reign {  // while one epoch lasts
    RegionId region;
    Epoch epoch;
    Tick first, last;
  };
  struct Life {
    std::array<Reign, 4> reigns;  // the newest epochs, by epoch % 4
    bool gone = false;
    Tick gone_at;
  };
  void Reigns(RegionId region, Tick tick, const region::OwnedBody& body);
  void Overlap(BodyId id, const Reign& a, const Reign& b);

  // A region has decided these, and nobody may know yet.
  struct Untold {
    std::set<BodyId> made;
    std::vector<std::pair<Tick, BodyId>> removed;
  };
  const Scene& scene_;
  std::map<RegionId, Untold> untold_;
  std::set<BodyId> orphans_;  // made by regions that died before anybody could be told; nobody has had them since
  std::set<BodyId> told_removed_;
  Made made_;
  std::set<BodyId> expected_, leaving_, removable_, excused_, lost_, doubled_;
  std::unordered_map<BodyId, Life> lives_;
  std::map<Tick, Motions> motions_;
  bool weighs_ = false;
  std::uint64_t hash_ = 0;
  std::vector<std::string> problems_;
};

// Every bit of a state, mixed.
std::uint64_t HashOf(const BodyState& state);

}  // namespace tessera::simulation
