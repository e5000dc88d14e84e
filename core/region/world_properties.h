// WorldProperties: properties of the world that differ from the scene's, in one of the versions that there were.
//
// Thread rule: a plain value.
#pragma once

#include <cstdint>
#include <span>

#include "core/world/ids.h"

namespace tessera::region {

// Versions are ordered by (epoch, made).
struct WorldProperties {
  Epoch epoch;                          // that the world's record is owned under
  Tick made;                            // after which they were so
  std::span<const std::uint8_t> bytes;  // PropertySet::Encode by the scene's instance_properties
};

}  // namespace tessera::region
