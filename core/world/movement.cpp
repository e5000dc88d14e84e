#include "core/world/movement.h"

#include <algorithm>
#include <string_view>

#include "absl/strings/str_cat.h"

namespace tessera {
namespace {

// Bytes of the name, up to one more than it may have.
std::size_t MovementNameBytes(const char* name) {
  std::size_t bytes = 0;
  while (bytes <= TESSERA_MAX_MOVEMENT_NAME && name[bytes] != '\0') ++bytes;
  return bytes;
}

bool IsMovementName(const char* name) {
  if (name == nullptr) return false;
  const std::size_t bytes = MovementNameBytes(name);
  return bytes > 0 && bytes <= TESSERA_MAX_MOVEMENT_NAME && std::all_of(name, name + bytes, [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
         });
}

}  // namespace

absl::Status CheckMovement(const tessera_movement& table) {
  // Nothing beyond these two may be read of a table of another version.
  if (table.abi != TESSERA_MOVEMENT_ABI) {
    return absl::InvalidArgumentError(absl::StrCat("movement: is made for version ", table.abi,
                                                   " of the interface, and this is version ", TESSERA_MOVEMENT_ABI));
  }
  if (table.size < sizeof(tessera_movement)) {
    return absl::InvalidArgumentError(
        absl::StrCat("movement: has a table of ", table.size, " bytes, of ", sizeof(tessera_movement)));
  }
  if (!IsMovementName(table.name)) {
    return absl::InvalidArgumentError(
        absl::StrCat("movement: name: must be 1 to ", TESSERA_MAX_MOVEMENT_NAME + 0, " letters, digits, '_' and '-'"));
  }
  if (table.state_bytes > TESSERA_MAX_MOVEMENT_STATE) {
    return absl::InvalidArgumentError(absl::StrCat("movement ", table.name, ": state_bytes: ", table.state_bytes,
                                                   " are more than ", TESSERA_MAX_MOVEMENT_STATE + 0));
  }
  if (table.move == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat("movement ", table.name, ": move: is missing"));
  }
  return absl::OkStatus();
}

absl::StatusOr<GameMovement> MovementIn(const Scene& scene, const tessera_movement& table) {
  if (absl::Status status = CheckMovement(table); !status.ok()) return status;
  GameMovement movement{table.name, table.version, table.state_bytes, std::nullopt, &table};
  if (!scene.player) {
    return absl::InvalidArgumentError(absl::StrCat("movement ", table.name, ": the scene has no player"));
  }
  if (table.kind == nullptr) return movement;
  const auto kind = std::find(scene.kinds.begin(), scene.kinds.end(), std::string_view(table.kind));
  if (kind == scene.kinds.end()) {
    return absl::InvalidArgumentError(
        absl::StrCat("movement ", table.name, ": kind: the scene has no kind \"", table.kind, "\""));
  }
  movement.kind = static_cast<std::uint16_t>(kind - scene.kinds.begin());
  return movement;
}

MovementState StateFor(const GameMovement& movement, BodyId body, const MovementState& state) {
  const bool its = state.body == body && state.version == movement.version && state.size == movement.state_bytes;
  if (its) return state;
  return {.body = body, .version = movement.version, .size = static_cast<std::uint8_t>(movement.state_bytes)};
}

void Write(ByteWriter& out, const MovementState& state) {
  out.Varint(state.body.value());
  if (state.body == BodyId()) return;
  out.Varint(state.version);
  out.Block(state.used());
}

MovementState ReadMovementState(ByteReader& in) {
  MovementState state;
  state.body = BodyId(in.Varint());
  if (state.body == BodyId()) return state;
  state.version = in.Varint32();
  const std::span<const std::uint8_t> bytes = in.Block(state.bytes.size());
  state.size = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), state.bytes.begin());
  return state;
}

}  // namespace tessera
