// The arguments that game code gives to a function of the table: their check by the table, and what they hold. Here are
// also the results that need no GameValue in between.
//
// Promise: every function of the host reads its arguments by these, and by OptionReader where they are named; what is
// wrong is named as game code wrote it: "impulse: `impulse` must be a vector, got a text".
//
// Thread rule: free functions.
#pragma once

#include <span>
#include <string_view>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/world/ids.h"
#include "core/world/math.h"
#include "game_sdk/api/api.h"
#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

using CallArguments = std::span<const tessera_game_value>;

inline absl::string_view ViewOf(std::string_view text) { return {text.data(), text.size()}; }

absl::Status ArgumentFault(std::string_view function, std::string_view what);
// The arguments after the receiver, by the table: how many, of which types, and finite.
absl::Status CheckArguments(const Function& function, CallArguments arguments);

// --- What they hold, where the type is known.
inline std::string_view TextGiven(const tessera_game_value& value) { return {value.as.text, value.count}; }
inline Vec3d VectorGiven(const tessera_game_value& value) {
  return {value.as.vector[0], value.as.vector[1], value.as.vector[2]};
}
inline Quatd RotationGiven(const tessera_game_value& value) {
  const double* q = value.as.rotation;
  return {q[0], q[1], q[2], q[3]};
}
inline bool IsNumber(const tessera_game_value& value) {
  return value.type == TESSERA_GAME_REAL || value.type == TESSERA_GAME_WHOLE;
}
inline double NumberGiven(const tessera_game_value& value) {
  return value.type == TESSERA_GAME_REAL ? value.as.real : static_cast<double>(value.as.whole);
}
inline std::span<const tessera_game_field> FieldsGiven(const tessera_game_value& value) {
  return {value.as.fields, value.count};
}
// Whether an optional one is there.
inline bool IsGiven(CallArguments arguments, std::size_t index) {
  return arguments.size() > index && arguments[index].type != TESSERA_GAME_NOTHING;
}

// --- Results. A text is not copied.
inline tessera_game_value TextResult(std::string_view text) {
  tessera_game_value result{};
  result.type = TESSERA_GAME_TEXT;
  result.count = static_cast<std::uint32_t>(text.size());
  result.as.text = text.data();
  return result;
}
inline tessera_game_value FlagResult(bool flag) {
  tessera_game_value result;
  result.type = TESSERA_GAME_FLAG, result.count = 0, result.as.whole = flag ? 1 : 0;
  return result;
}
inline tessera_game_value RealResult(double real) {
  tessera_game_value result;
  result.type = TESSERA_GAME_REAL, result.count = 0, result.as.real = real;
  return result;
}
inline tessera_game_value BodyResult(BodyId id) {
  tessera_game_value result;
  result.type = TESSERA_GAME_BODY, result.count = 0, result.as.id = id.value();
  return result;
}
inline tessera_game_value VectorResult(Vec3d v) {
  tessera_game_value result;
  result.type = TESSERA_GAME_VECTOR, result.count = 0;
  result.as.vector[0] = v.x, result.as.vector[1] = v.y, result.as.vector[2] = v.z;
  return result;
}
inline tessera_game_value RotationResult(Quatd q) {
  tessera_game_value result{};
  result.type = TESSERA_GAME_ROTATION;
  result.as.rotation[0] = q.x, result.as.rotation[1] = q.y, result.as.rotation[2] = q.z, result.as.rotation[3] = q.w;
  return result;
}

}  // namespace tessera::game
