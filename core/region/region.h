// Region: one region's life, one tick at a time: what it owns, what it has of its neighbours' bodies, what it hands
// over.
//
// Pure: frames, inputs and maps come in as arguments, frames and events go out as results; no socket, thread or clock.
// So a whole instance runs in one process (tests/simulation), and region_worker is a thin shell around this.
//
//   Region region(config);
//   send(region.Start());                       // frames of tick 0
//   while (running) {
//     for (each message from a neighbour) region.Receive(from, bytes);
//     if (region.CanStep()) send(region.Step());  // frames of tick t
//   }
//
// Besides: SetStandby streams its log to a standby, Announce and Commit change the map, BeginFailover and Resume carry
// on after a death.
//
// It has some 65 methods because it is a region's only interface; each passes its call to the part that owns the data
// (region_parts.h), and it has no data of its own.
//
// Promise: at every tick each body has at most one owner among regions in step. Regions with the same inputs give the
// same bits. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/physics/world.h"
#include "core/region/owed_impulse.h"
#include "core/region/owned_body.h"
#include "core/region/record_table.h"
#include "core/region/settings.h"
#include "core/region/step_result.h"
#include "core/region/world_properties.h"
#include "core/world/movement.h"
#include "core/world/partition_map.h"
#include "core/world/player_input.h"
#include "core/world/scene.h"
#include "game_sdk/include/tessera/game.h"

namespace tessera::game {
class GameHost;       // core/game/game_host.h
struct PlayerRecord;  // core/game/player_record.h
}  // namespace tessera::game

namespace tessera::region {

class Catalog;           // catalog.h
class OutputCommit;      // output_commit.h
class StandbyCopy;       // standby_copy.h
struct Inventory;        // inventory.h
struct RegionParts;      // region_parts.h
struct RelayStatistics;  // message_relay.h
struct RegionState;      // region_state.h
struct Resolution;       // resolve.h

struct Config {
  RegionId self;
  Incarnation incarnation;
  std::shared_ptr<const Scene> scene;
  PartitionMap map;
  RegionSettings settings;
  // The state that the region begins with instead of the scene at tick 0. A restored region begins with its own state
  // of the instance's checkpoint, all of it, or with the bodies of all regions (MergeStates in region_state.h), of
  // which it takes those that the map gives it. One that joins a running instance begins with a state of no bodies and
  // the tick before its map comes into force.
  std::shared_ptr<const RegionState> initial = nullptr;
  // The game that this region runs, and no other region; all regions of an instance run the same one, or none does.
  std::shared_ptr<game::GameHost> game = nullptr;
};

// A command of a client for the game. `base` is the lowest number that the client still waits for: none below it comes.
struct PlayerCommand {
  std::uint32_t base = 0, number = 0;
  std::string_view bytes;
  std::uint64_t shown_at = 0;    // as PlayerInput::shown_at
  std::uint32_t with_input = 0;  // the game gets it when this input has acted; 0: at once
};

struct EndedPlayer {
  PlayerNumber player;
  std::string reason;
  friend bool operator==(const EndedPlayer&, const EndedPlayer&) = default;
};

class Region {
 public:
  explicit Region(Config config);
  ~Region();
  Region(const Region&) = delete;
  Region& operator=(const Region&) = delete;

  RegionId id() const;
  Tick tick() const;  // after the last step; 0 before the first
  const PartitionMap& map() const;
  // Regions that this one exchanges frames with, ascending: its neighbours by the map.
  std::span<const RegionId> neighbors() const;
  const Catalog& catalog() const;  // lists the scene's bodies

  // --- Steps.
  // Frames of tick 0, or of the initial state's. Call once, before anything else.
  std::vector<OutgoingFrame> Start();
  // A frame as it came off the wire. An error says why it was dropped ("ghosts: truncated", "not a neighbour", "body 7:
  // state is not finite"); nothing of it was used. A good one is kept until its tick; one that is here already is
  // ignored.
  absl::Status Receive(RegionId from, std::span<const std::uint8_t> frame);
  // True when every neighbour's frame of tick() is here or not needed, so that the next tick can be stepped.
  bool CanStep() const;
  std::vector<RegionId> WaitingFor() const;  // neighbours whose frames are missing, ascending
  // Whether a neighbour has made a step beyond this region's: frames of a later tick have come, or, where the later
  // tick goes by the next map already, the word that it is committed.
  bool NeighborsGoOn() const;
  // Requires CanStep().
  StepResult Step(const PhaseObserver& observer = {});

  // --- Links.
  // Nothing has come from a neighbour that is waited for, for so long that its link counts as down: its ghosts go on by
  // this region's own steps, nothing is granted to it, nobody waits for it. When it is heard again the link comes up by
  // itself, and who is behind adopts the later tick. Repeating it does nothing.
  void TakeLinkDown(RegionId neighbor);
  bool IsLinkUp(RegionId neighbor) const;

