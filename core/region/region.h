// Region: one region's life, one tick at a time: what it owns, what it sees of its neighbours, what it hands over.
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
// Besides: SetStandby streams its log to an heir, Announce and Commit change the map, BeginFailover and Resume carry on
// after a death.
//
// Promise: at every tick each body has at most one owner among regions in step. Regions with the same inputs give the
// same bits. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/physics/world.h"
#include "core/region/property_table.h"
#include "core/region/settings.h"
#include "core/world/partition_map.h"
#include "core/world/scene.h"

namespace tessera::region {

class Catalog;       // catalog.h
class Standby;       // standby.h
struct Inventory;    // inventory.h
struct RegionState;  // log.h
struct Resolution;   // resolve.h

using Bytes = std::vector<std::uint8_t>;

struct Config {
  RegionId self;
  Incarnation incarnation;
  std::shared_ptr<const Scene> scene;
  PartitionMap map;
  Settings settings;
  // What the region begins with instead of the scene at tick 0: a restored one with its own state of the instance's
  // checkpoint, all of it, or with the bodies of all regions (MergeStates in region_state.h), of which it takes those
  // that the map gives it; one that joins a running instance with a state of no bodies and the tick before its map
  // comes into force.
  std::shared_ptr<const RegionState> initial = nullptr;
};

// What a player asks for its own body in one tick.
struct PlayerInput {
  PlayerNumber player;
  std::uint32_t number = 0;  // counts up by one with each input; a lower or equal one is late
  BodyId body;               // what it wants to move: refused unless it is the player's own
  Vec3f force_n;             // scaled down to the scene's limit
  Vec3f torque_nm;
};

struct OwnedBody {
  const BodyDef* def = nullptr;
  Epoch epoch;
  BodyState state;
};

// What a body is still to get, tick by tick, of what the two sides of a border found different.
struct OwedImpulse {
  BodyId id;
  Vec3d impulse_ns, angular_nms;  // the latter about `at`
  Vec3d at;                       // where the body was when it was told
};

enum class DepartureReason : std::uint8_t { kRemoved, kHandedOver };

// A body that this region ceased to own in the last step.
struct Departure {
  BodyId body;
  Epoch epoch;  // of the ownership that ended
  DepartureReason reason = DepartureReason::kRemoved;
  RegionId to;  // when handed over
};

struct OutgoingFrame {
  RegionId to;
  Bytes bytes;
};

struct StepResult {
  Tick tick;                          // that this step led to
  std::vector<OutgoingFrame> frames;  // send all, reliably and in order
  std::vector<Departure> departures;
  std::vector<physics::PairEvent> events;  // those that this region reports: it owns the lower dynamic body of the pair
  std::uint32_t handed_out = 0, handed_in = 0;
  Bytes log;                      // for the heir; empty while there is none (SetStandby)
  std::vector<BodyId> nonfinite;  // taken out of the world because their state was no longer finite, or beyond limits
  // How far the bodies whose prediction was needed, those near a border that are awake and not calm, came out from
  // where Algorithm 1 had predicted them one tick before, m.
  std::uint32_t predicted = 0;  // bodies
  double mean_prediction_error_m = 0, max_prediction_error_m = 0;
};

// Parts of a step, in order; the shell times them.
enum class Phase : std::uint8_t { kPlaceGhosts, kPhysics, kPrediction, kFrames, kDone };
using PhaseObserver = std::function<void(Phase)>;  // called on entering each

class Region {
 public:
  explicit Region(Config config);
  ~Region();
  Region(const Region&) = delete;
  Region& operator=(const Region&) = delete;

  RegionId id() const;
  Tick tick() const;  // of the last step; 0 before the first
  const PartitionMap& map() const;
  // Whom this region exchanges frames with, ascending: its neighbours by the map.
  std::span<const RegionId> neighbors() const;

  // Frames of tick 0, or of the initial state's. Call once, before anything else.
  std::vector<OutgoingFrame> Start();
  // A frame as it came off the wire. An error says why it was dropped ("truncated", "not a neighbour", "body 7: state
  // is not finite"); nothing of it was used. A good one is kept until its tick; one that is here already is ignored.
  absl::Status Receive(RegionId from, std::span<const std::uint8_t> frame);
  // True when every neighbour's frame of tick() is here or not needed, so that the next tick can be stepped.
  bool CanStep() const;
  std::vector<RegionId> WaitingFor() const;
  // Nothing has come from a neighbour that is waited for, for so long that the border is to close: its ghosts go on by
  // this region's own steps, nothing is granted to it, nobody waits for it. When it is heard again the border opens by
  // itself, and who is behind adopts the later tick. Repeating it does nothing.
  void Close(RegionId neighbor);
  bool IsOpen(RegionId neighbor) const;
  // Requires CanStep().
  StepResult Step(const PhaseObserver& observer = {});

