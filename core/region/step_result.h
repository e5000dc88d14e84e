// StepResult: all that one step of a region gives to its caller.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/physics/world.h"
#include "core/world/ids.h"

namespace tessera::region {

using Bytes = std::vector<std::uint8_t>;

enum class DepartureReason : std::uint8_t { kRemoved, kHandedOver };

// A body that the region ceased to own in the last step.
struct Departure {
  BodyId body;
  Epoch epoch;  // until which it was owned here
  DepartureReason reason = DepartureReason::kRemoved;
  RegionId to;  // when handed over
};

struct OutgoingFrame {
  RegionId to;
  Bytes bytes;
};

struct StepResult {
  Tick tick;                          // the tick that this step led to
  std::vector<OutgoingFrame> frames;  // send all, reliably and in order
  std::vector<Departure> departures;
  std::vector<physics::PairEvent> events;  // those that this region reports: it owns the lower dynamic body of the pair
  std::uint32_t handed_out = 0, handed_in = 0;
  Bytes log;                      // for the standby; empty while there is none (SetStandby)
  std::vector<BodyId> nonfinite;  // taken out of the world because their state was no longer finite, or beyond limits
};

// The parts of a step, in order; the shell times them.
enum class Phase : std::uint8_t { kPlaceGhosts, kPhysics, kPrediction, kFrames, kDone };
using PhaseObserver = std::function<void(Phase)>;  // called on entering each

}  // namespace tessera::region
