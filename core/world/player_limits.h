// PlayerLimits: the most that a game allows a player's inputs, instead of what the scene does.
//
// Region and client apply them alike (core/region/region_players.h). Thread rule: plain values.
#pragma once

#include <optional>

#include "core/world/bytes.h"
#include "core/world/math.h"
#include "core/world/scene.h"

namespace tessera {

struct PlayerLimits {
  // A field that is left out is as the scene has it.
  std::optional<float> force_n, torque_nm;  // 0: inputs do not push, or do not turn
  std::optional<float> speed_m_s;           // as PlayerRules::max_speed_m_s; a character walks and runs no faster
  Vec3f axes{1, 1, 1};                      // share of an input's force along each axis of the world, 0 to 1

  bool empty() const { return *this == PlayerLimits(); }
  friend bool operator==(const PlayerLimits&, const PlayerLimits&) = default;
};

// The name of a field whose value nobody may set, or null: not a number, below 0, or more than can be computed.
const char* WrongField(const PlayerLimits& limits);

// The scene's rules with these limits: the greatest force, the greatest speed, and the speeds of a character.
PlayerRules RulesWith(const PlayerRules& rules, const PlayerLimits& limits);

void Write(ByteWriter& out, const PlayerLimits& limits);
// Leaves a failed reader where flags are unknown; numbers are not judged.
PlayerLimits ReadPlayerLimits(ByteReader& in);

}  // namespace tessera
