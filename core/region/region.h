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
// Promise: at every tick each body has at most one owner among regions in step. Regions with the same inputs give the
// same bits. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/physics/world.h"
#include "core/region/settings.h"
#include "core/world/partition_map.h"
#include "core/world/scene.h"

namespace tessera::region {

using Bytes = std::vector<std::uint8_t>;

struct Config {
  RegionId self;
  Incarnation incarnation;
  std::shared_ptr<const Scene> scene;
  PartitionMap map;
  Settings settings;
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
  std::vector<BodyId> nonfinite;  // taken out of the world because their state was no longer finite, or beyond limits
  // How far the bodies whose prediction was needed, those awake near a border, came out from where Algorithm 1 had
  // predicted them one tick before, m.
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

  // Frames of tick 0. Call once, before anything else.
  std::vector<OutgoingFrame> Start();
  // A frame as it came off the wire. An error says why it was dropped ("truncated", "not a neighbour", "old tick",
  // "body 7: state is not finite"); nothing of it was used. A good one is kept until its tick; one that is here already
  // is ignored.
  absl::Status Receive(RegionId from, std::span<const std::uint8_t> frame);
  // True when every neighbour's frame of tick() is here, so that the next tick can be stepped.
  bool CanStep() const;
  std::vector<RegionId> WaitingFor() const;
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
  // The player has left for good: removes its body at the first step at which it is owned here. Tell all regions, so it
  // does not matter where the body is or whether it is being handed over.
  void RemovePlayer(PlayerNumber player);
  // Number of the last input that moved this player's body, carried along by handovers; 0 if none or not owned here.
  std::uint32_t LastInput(PlayerNumber player) const;
  std::size_t QueuedInputs(PlayerNumber player) const;  // that wait; how many ticks early the newest came

  std::size_t owned_count() const;  // dynamic bodies
  std::size_t ghost_count() const;
  std::size_t asleep_count() const;        // of the owned ones
  std::size_t unconfirmed_grants() const;  // bodies handed over whose new owner has not told yet that it has them
  std::vector<BodyId> KeptBodies() const;  // those: this region keeps them until then
  bool Owns(BodyId body) const;
  // All that this region owns, ascending by id; valid until the next call that changes the region.
  std::span<const OwnedBody> owned() const;
  const physics::World& world() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::region
