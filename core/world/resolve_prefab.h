// Makes prefabs from their messages. For use inside core/world only. Thread rule: one thread.
#pragma once

#include <vector>

#include "core/world/resolve_body.h"

namespace tessera {

std::vector<Prefab> ResolvePrefabs(Faults& faults, BodyResolver& bodies, const v1::Scene& scene);

}  // namespace tessera
