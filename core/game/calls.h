// The functions of the table (game_sdk/api/api.h), carried out on a transaction.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/game/effect.h"
#include "core/game/settings.h"
#include "core/game/transaction.h"
#include "core/game/value.h"
#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

// A player moves another body from now on; body 0: none, for the reason.
struct ControlNews {
  PlayerNumber player;
  BodyId body;
  std::string reason;
};

}  // namespace tessera::game

// One call of a module; the interface passes pointers to it.
struct tessera_game_call {
  tessera_game_call(tessera::game::Transaction& changes, tessera::Tick now, tessera::BodyId about,
                    std::uint64_t random_seed, std::uint64_t instruction_budget)
      : transaction(changes), tick(now), self(about), seed(random_seed), budget(instruction_budget) {}

  tessera::game::Transaction& transaction;
  const tessera::Tick tick;
  const tessera::BodyId self;  // the body that the callback is about; 0 for the world, kInstanceBody for its record
  tessera::BodyId other;       // the other body that it is about, if any
  const std::uint64_t seed;
  const std::uint64_t budget;  // instructions

  std::uint32_t callback = 0;  // that is called
  std::uint64_t shown_at = 0;  // within on_command: PlayerInput::shown_at of the command
  std::uint32_t claim = 0;     // within on_command: its number, if the client shows a body that it is to make; else 0
  bool claimed = false;        // a body was made for it
  std::uint64_t instructions = 0;
  std::uint32_t randoms = 0;
  std::string error;
  // They hold the text, the values and the fields that a result points to.
  std::string text;
  std::vector<tessera_game_value> values;
  std::vector<tessera_game_field> fields;
  std::optional<tessera::game::EffectCounts> effects;    // those of a call that asked for any; `done`: if it succeeds
  std::vector<tessera::game::ControlNews> control_news;  // from a message that was carried out
};

namespace tessera::game {

// The host's side of the interface; for all games.
const tessera_game_host& GameFunctions();
// Carries out a message with a verb, for a body that the region owns.
absl::Status CarryOut(tessera_game_call& call, BodyId target, const Message& message);

}  // namespace tessera::game
