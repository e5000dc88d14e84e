// Properties of a body off the wire: refused, or they say the same when they are written again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/world/properties.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using tessera::PropertySet;
  static const std::vector<tessera::PropertyDef> defs = {{"health", std::int64_t{100}},
                                                         {"team", std::string("none")},
                                                         {"armed", false},
                                                         {"speed", 1.5},
                                                         {"home", tessera::Vec3d{1, 2, 3}},
                                                         {"target", tessera::BodyId()},
                                                         {"secret", tessera::PropertyBytes{}}};
  const auto set = PropertySet::Decode({data, size}, defs);
  if (!set.ok()) return 0;
  const auto bytes = set->Encode();
  const auto again = PropertySet::Decode(bytes, defs);
  if (!again.ok() || again->Encode() != bytes) std::abort();
  return 0;
}
