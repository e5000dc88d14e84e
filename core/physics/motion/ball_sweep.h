// Ball sweep: FirstImpact (motion/sweep.h) of a ball with a ball or a plane, in closed form. Pure functions, any
// thread.
#pragma once

#include <optional>

#include "core/physics/motion/sweep.h"
#include "core/physics/motion/sweep_parts.h"

namespace tessera::physics {

// A ball with a ball, or with a plane that comes first. How either turns plays no part, but for where a plane faces.
bool IsBallSweep(const SweptPair& pair);

// `slack_m`: how much nearer two come that start nearer than `target_m`, and that a graze may.
std::optional<Impact> FirstImpactOfBall(const SweptPair& pair, double target_m, double slack_m);

}  // namespace tessera::physics
