// Claims: whether a neighbour's frame agrees with the ownership that this region knows of.
//
// Thread rule: free functions on values.
#pragma once

#include <span>

#include "absl/status/status.h"
#include "core/region/bodies.h"
#include "core/region/departing_body.h"
#include "core/region/frame.h"
#include "core/region/grants_in.h"

namespace tessera::region {

// PERMISSION_DENIED naming the body: one that is owned here is reported or granted, or one is granted with an epoch
// that is not above the last. Grants that are repeated claim nothing new.
absl::Status CheckClaims(const BorderFrame& frame, const Bodies& bodies, std::span<const DepartingBody> departing,
                         const GrantsIn& grants_in);

}  // namespace tessera::region
