// The path of a kinematic body, from its message.
//
// For use inside core/world only. Thread rule: free function.
#pragma once

#include <memory>

#include "core/world/bounds.h"
#include "core/world/faults.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

// The path of a body that begins at this pose. Faults are added at the place that they name; without any, the result is
// a path that physics may follow.
std::shared_ptr<const BodyPath> ResolvePath(Faults& faults, const v1::Kinematic::Path& in, const Pose& begin,
                                            const Aabb& bounds);

}  // namespace tessera
