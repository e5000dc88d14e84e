// PlayerInput: what a player asks of one body in one tick. Client, wire, game port, region, frames and log all carry
// this one struct, so a new field is added here and in player_input.cpp, which every codec uses.
//
// Force and torque push the body in scenes whose players are moved by force; the move vector, the look angles and the
// buttons steer a character (core/world/character.h). An input may have all of them: the scene decides what counts.
//
// Players send each input several times because datagrams get lost. core/region/region_players.h alone decides which
// copy counts. Thread rule: free functions on values.
#pragma once

#include <cstdint>

#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera {

struct PlayerInput {
  std::uint32_t number = 0;      // from 1, counts up by one with each input of the player
  PlayerNumber player{};         // a receiver takes it from the connection, never from the message
  BodyId body{};                 // the body to move; a region refuses all but the player's own
  Tick target{};                 // the tick for which the player means it; 0: as soon as it arrives
  Vec3f force_n{}, torque_nm{};  // world frame; the scene's limits are applied when its tick comes
  // Share of the greatest speed, x to the right and y forward as the player looks; at most 1 long.
  Vec2f move{};
  // Where the player looks: yaw about +y, 0 along -z and positive to the left, -pi to pi; pitch up, -pi/2 to pi/2.
  float yaw_rad = 0, pitch_rad = 0;
  std::uint32_t buttons = 0;  // bit i: button i is held down
  // The moment of the world that the player was shown when the input was made, in 1/kShownParts of a tick; 0: not said.
  std::uint64_t shown_at = 0;
  friend bool operator==(const PlayerInput&, const PlayerInput&) = default;
};

// Parts of a tick in which a client says what moment it shows: what moves at 50 m/s is then known to 3 mm.
inline constexpr std::uint64_t kShownParts = 256;
// The moment `tick`, a tick and a part of one, as inputs and commands carry it; 0 for one that is none.
std::uint64_t ShownAt(double tick);

// A move vector may be longer than 1 by this much, which rounding adds.
inline constexpr float kMoveTolerance = 1e-3F;

// The field whose value no player may send, and how it is wrong, e.g. "move is longer than 1"; null if there is none.
const char* WrongField(const PlayerInput& input);

// The input as the other end will read it: the move vector and the look angles as multiples of what the wire resolves,
// and within their limits. A client predicts with this one, so that it does the same as the region.
PlayerInput AsSent(PlayerInput input);

// The fields from `force_n` to `shown_at`; one that is 0 costs nothing but its part of a byte. A move vector comes back
// in multiples of 1/32767, angles of 2 pi / 65536 (yaw) and pi / 65534 (pitch).
void WriteSteering(ByteWriter& out, const PlayerInput& input);
void ReadSteering(ByteReader& in, PlayerInput& input);
inline constexpr std::size_t kMinSteeringBytes = 1;

}  // namespace tessera
