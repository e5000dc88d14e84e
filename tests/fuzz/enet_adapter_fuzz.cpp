// Payloads of a peer with a good key, which are refused or restored within their bytes; and sealed datagrams at a
// channel.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "net/channel.h"
#include "net/enet_adapter.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera::net;  // NOLINT: every name here is from it
  if (size < 1) return 0;
  std::vector<std::uint8_t> room(kChecksumBytes + size - 1);
  std::copy(data + 1, data + size, room.begin() + kChecksumBytes);
  const auto payload = std::span(room).subspan(kChecksumBytes);
  if (size - 1 >= kSealHeaderBytes + kSealTagBytes) {
    Channel channel({}, {});
    std::vector<std::uint8_t> sealed(payload.begin(), payload.end());
    Channel::Fault fault{};
    (void)channel.Open(sealed, &fault);
  }
  const Inner kind = Inspect(payload, (data[0] & 1) != 0, (data[0] & 2) == 0);
  if (kind == Inner::kRefused) return 0;
  const auto datagram = Restore(payload, kind, 0x1234);
  if (datagram.size() != payload.size() + kChecksumBytes) std::abort();
  if (FieldOf(datagram) != (kind == Inner::kConnect ? 0u : 0x1234u)) std::abort();
  return 0;
}
