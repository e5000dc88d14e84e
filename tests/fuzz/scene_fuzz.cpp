// Fuzzes scene text, textproto and JSON. A scene that is accepted holds only finite numbers and ids in order.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "core/world/scene_load.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  // A scatter may ask for a million bodies, which is allowed and slow; the fuzzer's time is for the checks.
  const auto loaded = tessera::LoadScene(tessera::SceneForm::kText, text, "fuzz", {.scatter_count = 16, .hash = {}});
  if (!loaded.ok()) return 0;
  const std::vector<tessera::BodyDef>& bodies = loaded->scene->bodies;
  for (const tessera::BodyDef& body : bodies) {
    if (!IsFinite(body.initial.position) || !IsFinite(body.initial.orientation) || !body.shape) std::abort();
  }
  const auto by_id = [](const auto& a, const auto& b) { return a.id < b.id; };
  if (!std::is_sorted(bodies.begin(), bodies.end(), by_id)) std::abort();
  return 0;
}
