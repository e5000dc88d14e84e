// A frame of another region. One that is accepted says the same when it is written again, and holds only states that a
// world may be given.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/region/catalog.h"
#include "core/region/frame.h"
#include "core/region/frame_check.h"
#include "core/region/testing/sample_frame.h"
#include "core/world/state_check.h"
#include "tests/fuzz/fuzz_catalog.h"
#include "tests/fuzz/planted_seed.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using tessera::region::BorderFrame, tessera::region::Encode, tessera::region::SampleFrame;
  tessera::fuzz::PlantSeed(*argc, *argv, "empty", Encode(BorderFrame(), {}));
  tessera::fuzz::PlantSeed(*argc, *argv, "all_parts", Encode(SampleFrame(), {}));
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tessera::region::Catalog catalog = tessera::fuzz::MakeCatalog();
  const auto frame = tessera::region::Decode({data, size}, {});
  if (!frame.ok()) return 0;
  const auto bytes = tessera::region::Encode(*frame, {});
  const auto again = tessera::region::Decode(bytes, {});
  if (!again.ok() || tessera::region::Encode(*again, {}) != bytes) std::abort();
  if (!tessera::region::CheckFrame(*frame, catalog).ok()) return 0;
  for (const auto& ghost : frame->ghosts) {
    if (!tessera::IsSane(ghost.state)) std::abort();
  }
  for (const auto& grant : frame->grants) {
    for (const auto& body : grant.bodies) {
      if (!tessera::IsSane(body.state)) std::abort();
    }
  }
  return 0;
}
