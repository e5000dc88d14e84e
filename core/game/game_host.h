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
// Order of a tick: on_migrate of the world, and of bodies by id, that an older game left; on_control of what ended, or
// came together, by body; on_tick of the world; on_join, on_command and on_leave of players, by their numbers; contacts
// and overlaps of the step, as they are given; messages, by when they are due and by their senders; answers, by their
// askers; by body, that it expires, or its timers that are due, by when and in which order they were set; on_tick of
// bodies, by id. Work is counted in instructions. Where a tick's are used up, commands wait in their records, contacts
// wait for the next tick in their order, messages and timers stay due, and on_tick of bodies goes on with the next body
// in the next tick.
//
// It has some 55 methods: one for each step of that order, those around a call, and those for a region between two
// ticks. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/game/effect.h"
#include "core/game/game_event.h"
#include "core/game/game_file.h"
#include "core/game/game_world.h"
#include "core/game/host_state.h"
#include "core/game/settings.h"
#include "core/game/transaction.h"
#include "core/world/movement.h"
#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

struct ControlNews;  // calls.h

// Players who came and who go in this tick, each ascending. Their bodies are owned here.
struct PlayerChanges {
  std::vector<PlayerNumber> joined, leaving;
};

// For the log: what the game wrote, or why a call of it failed. The text is UTF-8, whatever the game made of it.
struct GameLine {
  Tick tick;
  BodyId self;  // 0: the world
  bool error = false;
  std::string text;
  bool off = false;  // the error says that a callback is not called any more
};

// Messages that this region's bodies sent and got.
struct MessageStatistics {
  static constexpr std::size_t kHops = 8;  // the last stands for more as well
  std::uint64_t sent = 0, applied = 0;
  std::uint64_t late = 0;                   // applied after the tick that they were due in
  std::uint64_t failed = 0;                 // functions of bodies that were carried out for another region, and failed
  std::uint64_t unheard = 0;                // applied, but the target has no on_message
  std::uint64_t by_hops[kHops] = {};        // applied; 0: within a region
  std::uint64_t ticks = 0, most_ticks = 0;  // from when they were made until they were applied: the sum, the longest
};

struct GameStatistics {
  std::uint64_t calls = 0, errors = 0, instructions = 0;
  std::uint64_t spawned = 0, expired = 0;  // bodies
  std::uint64_t dropped_events = 0;        // more waited than kMaxWaitingEvents
  std::uint64_t dropped_lines = 0;
  std::uint64_t dropped_counts = 0;              // the game had kMaxCounters counters already
  std::uint32_t callbacks_off = 0;               // failed too often in a row, and are not called any more
  std::uint64_t published = 0, unpublished = 0;  // events for the backend that came to the world's record; left out
  MessageStatistics messages;
  EffectCounts effects{};  // those that callbacks asked for, and those that were carried out for other regions
};

struct CallbackCost {
  std::uint64_t calls = 0, errors = 0, instructions = 0;
};

// The body with which an event goes to another region: the one that it is called for, or, where that one does not move
// and so is in every region, the other one.
BodyId CarrierOf(const GameEvent& event, const GameWorld& world);

// The movement of the module's table; null without one.
const tessera_movement* OwnMovement(const tessera_game_module& module);

class GameHost {
 public:
  // `module` outlives the host. INVALID_ARGUMENT: another version of the interface, a movement that cannot be this
  // scene's, or what the game says, in one line with file and line.
  static absl::StatusOr<std::unique_ptr<GameHost>> Load(const tessera_game_module& module, GameFile file,
                                                        std::shared_ptr<const Scene> scene, GameSettings settings = {},
                                                        std::uint64_t seed = 0, std::uint32_t number = 0);
  ~GameHost();
  GameHost(const GameHost&) = delete;
  GameHost& operator=(const GameHost&) = delete;

  // After the step to `tick`. `events` of bodies that the region does not own are sent to their owners, once each, by
  // the other body of the pair where that one is owned here; others are left out.
  // Bodies of players that leave are removed.
  void Run(Tick tick, std::span<const GameEvent> events, GameWorld& world, const PlayerChanges& players = {});
  // Loads the game's code anew.
  absl::Status Renew();
  // State that is not in any record, as it is between two ticks.
  HostState State() const;
  // Another host's, in whose place this one goes on or begins: events of bodies that `has` says are here wait after
  // those that wait already, and a callback that is off there is off.
  void Adopt(const HostState& state, absl::FunctionRef<bool(const GameEvent&)> has);
  // Events that go where this body goes, in their order, to be taken along by it: they wait here no more. At most
  // kMaxCarriedEvents; later ones are dropped and counted.
  std::vector<GameEvent> TakeWaiting(BodyId body, const GameWorld& world);
  // Events that came along with a body: they wait after those that wait already.
  void Wait(std::span<const GameEvent> events);
  bool waits() const { return !waiting_.empty(); }
  // Whether the event goes to its body in a message of the other body's, which reports it: the body is owned elsewhere,
  // or an earlier event of the pair is still on such a way. The world calls it for the ends of touches of a body that
  // it is about to remove.
  bool TellByMessage(const GameEvent& event, GameWorld& world);
  // Takes the place of another game of the same world: events that wait and lines are this one's now, and its figures
  // go on.
  void TakeOver(GameHost& other);
  // 0 for the game that the world began with, one more for each that took its place.
  std::uint32_t number() const { return number_; }
  // Lets `act` call the functions of the interface as a callback of the world would right after `tick`, and discards
  // what it asked for. For tools that look at a game from outside.
  using Inspection = absl::FunctionRef<void(const tessera_game_host&, tessera_game_call*)>;
  void Inspect(Tick tick, GameWorld& world, Inspection act) const;

