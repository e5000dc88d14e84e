// PlayerRecord: what the game and a player have said to each other, and whether the player takes part in the world. It
// is part of the record of the player's own body, so it goes wherever that body goes.
//
// Commands are numbered by the client, from 1 on, and taken in order, each once: `last_command` is the number of the
// last one taken. Events are numbered here, and kept until the client says that it has them.
//
// Thread rule: plain values.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/player_limits.h"

namespace tessera::game {

enum class PlayerStage : std::uint8_t {
  kPlaying,     // the body is in the world
  kSpectating,  // the body stands aside, where the player looks from; nobody sees it, and nothing touches it
  kRefused,     // on_join did not let the player in: as kSpectating until the player is gone
  kKicked,      // the same for one who was in
  kDriving,     // the body stands aside, as kSpectating, where the body is that the player's inputs move
};

struct PlayerEvent {
  std::string name;
  std::vector<std::uint8_t> values;  // EncodeFields
  std::size_t bytes() const { return name.size() + values.size(); }
  friend bool operator==(const PlayerEvent&, const PlayerEvent&) = default;
};

struct WaitingCommand {
  std::string bytes;
  std::uint64_t shown_at = 0;  // as PlayerInput::shown_at, when the client gave it
  // The input that it goes with, or 0: the game gets it when that one has acted, or at `due`.
  std::uint32_t with_input = 0;
  Tick due{};
  WaitingCommand() = default;
  // NOLINTBEGIN(google-explicit-constructor): most are nothing but their bytes
  WaitingCommand(std::string text, std::uint64_t shown = 0) : bytes(std::move(text)), shown_at(shown) {}
  WaitingCommand(const char* text) : bytes(text) {}
  // NOLINTEND(google-explicit-constructor)
  friend bool operator==(const WaitingCommand&, const WaitingCommand&) = default;
};

struct PlayerRecord {
  PlayerStage stage = PlayerStage::kPlaying;
  std::string reason;  // why the player was refused or kicked
  std::uint32_t last_command = 0;
  std::vector<WaitingCommand> commands;  // taken, and not given to the game yet, in order
  std::uint32_t last_event = 0;
  std::vector<PlayerEvent> events;  // the newest ones, up to last_event, which the client may not have
  // Another body, which the player's inputs move, or are to move; 0: none. Until `controls_until` the player waits for
  // it; 0: its record is in the same region, and says the same.
  BodyId controls;
  Tick controls_until;
  PlayerLimits limits;  // that the game set

  bool ended() const { return stage == PlayerStage::kRefused || stage == PlayerStage::kKicked; }
  bool hidden() const { return stage != PlayerStage::kPlaying; }
  // The other body that the player's inputs move; 0: none.
  BodyId driven() const { return stage == PlayerStage::kDriving && controls_until == Tick() ? controls : BodyId(); }
  std::uint32_t first_event() const { return last_event + 1 - static_cast<std::uint32_t>(events.size()); }
  std::size_t event_bytes() const;
  // Drops the events up to this number; one that was never made drops nothing.
  void Acknowledge(std::uint32_t event);
  friend bool operator==(const PlayerRecord&, const PlayerRecord&) = default;
};

// A PlayerRecord that is shared until it is changed, because records are copied with each call of a game.
class SharedPlayerRecord {
 public:
  const PlayerRecord& operator*() const;
  const PlayerRecord* operator->() const { return &**this; }
  PlayerRecord& Change();
  bool empty() const { return *this == SharedPlayerRecord(); }
  friend bool operator==(const SharedPlayerRecord& a, const SharedPlayerRecord& b) {
    return a.shared_ == b.shared_ || *a == *b;
  }

 private:
  std::shared_ptr<PlayerRecord> shared_;  // null: as made
};

void Write(ByteWriter& out, const PlayerRecord& record);
// Leaves a failed reader, or a record that CheckPlayerRecord refuses, where the bytes are not sound.
PlayerRecord ReadPlayerRecord(ByteReader& in);
// INVALID_ARGUMENT: "player: events: more than 64", "player: reason: ..." and so on.
absl::Status CheckPlayerRecord(const PlayerRecord& record);

// As game code and the edge give them. INVALID_ARGUMENT with what is wrong: "is empty", "is not UTF-8" ...
absl::Status CheckEventName(std::string_view name);
absl::Status CheckEndReason(std::string_view reason);

}  // namespace tessera::game