  // --- Players.
  // Queues an input if this region owns the player's body. Inputs act one a tick, in order; the first of the queue two
  // steps from now, because neighbours that see the body learn of it before it acts. Each number is decided on once,
  // whatever comes of it. Errors: PERMISSION_DENIED "body 17 is not player 2's"; INVALID_ARGUMENT naming a field that
  // is not finite; NOT_FOUND when the body is not owned here, where a copy may be tried again; ALREADY_EXISTS for a
  // copy of an input that was decided on; OUT_OF_RANGE for one that a higher number overtook; RESOURCE_EXHAUSTED when
  // kMaxQueuedInputs wait already.
  absl::Status QueueInput(const PlayerInput& input);
  // Number of the last input that moved this player's body, carried along by handovers; 0 if none or not owned here.
  std::uint32_t LastInput(PlayerNumber player) const;
  // Makes the player's body at its spawn point, owned by this region, at the next step. Repeating it does nothing, nor
  // does it when the player was removed. Requires scene->player, and a name that CheckPlayerName takes. One region of
  // the instance is asked to. `properties`: those that the body begins with; what the scene does not declare so is left
  // out.
  void SpawnPlayer(PlayerNumber player, std::string_view name = {}, std::span<const NamedProperty> properties = {});
  // An earlier life of this region made the body: SpawnPlayer does nothing any more, nor does it after states that are
  // saved from here on.
  void MarkSpawned(PlayerNumber player);
  // The player has left for good: removes its body at the first step at which it is owned here. Ask all regions, so it
  // does not matter where the body is or whether it is being handed over.
  void RemovePlayer(PlayerNumber player);
  // The player's body stands still and takes no part in the world from the next step on, or does so no more. Ask all
  // regions: the owner of the body heeds it, and so does every region that has it as a ghost.
  void ParkPlayer(PlayerNumber player, bool parked);

  // --- What players and the game say to each other (region_talk.cpp).
  // Takes a command of a player whose body is owned here: the game gets it in the next step that has time for it. Each
  // number is taken once, in order. Errors: NOT_FOUND when the body is not owned here or about to be handed over, and
  // RESOURCE_EXHAUSTED when kMaxWaitingCommands wait, where it may be tried again; ALREADY_EXISTS for a number that was
  // taken; OUT_OF_RANGE when the one before it is missing; FAILED_PRECONDITION when there is no game, or the player was
  // sent away; INVALID_ARGUMENT "command: 2048 bytes are more than 1024".
  absl::Status TakeCommand(PlayerNumber player, const PlayerCommand& command);
  // The client of a player whose body is owned here has all events up to this number.
  void AcknowledgeEvents(PlayerNumber player, std::uint32_t event);
  // The body that the player's inputs move, as far as may be told; its own where the player looks on, or is not here.
  BodyId MovedBy(PlayerNumber player) const;
  // How the game's own movement moves that body, for the player's client: its state is that after LastInput. Nothing
  // where none does, or the player's body is not owned here. Valid until the region changes.
  struct GameMoved {
    const GameMovement& movement;
    MovementState state;
  };
  std::optional<GameMoved> MovementOf(PlayerNumber player) const;
  // The joints of the game in force among what hangs together with that body, as far as the player may see both ends.
  std::vector<game::JointOfBody> JointsOf(PlayerNumber player) const;
  // All of it that may be told; null where the player's body is not owned here, or nobody may know of the player yet.
  // Valid until the region changes.
  const game::PlayerRecord* TalkOf(PlayerNumber player) const;
  // The players whose bodies are owned here and whom the game has refused or kicked, with the reason; ascending. A
  // region that dies takes back none of it.
  std::vector<EndedPlayer> ended_players() const;
  // Whether nobody is to see this body, which is owned here: it is a spectator's, or nobody may know of it yet.
  bool IsHidden(BodyId body) const;
  // Which clients may see this body, which is owned here or a neighbour's, and its team. Of a neighbour's body the team
  // is that of four ticks ago.
  struct Audience {
    Visibility visible_to = Visibility::kEveryone;
    TeamId team = 0;
    friend bool operator==(const Audience&, const Audience&) = default;
  };
  Audience AudienceOf(BodyId body) const;

  // --- What the game and its backend say to each other (region_backend.cpp).
  // Takes a message of the game's backend for a body that is owned here, or for the world where its record is: the game
  // gets it in the next step that has time for it. Numbers of one target ascend, and each is taken once. Errors:
  // NOT_FOUND when the target is not owned here or about to be handed over, RESOURCE_EXHAUSTED when too many wait,
  // where it may be tried again; ALREADY_EXISTS for a number that was taken; FAILED_PRECONDITION "body 7 is gone", or
  // there is no game.
  absl::Status TakeFromBackend(BodyId target, std::uint64_t number, const game::Message& message);
  // Events for the backend that nobody has acknowledged, where the world's record is owned here; ascending by number.
  // No death of this region alone takes back any of them.
  std::vector<game::Published::Event> published() const;
  // The events up to this number are stored. Ask all regions: the one that owns the world's record heeds it.
  void AcknowledgePublished(std::uint64_t number);

