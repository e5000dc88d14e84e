// What a decoded frame may hold: known dynamic bodies, finite and sane values, whole lists in order. Everything that
// does not depend on what the receiver owns at the moment.
//
// Thread rule: free functions on values.
#pragma once

#include "absl/status/status.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"

namespace tessera::region {

// Finite, a unit orientation, and within the limits of settings.h. The same rule holds for own bodies after a step and
// for what neighbours show, so no honest frame is ever refused by it.
bool IsSane(const BodyState& state);

// INVALID_ARGUMENT naming the body: "body 7: state is not finite or beyond limits", "body 7 is not a dynamic body of
// the scene".
absl::Status CheckFrame(const Frame& frame, const Catalog& catalog);

}  // namespace tessera::region
