// PlayerClient: a player at the far end of datagrams: hears now and then where its body is, and says what to do with it
// many times over, because datagrams are lost.
//
// Datagrams down: region u32, epoch u32, last input u32. Up: count u8, then number u32 and force 3 f32 each. Thread
// rule: one thread at a time.
#pragma once

#include <deque>

#include "core/region/region.h"
#include "tests/simulation/virtual_network.h"

namespace tessera::simulation {

class PlayerClient {
 public:
  static constexpr Micros kInterval = 16'667;
  static constexpr std::size_t kRepeats = 4;  // inputs in a datagram

  PlayerClient(Timeline& timeline, VirtualNetwork& network, Node node, std::uint64_t seed, double force_n);
  ~PlayerClient();

  std::uint32_t sent() const { return next_ - 1; }

  // A region's message to a player, and the inputs that it reads in a player's.
  static Bytes Tell(RegionId region, Epoch epoch, std::uint32_t last_input);
  static std::vector<PlayerInput> Read(PlayerNumber player, const Bytes& datagram);

 private:
  void Hear(const Bytes& datagram);
  void Speak();

  Timeline& timeline_;
  VirtualNetwork& network_;
  const Node node_;
  Chance chance_;
  const double force_n_;
  RegionId owner_;
  Epoch epoch_;
  std::uint32_t next_ = 1;
  std::deque<PlayerInput> asked_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace tessera::simulation
