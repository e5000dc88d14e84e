// A PartitionMap as bytes without protobuf, for those who carry none: join grants and clients' recordings hold it.
// docs/protocol.md, "The join grant", has the form.
//
//   ByteWriter out;
//   WriteMap(map, out);
//   ByteReader in(out.bytes());
//   absl::StatusOr<PartitionMap> same = ReadMap(in);
//
// Thread rule: free functions on values.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/bytes.h"
#include "core/world/partition_map.h"

namespace tessera {

void WriteMap(const PartitionMap& map, ByteWriter& out);
// Reads what WriteMap wrote and leaves what follows. Errors: INVALID_ARGUMENT naming the field: truncated, out of
// range, version 0, terms that CheckTerms refuses, and all that PartitionMap::Create refuses.
absl::StatusOr<PartitionMap> ReadMap(ByteReader& in);

// INVALID_ARGUMENT "terms.ticks_per_second: 0.5" unless it is 0 or within kMinTicksPerSecond and kMaxTickRateHz.
absl::Status CheckTerms(const WorldTerms& terms);

}  // namespace tessera
