// BorderLoads: what bodies that a neighbour does not have do to those that it has as ghosts.
//
// A load is a mean over about ten steps, and begins with the lesser of two steps in each component, 0 if they differ in
// sign: so a blow, which is over, is not sent as a load. Thread rule: one thread at a time.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/physics/world.h"
#include "core/region/bodies.h"
#include "core/region/departing_body.h"
#include "core/region/frame.h"
#include "core/region/neighborhood.h"
#include "core/region/relevance.h"

namespace tessera::region {

class BorderLoads {
 public:
  // Where the ghosts of a frame are, by owned body: an index into its ghosts, or kNotInFrame.
  static constexpr std::uint32_t kNotInFrame = 0xffffffff;

  explicit BorderLoads(const RegionSettings& settings) : aura_m_(settings.aura_m) {}

  // Contacts of the last step, of Bodies::ImpulsesNearBorders: ascending by pair.
  void Note(std::span<const physics::PairImpulse> contacts);
  // The contacts of before count no more.
  void Clear();

  // All that the ghosts of a frame bear follows from.
  struct Inputs {
    const Bodies& bodies;
    const Neighborhood& neighborhood;
    const Relevance& relevance;
    std::span<const DepartingBody> departing;
    std::size_t neighbor;
    std::span<const std::uint32_t> in_frame;  // by owned body, see above
  };
  // Completes the ghosts of the frame for one neighbour.
  void AddTo(std::span<GhostRecord> ghosts, const Inputs& in) const;

  void Validate() const;

 private:
  // A pair of the last step, and what it does as a load.
  struct LoadContact {
    BodyId a, b;
    std::uint32_t place_a, place_b;  // physics::kNoTag for a static body
    Vec3f impulse_on_b, angular_on_a, angular_on_b;
    std::array<Vec3f, 3> last_step;  // the same, in the last step alone
  };
  // The neighbour's record of one body of a pair.
  struct Seen {
    GhostRecord* in_frame = nullptr;
    bool settled = false, seen = false;
  };
  Seen SeenOf(BodyId id, std::uint32_t place, std::span<GhostRecord> ghosts, const Inputs& in) const;

  const double aura_m_;
  std::vector<LoadContact> active_, active_before_;  // near borders, ascending by (a, b)
};

}  // namespace tessera::region
