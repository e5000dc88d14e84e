// Resolves a scene's collision layers: names to places, and who ignores whom to masks that are the same from both
// sides.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/world/faults.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

// The layers of a scene, "default" first: `layers[i]` is that of the bodies that name `names[i]`.
struct NamedLayers {
  std::span<const std::string> names;
  std::span<const CollisionLayer> layers;
};

// Returns the layers and writes their names, as Scene has them. There is always at least the default one.
std::vector<CollisionLayer> ResolveLayers(Faults& faults, const v1::Scene& in, std::vector<std::string>* names);

}  // namespace tessera
