// A partition map off the wire. One that is accepted survives the way back and forth and has an owner for every place.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/world/partition_io.h"
#include "core/world/partition_map.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tessera::v1::PartitionMap message;
  if (!message.ParseFromArray(data, static_cast<int>(size))) return 0;
  const auto map = tessera::FromProto(message);
  if (!map.ok()) return 0;
  if (!tessera::FromProto(tessera::ToProto(*map)).ok()) std::abort();
  for (const double x : {-1e9, 0.0, 17.5, 1e9}) {
    if (map->OwnerOf({x, 0, -x}) == tessera::RegionId()) std::abort();
  }
  return 0;
}
