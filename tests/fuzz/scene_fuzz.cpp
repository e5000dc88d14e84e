// A scene as somebody wrote it, in textproto or JSON. One that is accepted holds only finite numbers and ids in order.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/world/scene_io.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  auto written = tessera::ParseScene(text, "fuzz");
  if (!written.ok()) return 0;
  // A scatter may ask for a million bodies, which is allowed and slow; the fuzzer's time is for the checks.
  tessera::OverrideScatterCount(*written, 16);
  const auto scene = tessera::ResolveScene(*written, "fuzz");
  if (!scene.ok()) return 0;
  for (const tessera::BodyDef& body : (*scene)->bodies) {
    if (!IsFinite(body.initial.position) || !IsFinite(body.initial.orientation) || !body.shape) std::abort();
  }
  const auto by_id = [](const auto& a, const auto& b) { return a.id < b.id; };
  if (!std::is_sorted((*scene)->bodies.begin(), (*scene)->bodies.end(), by_id)) std::abort();
  return 0;
}
