// KeepTurning: two bodies of which one was stopped at the other keep the angular momentum of both.
#pragma once

#include <optional>
#include <span>

#include "core/physics/contact_report.h"
#include "core/physics/continuous/stops.h"

namespace tessera::physics {

// A body that was moved back, but keeps the velocity at the end of its motion, takes from the angular momentum of all.
// It and the body at which it was stopped get that back here: they turn about each other by as much as one body of both
// would have to, but by no more than a share of the energy with which they move against each other. Returns the impulse
// that the two got; nothing where the other one holds still, for that one bears it, and nothing for jointed bodies.
std::optional<PairImpulse> KeepTurning(std::span<RigidBody* const> awake, const Stop& stop,
                                       std::span<BodyMotion> motions);

}  // namespace tessera::physics
