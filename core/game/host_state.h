// HostState: what a game host keeps between two ticks that is nobody's record: events whose turn has not come, because
// a tick's work was used up, and how often callbacks have failed. It is part of the region's state, so a death, a
// checkpoint or a promotion loses none of it.
//
// Thread rule: plain values and free functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/game/game_event.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"

namespace tessera::game {

struct FailedCallback {
  std::uint32_t callback = 0;
  std::uint16_t kind = 0;      // place in the scene's kinds; 0: of the world
  std::uint32_t failures = 0;  // in a row
  bool off = false;
  friend bool operator==(const FailedCallback&, const FailedCallback&) = default;
};

struct HostState {
  // The oldest kMaxKeptEvents of one host; several hosts' may be together.
  std::vector<GameEvent> waiting;      // in their order
  std::vector<FailedCallback> failed;  // ascending by callback and kind
  BodyId next_ticked;                  // on_tick of bodies goes on from here; 0: from the first

  bool empty() const { return waiting.empty() && failed.empty() && next_ticked == BodyId(); }
  friend bool operator==(const HostState&, const HostState&) = default;
};

void Write(ByteWriter& out, const HostState& state);
// Leaves a failed reader, or a state that CheckHostState refuses, where the bytes are not sound.
HostState ReadHostState(ByteReader& in);
// INVALID_ARGUMENT: "host: failed callbacks out of order", "host: an event of an unknown callback" and so on.
absl::Status CheckHostState(const HostState& state, std::size_t kinds);

}  // namespace tessera::game
