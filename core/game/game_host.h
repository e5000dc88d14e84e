// GameHost: runs a game in one region: takes what happened in a tick, calls the game in one canonical order, and
// commits what each call asked for, or none of it.
//
//   absl::StatusOr<std::unique_ptr<GameHost>> host = GameHost::Load(*LuaGameModule(), {"game.lua", text}, scene, {});
//   (*host)->Run(tick, events, world);             // after each step
//   for (const GameLine& line : (*host)->TakeLines()) log(line);
//
// Pure: no file, socket or clock. The game's own state is nothing that counts: Renew() loads it again between any two
// ticks and the results stay the same; what counts is in properties and records, which the region carries along.
//
// Order of a tick: on_tick of the world; contacts and overlaps of the step, as they are given; by body, that it
// expires, or its timers that are due, by when and in which order they were set; on_tick of bodies, by id. Work is
// counted in instructions. Where a tick's are used up, contacts wait for the next tick in their order, timers stay due,
// and on_tick of bodies goes on with the next body in the next tick.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/game/game_file.h"
#include "core/game/game_world.h"
#include "core/game/settings.h"
#include "core/game/transaction.h"
#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

// Two bodies that began or ended to touch or to overlap: `callback` is one of kOnBodyContact to kOnBodyLeft, called for
// `self`.
struct GameEvent {
  std::uint32_t callback = 0;
  BodyId self, other;
  friend auto operator<=>(const GameEvent&, const GameEvent&) = default;
};

// For the log: what the game wrote, or why a call of it failed. The text is UTF-8, whatever the game made of it.
struct GameLine {
  Tick tick;
  BodyId self;  // 0: the world
  bool error = false;
  std::string text;
  bool off = false;  // the error says that a callback is not called any more
};

struct GameStatistics {
  std::uint64_t calls = 0, errors = 0, instructions = 0;
  std::uint64_t spawned = 0, expired = 0;  // bodies
  std::uint64_t dropped_events = 0;        // more waited than kMaxWaitingEvents
  std::uint64_t dropped_lines = 0;
  std::uint32_t callbacks_off = 0;  // failed too often in a row, and are not called any more
};

class GameHost {
 public:
  // `module` outlives the host. INVALID_ARGUMENT: another version of the interface, or what the game says, in one line
  // with file and line.
  static absl::StatusOr<std::unique_ptr<GameHost>> Load(const tessera_game_module& module, GameFile file,
                                                        std::shared_ptr<const Scene> scene, GameSettings settings = {},
                                                        std::uint64_t seed = 0);
  ~GameHost();
  GameHost(const GameHost&) = delete;
  GameHost& operator=(const GameHost&) = delete;

  // After the step to `tick`. `events` of bodies that the region does not own are left out; their owner calls them.
  void Run(Tick tick, std::span<const GameEvent> events, GameWorld& world);
  // Loads the game's code anew.
  absl::Status Renew();
  // Lets `act` call the functions of the interface as a callback of the world would right after `tick`, and discards
  // what it asked for. For tools that look at a game from outside.
  using Inspection = absl::FunctionRef<void(const tessera_game_host&, tessera_game_call*)>;
  void Inspect(Tick tick, GameWorld& world, Inspection act) const;

  // Whether any body's kind has on_tick, so that a tick costs something without events.
  bool ticks() const { return ticks_; }
  std::vector<GameLine> TakeLines();
  const GameStatistics& statistics() const { return statistics_; }

 private:
  struct Handler {
    bool there = false, off = false;
    std::uint32_t failures = 0;  // in a row
  };

  GameHost(const tessera_game_module& module, GameFile file, std::shared_ptr<const Scene> scene, GameSettings settings,
           std::uint64_t seed);
  void FindHandlers();
  Handler& HandlerOf(std::uint32_t callback, std::uint16_t kind);
  Transaction Begin(GameWorld& world) const;
  bool Exhausted() const { return used_ >= settings_.instructions_per_tick; }

  void RunEvents(GameWorld& world);
  void RunTimers(GameWorld& world);
  void RunBodyTicks(GameWorld& world);
  void RunTimersOf(BodyId id, GameWorld& world);
  // Calls the game if it has the callback and it is not off. `prepare` changes what is committed with the call's own
  // effects, and is kept when the call fails.
  template <class Prepare>
  void Call(GameWorld& world, std::uint32_t callback, BodyId self, std::uint16_t kind,
            std::span<const tessera_game_value> arguments, const Prepare& prepare);
  void Call(GameWorld& world, std::uint32_t callback, BodyId self, std::uint16_t kind,
            std::span<const tessera_game_value> arguments);
  void NoteFailure(Handler& handler, std::uint32_t callback, BodyId self, std::uint16_t kind, std::string text);
  void Say(GameLine line);

  const tessera_game_module& module_;
  const GameFile file_;
  const std::shared_ptr<const Scene> scene_;
  const GameSettings settings_;
  const std::uint64_t seed_;
  void* game_ = nullptr;
  std::vector<Handler> handlers_;  // by callback and kind, kinds within a callback; written by FindHandlers and Call
  bool ticks_ = false;

  Tick tick_;
  std::uint64_t used_ = 0;         // instructions in this tick
  std::size_t made_ = 0;           // bodies in this tick
  std::deque<GameEvent> waiting_;  // events whose turn has not come
  BodyId next_ticked_;             // on_tick of bodies goes on from here; 0: from the first
  std::size_t lines_this_tick_ = 0;
  std::vector<GameLine> lines_;
  GameStatistics statistics_;
};

}  // namespace tessera::game
