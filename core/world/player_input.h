// PlayerInput: what a player asks of one body in one tick. Client, wire, game port, region, frames and log all carry
// this one struct, so a new field is added here and in the codecs (core/replication/input.cpp, core/region/frame.cpp).
//
// Players send each input several times because datagrams get lost. core/region/region_players.h alone decides which
// copy counts.
#pragma once

#include <cstdint>

#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera {

struct PlayerInput {
  std::uint32_t number = 0;      // from 1, counts up by one with each input of the player
  PlayerNumber player{};         // a receiver takes it from the connection, never from the message
  BodyId body{};                 // the body to move; a region refuses all but the player's own
  Tick target{};                 // the tick for which the player means it; 0: as soon as it arrives
  Vec3f force_n{}, torque_nm{};  // world frame; the scene's limits are applied when its tick comes
  friend bool operator==(const PlayerInput&, const PlayerInput&) = default;
};

}  // namespace tessera
