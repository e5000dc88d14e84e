// GameRecord: what a game keeps with a body, beside its properties: the timers that are to come, when the body expires,
// and what the game pushes it with in the next step. It goes wherever the body goes.
//
// Thread rule: plain values.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera::game {

struct GameTimer {
  Tick due;
  std::uint32_t number = 0;  // each timer of a body has another one
  std::string name;
  std::vector<std::uint8_t> values;  // EncodeFields
  friend bool operator==(const GameTimer&, const GameTimer&) = default;
};

struct GameRecord {
  std::uint32_t last_timer = 0;   // highest number that a timer of the body ever had
  std::vector<GameTimer> timers;  // ascending by (due, number)
  Tick expires;                   // the body is removed then; 0: it stays
  Vec3f push_ns, push_nms;        // in the next step, about the centre of mass

  bool empty() const { return *this == GameRecord(); }
  bool pushes() const { return push_ns != Vec3f() || push_nms != Vec3f(); }
  // The next tick in which the host has to look at it, for a timer or because it expires.
  std::optional<Tick> next_due() const {
    if (timers.empty()) return expires == Tick() ? std::nullopt : std::optional(expires);
    return expires == Tick() ? timers.front().due : std::min(timers.front().due, expires);
  }
  friend bool operator==(const GameRecord&, const GameRecord&) = default;
};

void Write(ByteWriter& out, const GameRecord& record);
// Leaves a failed reader, or a record that CheckRecord refuses, where the bytes are not sound.
GameRecord ReadRecord(ByteReader& in);
// INVALID_ARGUMENT: "timers: out of order", "timers: more than 16", "timers: values: truncated", "push: is not finite"
// and so on.
absl::Status CheckRecord(const GameRecord& record);

}  // namespace tessera::game
