// NetworkConditions: a bad network to try a game on.
#pragma once

#include <chrono>
#include <cstdint>

namespace tessera::client {

// They apply to each direction by itself. Reliable messages arrive, in order, but a loss delays them by another try.
struct NetworkConditions {
  double loss = 0;                      // share of datagrams, 0 to 1
  double duplicate = 0;                 // share that comes twice, 0 to 1
  std::chrono::milliseconds delay{0};   // each way
  std::chrono::milliseconds jitter{0};  // up to so much more, evenly spread; so datagrams overtake each other
  std::uint64_t seed = 1;               // the same seed and the same traffic give the same fate

  bool perfect() const { return loss <= 0 && duplicate <= 0 && delay.count() <= 0 && jitter.count() <= 0; }
};

}  // namespace tessera::client
