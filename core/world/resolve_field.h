// Makes fields from their messages. Each is checked by itself and together with those that act in the same place.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <vector>

#include "core/world/faults.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

std::vector<Field> ResolveFields(Faults& faults, const v1::Scene& scene, std::uint32_t tick_rate_hz);

}  // namespace tessera