  // Queues an input if this region owns the player's body. Inputs act one a tick, in order; the first of the queue two
  // steps from now, because neighbours that see the body are told before it acts. Errors: PERMISSION_DENIED "body 17 is
  // not player 2's", NOT_FOUND when the body is not owned here, OUT_OF_RANGE for a late number, RESOURCE_EXHAUSTED when
  // kMaxQueuedInputs wait already, INVALID_ARGUMENT naming a field that is not finite.
  absl::Status QueueInput(const PlayerInput& input);
  // Makes the player's body at its spawn point, owned by this region, at the next step. Repeating it does nothing, nor
  // does it when the player was removed. Requires scene->player. One region of the instance is told to.
  void SpawnPlayer(PlayerNumber player);
  // An earlier life of this region made the body: SpawnPlayer does nothing any more, nor does it after states that are
  // saved from here on.
  void MarkSpawned(PlayerNumber player);
  // The player has left for good: removes its body at the first step at which it is owned here. Tell all regions, so it
  // does not matter where the body is or whether it is being handed over.
  void RemovePlayer(PlayerNumber player);
  // The player's body stands still and takes no part in the world from the next step on, or does so no more. Tell all
  // regions: whoever owns the body, and whoever sees it, heeds it.
  void ParkPlayer(PlayerNumber player, bool parked);
  // Number of the last input that moved this player's body, carried along by handovers; 0 if none or not owned here.
  std::uint32_t LastInput(PlayerNumber player) const;
  std::size_t QueuedInputs(PlayerNumber player) const;  // that wait; how many ticks early the newest came

  // Sets one of the properties that the scene declares, of a body that is owned here. Changes are numbered from 1 on by
  // whoever orders them: one whose number is not above that of the body's last change does nothing, so it may be
  // ordered again until it is seen to have been applied (properties()), by whichever region owns the body then. Errors:
  // NOT_FOUND "body 7 is not owned here" or "... is being handed over", and those of PropertySet::Set.
  absl::Status SetProperty(BodyId body, std::string_view name, PropertyValue value, std::uint64_t change);
  // Of the owned bodies those whose properties were changed, ascending; valid until the next call that changes the
  // region.
  std::span<const ChangedProperties> properties() const;
  const ChangedProperties* FindProperties(BodyId body) const;  // null where nothing was changed; valid as above

  // --- Standby: the heir's copy.
  // Turns the log on (from the next step's result on) or off. Each call with true begins anew with a whole state: call
  // it when the heir is another or has a gap. While it is on, confirmations of what was granted to this region wait
  // until the heir has it.
  void SetStandby(bool on);
  // The heir has all up to `tick`.
  void LogAcknowledged(Tick tick);
  // Up to which tick the heir has all; tick 0 as long as it has nothing, and without one.
  Tick acknowledged() const;
  // The whole state right after tick(), as a checkpoint keeps it.
  Bytes SaveState() const;
  const Catalog& catalog() const;  // of the scene; for Standby

  // --- Planned maps: in force at the same tick everywhere, without a halt.
  // Tells of a map that may come into force: from the frames of tick `effective` - 1 on. Repeating it does nothing; a
  // higher version takes the place of a lower one that is not committed. FAILED_PRECONDITION: not above the map in
  // force, effective - 1 has passed here, or another one is committed.
  absl::Status Announce(const PartitionMap& map, Tick effective);
  // The announced map is to come into force. Accepted only while everyone can still hear of it through the frames in
  // time (a map committed by one is committed by all); otherwise FAILED_PRECONDITION: ask for a later tick. NOT_FOUND:
  // that version is not announced. Repeating it does nothing.
  absl::Status Commit(MapVersion version);
  MapVersion announced() const;  // MapVersion() if none waits
  bool committed() const;        // whether what is announced is committed
  // Bodies and unconfirmed grants that are too far outside this region's cells for a map without `from`; 0 in all
  // regions: time to plan that.
  std::size_t away_count() const;

  // --- Failover.
  // From now on nothing is stepped until Resume. `map` is the failover's; `wards` are the standbys of the dead that are
  // held here. A newer map starts over, repeating it does nothing; either way the answer is what is held now.
  // FAILED_PRECONDITION: a map that is not newer than the one in force.
  absl::StatusOr<Inventory> BeginFailover(const PartitionMap& map, std::span<const Standby* const> wards);
  bool halted() const;
  // Does this region's part and comes to be at the tick before resume_tick, by the failover's map: the result has its
  // frames, departures and log as if that tick had been stepped. Nothing of the world is changed but what is taken up.
  // FAILED_PRECONDITION: it is the resolution of another failover, or a body is to be taken up that is not here.
  absl::StatusOr<StepResult> Resume(const Resolution& resolution, std::span<const Standby* const> wards);

  std::size_t owned_count() const;  // dynamic bodies
  std::size_t ghost_count() const;
  std::size_t asleep_count() const;        // of the owned ones
  std::size_t unconfirmed_grants() const;  // bodies handed over whose new owner has not told yet that it has them
  std::vector<BodyId> KeptBodies() const;  // those: this region keeps them until then
  bool Owns(BodyId body) const;
  // The pairs that this region reports of that touch, or overlap, now: begun and not ended; ascending.
  std::vector<physics::PairEvent> touching() const;
  // All that this region owns, ascending by id; valid until the next call that changes the region.
  std::span<const OwnedBody> owned() const;
  const physics::World& world() const;
  // What is owed to bodies here, and to ghosts by their owners; in no order, valid until the next step.
  std::span<const OwedImpulse> owed() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::region
