// A connect token opens only if the key sealed it.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "net/connect_token.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tessera::net::InstanceKey key = tessera::net::MakeInstanceKey();
  if (tessera::net::Open({data, size}, "plaza-1", key, 0).ok()) std::abort();
  return 0;
}
