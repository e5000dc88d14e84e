// Conversion of a PartitionMap to and from tessera.v1.PartitionMap, its form on the wire and in the store.
//
// Any thread. `FromProto` trusts nothing: whatever `PartitionMap::Create` refuses comes back as its INVALID_ARGUMENT,
// naming the field.
#pragma once

#include "absl/status/statusor.h"
#include "core/world/partition_map.h"
#include "tessera/v1/partition.pb.h"

namespace tessera {

v1::PartitionMap ToProto(const PartitionMap& map);
// Beyond `Create`, version 0 is refused.
absl::StatusOr<PartitionMap> FromProto(const v1::PartitionMap& map);

v1::WorldTerms ToProto(const WorldTerms& terms);
absl::StatusOr<WorldTerms> FromProto(const v1::WorldTerms& terms);

// The entry of a region in a message; null if the map does not have it.
const v1::MapRegion* FindRegion(const v1::PartitionMap& map, RegionId region);

v1::Rect ToProto(const Rect& rect);
Rect FromProto(const v1::Rect& rect);

}  // namespace tessera
