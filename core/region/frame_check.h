// Checks of the contents of a decoded frame: known dynamic bodies, finite and sane values, whole lists in order.
// Everything that does not depend on what the receiver owns at the moment.
//
// Thread rule: free functions on values.
#pragma once

#include "absl/status/status.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"

namespace tessera::region {

// INVALID_ARGUMENT naming the body and, of a number, the field: "body 7: linear_velocity.x must be a finite number, got
// nan" (core/world/state_check.h), "body 7 is not a dynamic body of the scene".
absl::Status CheckFrame(const BorderFrame& frame, const Catalog& catalog);
// The parts that the log has too.
absl::Status CheckKnown(BodyId id, const Catalog& catalog);
absl::Status CheckControl(BodyId id, const PlayerControl& control, const Catalog& catalog);

}  // namespace tessera::region