  // --- Properties.
  // Sets one of the properties that the scene declares, of a body that is owned here. Changes are numbered from 1 on by
  // whoever orders them: one whose number is not above that of the body's last change does nothing, so it may be
  // ordered again until it is seen to have been applied (records()), by whichever region owns the body then. Errors:
  // NOT_FOUND "body 7 is not owned here" or "... is being handed over", and those of PropertySet::Set.
  // kInstanceBody stands for the world.
  absl::Status SetProperty(BodyId body, std::string_view name, PropertyValue value, std::uint64_t change);
  // Whether the world's record is owned here.
  bool OwnsWorld() const;
  // Properties of the world that clients and operators may be told; nothing: they are as the scene has them. Valid
  // until the next step.
  std::optional<WorldProperties> world_properties() const;
  // Changed properties of the bodies that are owned here.
  const RecordTable& records() const;

  // --- The game.
  // The one that runs; null without one.
  const game::GameHost* game() const;
  game::GameHost* game();
  // Another game is loaded here, so that a map with its number may be announced; it runs from the step on with which
  // such a map is effective.
  void PrepareGame(std::shared_ptr<game::GameHost> next);
  // Bodies of the scene that the game removed, or some earlier life of this region, ascending; with a standby those
  // that it knows of too, so that they stay removed.
  std::vector<BodyId> removed() const;

  // Messages of game code that left and came.
  const RelayStatistics& messages() const;

  // --- What others may be told.
  // It holds back properties and bodies that came to be. Bodies that went may be told of once committed_tick() has
  // their tick.
  const OutputCommit& output() const;
  // The newest tick that no death of this region alone takes back: all that its standby has, or that it has without
  // one.
  Tick committed_tick() const;

  // --- Standby.
  // Turns the log on (from the next step's result on) or off. Each call with true begins anew with a whole state: call
  // it when the standby is another or has a gap. While it is on, acknowledgements of what was granted to this region
  // wait until the standby has it.
  void SetStandby(bool on);
  // The standby has all up to `tick`.
  void LogAcknowledged(Tick tick);
  // Tick up to which the standby has all; tick 0 as long as it has nothing, and without one.
  Tick acknowledged() const;
  // For a region that stands still: the message with its whole state, if a standby began since the last step; else
  // nothing.
  Bytes WriteLogStanding();
  // The whole state right after tick(), as a checkpoint keeps it.
  Bytes SaveState() const;

  // --- Planned maps: in force at the same tick everywhere, without a halt.
  // A map may come into force: from the frames of tick `effective` - 1 on. Repeating it does nothing; a higher version
  // takes the place of a lower one that is not committed. FAILED_PRECONDITION: not above the map in force, effective -
  // 1 has passed here, or another one is committed.
  absl::Status Announce(const PartitionMap& map, Tick effective);
  // The announced map is to come into force. Accepted only while everyone can still hear of it through the frames in
  // time (a map committed by one is committed by all); otherwise FAILED_PRECONDITION: ask for a later tick. NOT_FOUND:
  // that version is not announced. Repeating it does nothing.
  // `stands`: the map in force is a pause that ends with the commit. Then it is always in time, for nobody steps before
  // an order or a neighbour's frame of a later tick says so, and either says that the map is committed.
  absl::Status Commit(MapVersion version, bool stands = false);
  MapVersion announced() const;  // MapVersion() if none waits
  bool committed() const;        // whether the announced map is committed
  // Bodies and copies of granted ones that are too far outside this region's cells for a map without `from`. Once it is
  // 0 in all regions, such a map can be planned.
  std::size_t away_count() const;

  // --- Failover.
  // From now on nothing is stepped until Resume. `map` is the failover's; `primaries` are the copies of the dead that
  // are held here. A newer map starts over, repeating it does nothing; either way the answer is what is held now.
  // FAILED_PRECONDITION: a map that is not newer than the one in force.
  absl::StatusOr<Inventory> BeginFailover(const PartitionMap& map, std::span<const StandbyCopy* const> primaries);
  bool halted() const;
  // Does this region's part and comes to be at the tick before resume_tick, by the failover's map: the result has its
  // frames, departures and log as if that tick had been stepped. Nothing in the world changes but the promoted bodies.
  // FAILED_PRECONDITION: it is the resolution of another failover, or a body is to be promoted that is not here.
  absl::StatusOr<StepResult> Resume(const Resolution& resolution, std::span<const StandbyCopy* const> primaries);

  // --- The game.
  // Lets `act` call what game code may call, and discards what it asked for (GameHost::Inspect). Requires Config::game.
  void InspectGame(absl::FunctionRef<void(const tessera_game_host&, tessera_game_call*)> act) const;

  // --- What is here.
  // All bodies that this region owns, ascending by id; valid until the next call that changes the region.
  std::span<const OwnedBody> owned() const;
  bool Owns(BodyId body) const;
  std::size_t asleep_count() const;  // among the owned bodies
  std::size_t ghost_count() const;
  const physics::World& world() const;
  // The pairs that this region reports that touch, or overlap, now: begun and not ended; ascending.
  std::vector<physics::PairEvent> touching() const;
  // Parts of corrections that bodies here are still to get, and ghosts by their owners; in no order, valid until the
  // next step.
  std::span<const OwedImpulse> owed() const;

 private:
  std::unique_ptr<RegionParts> parts_;
};

}  // namespace tessera::region
