// LoadPropagation: the loads of a pile, if each body presses upon those that it stands on with all that it carries.
//
// Weights propagate body by body from the top, in equal shares to all that a body stands on. That is what statics
// says of a tower, and about what it says of a heap.
//
//   LoadPropagation propagation;
//   for (const PropagatedLoad& load : propagation.Run(supports, weights)) ...
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/world/ids.h"

namespace tessera::physics {

// An awake body as the propagation sees it.
struct BodyWeight {
  BodyId id;
  bool externally_supported = false;  // SupportHint::external
  double mass_kg = 0;
  double connected_kg = 0;  // the body with all that joints connect to it
  double supported_kg = 0;  // the body with all that rests on it; `Run` adds to it
  double height_m = 0;      // against gravity
};

// One body stands on another.
struct Support {
  std::uint32_t upper = 0, lower = 0;  // places in the weights; `lower` may be kAsleep: something firm
  double scale = 1;                    // factor of the load ratio; see loads.cpp
  double known_kg = -1;                // mass that is known to press on the lower one; negative: to be computed
};

struct PropagatedLoad {
  std::uint32_t body;  // place in the weights
  float load_ratio;    // largest of the body's supports, in weights of the lighter one of each two
};

class LoadPropagation {
 public:
  // Loads of all bodies that stand on something, from the top down. Valid until the next call.
  std::span<const PropagatedLoad> Run(std::span<const Support> supports, std::span<BodyWeight> weights);

 private:
  void Group(std::span<const Support> supports, std::span<const BodyWeight> weights);

  std::vector<Support> grouped_;                          // by upper body, as `first_` says
  std::vector<std::uint32_t> first_;                      // by body: place in `grouped_` of its first support
  std::vector<std::pair<double, std::uint32_t>> uppers_;  // height and place of each body that stands on something
  std::vector<PropagatedLoad> loads_;
};

}  // namespace tessera::physics
