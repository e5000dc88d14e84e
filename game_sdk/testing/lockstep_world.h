// LockstepWorld: a world with a game in several regions of one process, in lockstep under virtual time: what a game's
// own tests run on. Regions hand bodies over, stream their logs to standbys and die, as they do on many machines; a
// second of the world takes as long as its steps.
//
//   auto world = LockstepWorld::Create(*LuaGameModule(), {"game.lua", text}, scene, {.regions = 4});
//   for (int i = 0; i < 60; ++i) CHECK((*world)->Step().ok());
//   (*world)->Kill((*world)->OwnerOf(BodyId(3)));
//   (*world)->Call(kBodySet, arguments, result, error);     // as game code, in the next tick
//
// The same options give the same bits. RegionGroup (tests/simulation) asks whether the order of messages changes a
// world, and Simulation what a network does to it; neither matters to a game, so frames arrive here at once, and a
// death comes between two ticks.
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/game/game_host.h"
#include "core/game/value.h"
#include "core/region/region.h"
#include "core/region/standby_copy.h"
#include "game_sdk/api/api.h"
#include "game_sdk/testing/kept_value.h"
#include "game_sdk/testing/watched_module.h"

namespace tessera::game {

struct LockstepOptions {
  std::uint32_t regions = 4;
  std::uint64_t seed = 1;  // seeds the game's random numbers, and the following
  GameSettings settings;
  // The game's code is loaded anew before callbacks: each of the first kAlwaysFresh ones, and one of kThenFreshOf
  // later.
  bool fresh_states = false;
  // Now and then, drawn from the seed, a region dies, or loads the game's code anew.
  bool deaths = false;
};

inline constexpr std::uint64_t kAlwaysFresh = 2000, kThenFreshOf = 64;
// Mean number of ticks between two deaths, and two fresh states, where deaths are asked for.
inline constexpr std::uint64_t kTicksOfALife = 60, kTicksOfAState = 7;

class LockstepWorld : private Watcher {
 public:
  // `module` outlives the world. Errors: what GameHost::Load and MakeGridMap refuse.
  static absl::StatusOr<std::unique_ptr<LockstepWorld>> Create(const tessera_game_module& module, GameFile game,
                                                               std::shared_ptr<const Scene> scene,
                                                               const LockstepOptions& options);
  ~LockstepWorld() override;

  // One tick of all regions. INTERNAL: regions do not agree, which is a fault of the engine; INVALID_ARGUMENT: a call
  // that waited failed in its tick.
  absl::Status Step();
  // The region dies, and its standby carries its bodies on from the last tick. The last region that lives takes the
  // world with it: all regions begin again from a checkpoint of this tick. NOT_FOUND: it does not live.
  absl::Status Kill(RegionId region);
  // All regions begin again from a checkpoint of this tick in which the body's state is changed so.
  absl::Status Place(BodyId body, absl::FunctionRef<void(BodyState&)> change);

  // Calls a function of the table for its receiver, as game code of the region that owns it would. What it changes is
  // shown to later calls at once, and done at the beginning of the next tick. False: why not.
  bool Call(std::uint32_t function, std::span<const tessera_game_value> arguments, KeptValue& result,
            std::string& error);

  // The player's body is made in the next tick. INVALID_ARGUMENT: a bad name.
  absl::StatusOr<PlayerNumber> Join(const std::string& name = "");
  void Leave(PlayerNumber player);
  // The game gets it in the next tick that has time for it. NOT_FOUND: the player has no body, and will have none.
  absl::Status Command(PlayerNumber player, std::string bytes);
  // Takes what the game sent the player, as its client has it, since the last call.
  struct Event {
    std::string name;
    GameFields values;
  };
  std::vector<Event> TakeEvents(PlayerNumber player);
  // Why the game refused or kicked the player; nullptr if it did not. Who is sent away leaves by itself.
  const std::string* EndedBecause(PlayerNumber player) const;
  // An input for one tick, as the player's client would send it: a move vector that is longer than 1 counts as one of
  // length 1. Its number, player and body are filled in here. NOT_FOUND: the player has no body.
  absl::Status Input(PlayerNumber player, PlayerInput input);

  const Scene& scene() const { return *scene_; }
  Tick tick() const;
  std::size_t live_regions() const { return regions_.size(); }
  std::uint64_t deaths() const { return deaths_; }
  std::uint64_t handovers() const { return handovers_; }
  RegionId OwnerOf(BodyId body) const;  // RegionId() for static ones, and for bodies that are not there
  // All bodies that move, by id.
  void ForEachBody(absl::FunctionRef<void(const region::OwnedBody&)> visit) const;
  // The properties of a body that is there, in the scene's order, with their present values.
  std::vector<std::pair<std::string, PropertyValue>> PropertiesOf(BodyId body) const;
  // The lines and errors of the game since the last call.
  std::vector<GameLine> TakeLines();
  // A hash over every state, property and record of all bodies, right after the tick.
  std::uint64_t Hash() const;

 private:
  struct Member {
    std::unique_ptr<region::Region> region;
    std::shared_ptr<GameHost> host;
    std::map<RegionId, region::StandbyCopy> copies;  // it is the standby of these
  };
  struct PendingCall {
    std::uint32_t function;
    KeptArguments arguments;
    bool done = false;
  };

  LockstepWorld(const tessera_game_module& module, GameFile game, std::shared_ptr<const Scene> scene,
                const LockstepOptions& options);
  absl::Status Begin(std::shared_ptr<const region::RegionState> initial);
  absl::Status Restart(absl::FunctionRef<void(region::RegionState&)> change);
  absl::Status Fail(RegionId dead);
  absl::Status Distribute(RegionId from, const region::StepResult& result);
  absl::Status Deliver(RegionId from, const std::vector<region::OutgoingFrame>& frames);
  void Protect(Member& member);
  void AssignStandbys();
  absl::Status Disturb();
  const region::Region& RegionFor(const Function& function, std::span<const tessera_game_value> arguments) const;
  // Whether the call is for this region's game code to make.
  bool Concerns(const PendingCall& pending, const tessera_game_host& host, tessera_game_call* call) const;
  void AtTick(const tessera_game_host& host, tessera_game_call* call) override;
  bool WantsFreshState() override;
  void GiveCommands();
  void HearGame();

  const tessera_game_module& module_;
  const GameFile game_;
  const std::shared_ptr<const Scene> scene_;
  const LockstepOptions options_;
  PartitionMap map_;
  std::map<RegionId, Member> regions_;  // those that live
  std::uint64_t incarnations_ = 0, callbacks_ = 0, deaths_ = 0, handovers_ = 0;
  std::mt19937_64 random_;
  std::vector<PendingCall> pending_;
  std::string pending_error_;
  RegionId acting_;  // the region whose step it is
  std::uint32_t players_ = 0;
  std::vector<std::pair<PlayerNumber, std::string>> joining_;  // made in the next tick, with their names
  struct Talk {
    std::uint32_t last_command = 0, last_event = 0;
    std::deque<std::string> commands;  // that no region has taken yet
    std::vector<Event> events;
  };
  std::map<PlayerNumber, Talk> talks_;
  std::map<PlayerNumber, std::string> ended_;     // those whom the game sent away, and why
  std::map<PlayerNumber, std::uint32_t> inputs_;  // number of the last one
  std::vector<GameLine> lines_;
};

}  // namespace tessera::game
