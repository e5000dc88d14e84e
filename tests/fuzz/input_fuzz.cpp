// A client's input datagram.
#include <cstddef>
#include <cstdint>

#include "core/replication/input.h"
#include "tests/fuzz/planted_seed.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using namespace tessera;
  replication::InputMessage message{.ack = {1, 2, 3}};
  message.inputs.push_back({.number = 7, .body = BodyId(4), .target = Tick(9), .force_n = {1, 2, 3}});
  message.inputs.push_back({.number = 9, .body = PlayerBodyId(PlayerNumber(2)), .move = {0, 1}, .buttons = 5});
  fuzz::PlantSeed(*argc, *argv, "two_inputs", replication::EncodeInput(message));
  fuzz::PlantSeed(*argc, *argv, "acknowledgement", replication::EncodeInput({.ack = {1, 2, 3}}));
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  (void)tessera::replication::DecodeInput({data, size});
  return 0;
}
