// A level of a modelling program: refused in a line, or a scene that a control plane takes or refuses by itself.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "cli/gltf/gltf_import.h"
#include "core/world/scene_load.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto level = tessera::cli::ImportGltf({data, size}, "/nowhere", "level");
  if (!level.ok()) {
    if (level.status().message().empty()) std::abort();
    return 0;
  }
  if (level->scene.bodies_size() == 0) std::abort();
  (void)tessera::LoadScene(level->scene, "level");
  return 0;
}
