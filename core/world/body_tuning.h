// BodyTuning: what a game changed of a body's definition while the world runs, and whose client has shown the body
// before it was made. What is left out is as the scene has it.
//
// It goes wherever the body goes, and whoever steps a copy of the body has it too. Thread rule: plain values.
#pragma once

#include <cstdint>
#include <optional>

#include "core/world/bytes.h"
#include "core/world/scene.h"

namespace tessera {

// A client shows what its player throws at once; this says which of its bodies the one in the world is.
struct SpawnClaim {
  PlayerNumber player;
  std::uint32_t command = 0;  // number of the player's command by which the game made the body, from 1 on
  friend bool operator==(const SpawnClaim&, const SpawnClaim&) = default;
};

struct BodyTuning {
  std::optional<float> gravity_scale;                   // as BodyDef has it, -10 to 10
  std::optional<float> friction, restitution;           // as Material has them
  std::optional<Visibility> visible_to = std::nullopt;  // as BodyDef has it
  std::optional<SpawnClaim> claim = std::nullopt;       // set when it is made, and never changed

  bool empty() const { return !gravity_scale && !friction && !restitution && !visible_to && !claim; }
  friend bool operator==(const BodyTuning&, const BodyTuning&) = default;
};

inline constexpr float kMaxTunedGravity = 10;

// The definition with these changes.
double GravityScaleOf(const BodyDef& def, const BodyTuning& tuning);
Material MaterialOf(const BodyDef& def, const BodyTuning& tuning);

inline Visibility VisibilityOf(const BodyDef& def, const BodyTuning& tuning) {
  return tuning.visible_to.value_or(def.visible_to);
}

// All is finite and within its range.
bool IsSane(const BodyTuning& tuning);

void Write(ByteWriter& out, const BodyTuning& tuning);
// Leaves a failed reader where flags are unknown; numbers are not judged.
BodyTuning ReadTuning(ByteReader& in);

}  // namespace tessera
