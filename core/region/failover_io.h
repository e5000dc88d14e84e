// Inventories and resolutions to and from tessera.v1, their form between regions and the control plane.
//
// Thread rule: free functions on values. `FromProto` trusts nothing: what CheckInventory and CheckResolution refuse
// comes back as their INVALID_ARGUMENT, and so do lists of different lengths.
#pragma once

#include <chrono>
#include <functional>

#include "absl/status/statusor.h"
#include "core/region/inventory.h"
#include "core/region/resolve.h"
#include "tessera/v1/failover.pb.h"

namespace tessera::region {

// `last_acknowledged` of a primary: how long ago something was acknowledged to it.
v1::Inventory ToProto(const Inventory& inventory,
                      const std::function<std::chrono::milliseconds(const StandbyCopyInventory&)>& last_acknowledged);
absl::StatusOr<Inventory> FromProto(const v1::Inventory& inventory);

v1::Resolution ToProto(const Resolution& resolution);
absl::StatusOr<Resolution> FromProto(const v1::Resolution& resolution);

}  // namespace tessera::region
