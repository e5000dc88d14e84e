// A packed scene off the wire or out of a cache. One that is accepted packs to bytes that are accepted again and stay.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/world/packed_scene.h"
#include "core/world/scene_load.h"
#include "tests/fuzz/planted_seed.h"

namespace {

constexpr const char* kSeed = R"(
  name: "f" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
  properties { name: "team" text: "red" } team_property: "team"
  bodies { id: 1 motion: MOTION_STATIC shape { height_field { columns: 2 rows: 2 spacing: 1 heights: [0, 1, 0, 1] } } }
  bodies { id: 2 mass: 1 kind: "k" shape { compound { children { shape { sphere { radius: 1 } } } } } }
  bodies { id: 3 shape { box { half_extents { x: 1 y: 1 z: 1 } } } kinematic { path { spin { y: 1 } } } }
  joints { id: 1 body_a: 2 hinge {} }
  player { body { mass: 1 shape { sphere { radius: 0.5 } } } spawn_points { y: 1 } max_force: 10 max_speed: 5 }
  prefabs { name: "ball" bodies { mass: 1 shape { sphere { radius: 0.25 } } } })";

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  const auto loaded = tessera::LoadScene(tessera::SceneForm::kText, kSeed, "fuzz.textproto");
  if (!loaded.ok()) std::abort();
  tessera::fuzz::PlantSeed(*argc, *argv, "scene", tessera::PackScene(*loaded->scene));
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto scene = tessera::UnpackScene({data, size});
  if (!scene.ok()) return 0;
  const std::vector<std::uint8_t> packed = tessera::PackScene(**scene);
  const auto again = tessera::UnpackScene(packed);
  if (!again.ok() || tessera::PackScene(**again) != packed) std::abort();
  return 0;
}
