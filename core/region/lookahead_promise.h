// LookaheadPromise: for how many ticks a neighbour need not wait for this region's frames.
//
// A frame may promise that the next few are like it, if nothing that happens here until then can concern the neighbour:
// the sleepers in the frame stay as they are while nothing here is awake to push them; and if the frame has no ghosts,
// nothing awake may come near the neighbour's cells. Nor may a ghost, which may be granted to this region next.
//
// Made anew for each tick. Thread rule: one thread at a time.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/physics/prediction.h"
#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"
#include "core/region/neighborhood.h"
#include "core/region/settings.h"

namespace tessera::region {

class LookaheadPromise {
 public:
  // All that promises follow from, and that must outlive them.
  struct Inputs {
    const Bodies& bodies;
    const Catalog& catalog;
    const Neighborhood& neighborhood;
    const RegionSettings& settings;
    std::span<const physics::Forces> forces;  // by owned body
    double tick_s;
    // Another map is announced, a game waits for neighbours to listen, or something is to leave soon: nothing is
    // promised.
    bool restless;
    bool inland = false;  // AllInland holds, and nothing may be steered; `forces` is not looked at then
  };
  explicit LookaheadPromise(const Inputs& inputs) : in_(inputs) {}

  // Number of ticks that this frame may promise to `to`; 0: none.
  std::uint32_t For(RegionId to, const BorderFrame& frame);

 private:
  struct Unrest {
    bool any = false;          // anything is awake, or may be steered
    std::vector<Aabb> places;  // where such a body may come to be, if it may leave this region's cell
  };
  bool AnyAwake() const;
  Unrest FindUnrest() const;
  void AddUnrest(BodyId id, const BodyState& state, double radius_m, double acceleration_m_s2, Unrest& unrest) const;

  const Inputs in_;
  std::optional<Unrest> unrest_;  // found when it is first asked for
};

}  // namespace tessera::region
