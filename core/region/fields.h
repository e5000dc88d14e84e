// Forces that act by place: functions of a body's state alone, so an owner and a ghost's holder compute the same bits.
#pragma once

#include <span>

#include "core/world/scene.h"

namespace tessera::region {

// Sum of what `fields` do to a body in this state, m/s^2; gravity is not among them.
Vec3d FieldAcceleration(std::span<const Field> fields, const BodyState& state);

}  // namespace tessera::region
