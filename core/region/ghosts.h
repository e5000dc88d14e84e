// Ghosts: which bodies of others a region must have in its world, by the neighbours' frames of the last tick.
//
// Thread rule: free functions on values.
#pragma once

#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/region/bodies.h"
#include "core/region/frame.h"

namespace tessera::region {

// Ghosts that the next step needs, ascending, for Bodies::PlaceGhosts. `frames` are in the order of
// `neighbors`, `link_up` is asked by the same index. Of a body that two report, the higher epoch counts; one that is
// owned here is nobody's ghost. Ghosts of a neighbour whose link is down go on by what this region made of them.
std::vector<Ghost> GhostsFrom(std::span<const BorderFrame> frames, std::span<const RegionId> neighbors,
                              absl::FunctionRef<bool(std::size_t)> link_up, const Bodies& bodies);

}  // namespace tessera::region
