// A client's input datagram.
#include <cstddef>
#include <cstdint>

#include "core/replication/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  (void)tessera::replication::DecodeInput({data, size});
  return 0;
}