  // How players' inputs move bodies: the module's own movement, or that beside the file; null without one.
  const GameMovement* movement() const { return movement_ ? &*movement_ : nullptr; }
  // It has moved this player's body in this tick, or failed to, and why. A player for whom it fails is named in one
  // line, and again only after kMovementSilence ticks without a failure.
  void NoteMoved(Tick tick, PlayerNumber player, const std::string& error);
  static constexpr std::uint64_t kMovementSilence = 600;

  // Whether the game has this callback of the world, off or not.
  bool Has(std::uint32_t world_callback) const;
  // Whether any body's kind has on_tick, so that a tick costs something without events.
  bool ticks() const { return ticks_; }
  std::vector<GameLine> TakeLines();
  const GameStatistics& statistics() const { return statistics_; }
  // The game's own counters, at most kMaxCounters.
  const std::map<std::string, std::uint64_t>& counters() const { return counters_; }
  // Gives what each callback has cost, by its name: "on_tick", "kinds.gate.on_entered".
  const std::map<std::string, CallbackCost>& costs() const { return costs_; }

 private:
  struct Handler {
    bool there = false, off = false;
    bool missed = false;           // a message came for it though it is not there, and that was said
    std::uint32_t failures = 0;    // in a row
    CallbackCost* cost = nullptr;  // in costs_; null before the first call
  };

  GameHost(const tessera_game_module& module, GameFile file, std::shared_ptr<const Scene> scene, GameSettings settings,
           std::uint64_t seed, std::uint32_t number);
  void FindHandlers();
  Handler& HandlerOf(std::uint32_t callback, std::uint16_t kind);
  Transaction Begin(GameWorld& world) const;
  bool Exhausted() const { return used_ >= settings_.instructions_per_tick; }

  void RunMigrations(GameWorld& world);
  void SettleAllJoints(GameWorld& world);
  void SettleAllControl(GameWorld& world);
  void TellOfControl(std::span<const ControlNews> news, GameWorld& world);
  void RunJoins(std::span<const PlayerNumber> joined, GameWorld& world);
  void RunCommands(std::span<const PlayerNumber> leaving, GameWorld& world);
  void RunLeaves(std::span<const PlayerNumber> leaving, GameWorld& world);
  void RunEvents(GameWorld& world);
  void RunToldEvent(BodyId target, const HeldMessage& message, GameWorld& world);
  void RunMessages(GameWorld& world);
  void RunMessage(BodyId target, const HeldMessage& message, GameWorld& world);
  void RunAnswers(GameWorld& world);
  void RunAnswer(BodyId asker, const GameQuestion& question, const Answer& answer, GameWorld& world);
  void RunTimers(GameWorld& world);
  void RunBodyTicks(GameWorld& world);
  void RunTimersOf(BodyId id, GameWorld& world);
  // Calls the game if it has the callback and it is not off. `prepare` changes what is committed with the call's own
  // effects, and is kept when the call fails.
  using Prepare = absl::FunctionRef<bool(Transaction&)>;
  void Call(GameWorld& world, std::uint32_t callback, BodyId self, std::uint16_t kind,
            std::span<const tessera_game_value> arguments, Prepare prepare);
  void Call(GameWorld& world, std::uint32_t callback, BodyId self, std::uint16_t kind,
            std::span<const tessera_game_value> arguments);
  void NoteCost(Handler& handler, std::uint32_t callback, std::uint16_t kind, std::uint64_t instructions, bool failed);
  void NoteEffects(const EffectCounts& of_call, bool failed);
  // Carries out a message with a verb, for a body that the region owns.
  void RunVerb(BodyId target, const HeldMessage& message, GameWorld& world);
  // An event for the backend has come to the world's record.
  void RunPublish(const HeldMessage& message, GameWorld& world);
  void NoteApplied(const HeldMessage& message);
  // The target has no on_message: counted, and said once for each kind.
  void NoteUnheard(BodyId target, std::uint16_t kind, const HeldMessage& message);
  void NoteFailure(Handler& handler, std::uint32_t callback, BodyId self, std::uint16_t kind, std::string text);
  std::string NameOf(std::uint32_t callback, std::uint16_t kind) const;
  void Say(GameLine line);

  const tessera_game_module& module_;
  std::optional<GameMovement> movement_;
  std::map<PlayerNumber, Tick> movement_failed_;  // the newest failure of each, as long as it may be silent about it
  const GameFile file_;
  const std::shared_ptr<const Scene> scene_;
  const GameSettings settings_;
  const std::uint64_t seed_;
  const std::uint32_t number_;
  void* game_ = nullptr;
  std::vector<Handler> handlers_;  // by callback and kind, kinds within a callback; written by FindHandlers and Call
  bool ticks_ = false, migrates_ = false;

  Tick tick_;
  std::uint64_t used_ = 0;         // instructions in this tick
  std::size_t made_ = 0;           // bodies in this tick
  bool removed_ = false;           // a callback removed a body since on_tick of bodies began
  std::size_t sent_ = 0;           // messages in this tick
  std::uint64_t shown_at_ = 0;     // time that the sender of the command under way was shown
  std::uint32_t claim_ = 0;        // number of that command, if its client shows a body that it is to make
  std::deque<GameEvent> waiting_;  // events whose turn has not come
  BodyId next_ticked_;             // on_tick of bodies goes on from here; 0: from the first
  std::size_t lines_this_tick_ = 0;
  std::vector<GameLine> lines_;
  GameStatistics statistics_;
  std::map<std::string, std::uint64_t> counters_;
  std::map<std::string, CallbackCost> costs_;
};

}  // namespace tessera::game
