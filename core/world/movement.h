// GameMovement: a movement that a game wrote (tessera/movement.h), checked, and the state that it carries from tick to
// tick. core/physics/game_movement.h calls it.
//
//   absl::StatusOr<GameMovement> car = CheckMovement(*module.movement, scene);
//   if (car->Moves(def)) ...
//
// Thread rule: plain values and free functions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/scene.h"
#include "game_sdk/include/tessera/movement.h"

namespace tessera {

struct GameMovement {
  std::string name;
  std::uint32_t version = 0;
  std::size_t state_bytes = 0;
  std::optional<std::uint16_t> kind;  // place in the scene's kinds; nothing: it moves bodies of all kinds
  const tessera_movement* table = nullptr;

  bool Moves(const BodyDef& def) const { return !kind || *kind == def.kind; }
};

// Judges the table itself, whatever the scene: INVALID_ARGUMENT "movement: is made for version 8 of the
// interface, and this is version 1", or naming the field.
absl::Status CheckMovement(const tessera_movement& table);
// And the table in this scene, which may have no such kind, or no player. `table` outlives the result.
absl::StatusOr<GameMovement> MovementIn(const Scene& scene, const tessera_movement& table);

// A movement's private state. It is `body`'s, and of that version of that movement; for others it counts as all 0.
struct MovementState {
  BodyId body{};  // 0: no movement has moved anything
  std::uint32_t version = 0;
  std::uint8_t size = 0;
  alignas(double) std::array<std::uint8_t, TESSERA_MAX_MOVEMENT_STATE> bytes{};

  std::span<const std::uint8_t> used() const { return {bytes.data(), size}; }
  friend bool operator==(const MovementState&, const MovementState&) = default;
};

// `state` if it is this movement's for this body, else one that is all 0.
MovementState StateFor(const GameMovement& movement, BodyId body, const MovementState& state);

// One byte where there is none.
void Write(ByteWriter& out, const MovementState& state);
// Leaves a failed reader where the size is beyond the limit.
MovementState ReadMovementState(ByteReader& in);

}  // namespace tessera
