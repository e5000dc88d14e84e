// The files of meshes that a scene is drawn with.
//
//   for (const std::string& sha256 : VisualFiles(scene)) Ask(sha256);
//
// Pure, any thread.
#pragma once

#include <string>
#include <vector>

#include "tessera/v1/scene.pb.h"

namespace tessera {

// The `sha256` of all visuals of the scene's bodies, player, prefabs and scattered bodies; each once, ascending.
std::vector<std::string> VisualFiles(const v1::Scene& scene);

}  // namespace tessera
