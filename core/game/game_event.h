// GameEvent: what a step did to two bodies, or an area effect to one, for the callbacks of a game. One whose turn has
// not come is part of the region's state, and goes with its body to another region.
//
// Thread rule: plain values and free functions.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera::game {

// Two bodies that began or ended to touch or to overlap, or one that an area effect has pushed: `callback` is one of
// kOnBodyContact to kOnBodyLeft, or kOnBodyBlast, called for `self`.
struct GameEvent {
  // The place where two bodies met.
  struct Contact {
    Vec3d point;         // m in the world
    Vec3d normal;        // unit, from the other body towards `self`; 0 where it is not known
    double impulse = 0;  // N s, in the step in which they met
    friend bool operator==(const Contact&, const Contact&) = default;
  };
  std::uint32_t callback = 0;
  BodyId self, other;
  std::optional<Contact> contact = std::nullopt;
  // Set for kOnBodyBlast: `other` is the body that it is by, or 0.
  struct Blown {
    Vec3d at;
    double share = 0;
    std::string name;
    friend bool operator==(const Blown&, const Blown&) = default;
  };
  std::optional<Blown> blown = std::nullopt;
  friend bool operator==(const GameEvent&, const GameEvent&) = default;
};

void Write(ByteWriter& out, std::span<const GameEvent> events);
// At most so many. Leaves a failed reader, or events that CheckEvents refuses, where the bytes are not sound.
std::vector<GameEvent> ReadEvents(ByteReader& in, std::size_t most);
// INVALID_ARGUMENT: "an event of an unknown callback", "an event that is not sound".
absl::Status CheckEvents(std::span<const GameEvent> events);

}  // namespace tessera::game
