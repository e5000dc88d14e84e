#include "tests/simulation/player_client.h"

#include <algorithm>

#include "core/world/bytes.h"

namespace tessera::simulation {

PlayerClient::PlayerClient(Timeline& timeline, VirtualNetwork& network, Node node, std::uint64_t seed, double force_n)
    : timeline_(timeline), network_(network), node_(node), chance_(seed), force_n_(force_n) {
  network_.Join(node_, {.on_connected = {},
                        .on_disconnected = {},
                        .on_message = {},
                        .on_datagram = [this](Node, const Bytes& bytes) { Hear(bytes); }});
  Speak();
}

PlayerClient::~PlayerClient() {
  *alive_ = false;
  network_.Leave(node_);
}

Bytes PlayerClient::Tell(RegionId region, Epoch epoch, std::uint32_t last_input) {
  ByteWriter out;
  out.Varint(region.value());
  out.Varint(epoch.value());
  out.Varint(last_input);
  return out.Take();
}

void PlayerClient::Hear(const Bytes& datagram) {
  ByteReader in(datagram);
  const RegionId region(in.Varint32());
  const Epoch epoch(in.Varint32());
  const std::uint32_t last_input = in.Varint32();
  if (!in.ok() || epoch < epoch_) return;
  owner_ = region;
  epoch_ = epoch;
  while (!asked_.empty() && asked_.front().number <= last_input) asked_.pop_front();
}

void PlayerClient::Speak() {
  if (owner_ != RegionId()) {
    const Vec3d push{chance_.Between(-1, 1), 0, chance_.Between(-1, 1)};
    asked_.push_back({.number = next_++, .force_n = Vec3f(push * force_n_)});
    if (asked_.size() > kRepeats) asked_.pop_front();
    ByteWriter out;
    out.U8(static_cast<std::uint8_t>(asked_.size()));
    for (const PlayerInput& input : asked_) {
      out.Varint(input.number);
      out.V(input.force_n);
    }
    network_.SendDatagram(node_, owner_.value(), out.Take());
  }
  timeline_.In(kInterval, [this, alive = alive_] {
    if (*alive) Speak();
  });
}

std::vector<PlayerInput> PlayerClient::Read(PlayerNumber player, const Bytes& datagram) {
  ByteReader in(datagram);
  std::vector<PlayerInput> inputs(std::min<std::size_t>(in.U8(), kRepeats));
  for (PlayerInput& input : inputs) {
    input.player = player;
    input.body = PlayerBodyId(player);
    input.number = in.Varint32();
    input.force_n = in.V3f();
  }
  if (!in.ok()) inputs.clear();
  return inputs;
}

}  // namespace tessera::simulation
