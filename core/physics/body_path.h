// Where a kinematic body with a path is: a function of time alone, with the same bits in every region, on every host
// and in every client.
//
// A point is passed with the mean velocity of the ways before and after it, so that the body never jerks; at the end of
// a way, and where it waits (two points in one place), with none. Between two points each coordinate is the cubic that
// fits (Hermite); a turn goes the shortest way, by the same cubic of its rotation vector.
//
// Thread rule: free functions; any thread.
#pragma once

#include "core/world/scene.h"

namespace tessera::physics {

// The pose at a time of 0 or more. `path` has passed the scene's checks.
Pose PoseOn(const BodyPath& path, double time_s);

// The state at a tick: the pose there, with the velocities that lead to the pose of the next one in a tick. Without
// them it counts as asleep.
BodyState StateOn(const BodyPath& path, Tick tick, double tick_rate_hz);

}  // namespace tessera::physics
