// Carried bodies: a body that a much heavier one comes upon goes along with it from where they met.
#pragma once

#include <span>
#include <vector>

#include "core/physics/broad_phase.h"
#include "core/physics/continuous/stops.h"

namespace tessera::physics {

// Moves the bodies among `stops` that are carried on with what they met, as far as nothing that stands still is in
// their way. `stops` were moved back already. `candidates` is scratch.
void CarryStopped(std::span<RigidBody* const> awake, std::span<const Stop> stops, BroadPhase& broad_phase,
                  std::vector<RigidBody*>& candidates, std::span<BodyMotion> motions);

}  // namespace tessera::physics
