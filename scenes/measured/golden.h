// Golden scenes: what the engine must come to bit for bit, so that a change that alters results is seen.
//
//   for (const GoldenScene& golden : GoldenScenes()) Hash(Run(golden.make(), golden.steps));
#pragma once

#include <span>
#include <string_view>

#include "core/world/scene.h"

namespace tessera::scenes {

struct GoldenScene {
  std::string_view name;
  Scene (*make)();
  int steps;  // 1/60 s each
};

std::span<const GoldenScene> GoldenScenes();

}  // namespace tessera::scenes
