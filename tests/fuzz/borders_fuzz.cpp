// Everything that two neighbours may send over a link: frames in the order in which they come, among steps of the
// receiver and outages. Whatever comes, the borders answer with a frame or an error, step while they are ready, and
// take in sane states alone.
//
// Input: records of kind u8 (its low two bits: a frame of region 2, of region 3, a step, an outage), length u8, bytes.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <vector>

#include "core/region/borders.h"
#include "core/world/state_check.h"
#include "tests/fuzz/fuzz_catalog.h"

namespace {

using tessera::MapVersion;
using tessera::RegionId;
using tessera::Tick;
using tessera::region::BorderFrame;
using tessera::region::BorderLink;
using tessera::region::Borders;

void CheckStates(const BorderFrame& frame) {
  for (const auto& ghost : frame.ghosts) {
    if (!tessera::IsSane(ghost.state)) std::abort();
  }
  for (const auto& grant : frame.grants) {
    for (const auto& body : grant.bodies) {
      if (!tessera::IsSane(body.state)) std::abort();
    }
  }
}

void Send(Borders& borders, Tick tick) {
  for (std::size_t i = 0; i < 2; ++i) {
    const BorderLink::Duty duty = borders.DutyNow(i, tick);
    if (duty == BorderLink::Duty::kFrame || duty == BorderLink::Duty::kFirstFrame) (void)borders.SendFrame(i, {}, 0);
    if (duty == BorderLink::Duty::kReconnect) (void)borders.SendReconnect(i, {});
  }
}

void Step(Borders& borders, Tick& tick) {
  if (!borders.Ready()) return;
  const Borders::TakenFrames taken = borders.Take(tick);
  for (const BorderFrame& frame : taken.frames) CheckStates(frame);
  tick = taken.tick + 1;
  Send(borders, tick);
  borders.Validate();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tessera::region::Catalog catalog = tessera::fuzz::MakeCatalog();
  static const std::vector<RegionId> neighbors = {RegionId(2), RegionId(3)};
  Borders borders(RegionId(1), neighbors, MapVersion(1), catalog);
  Tick tick;
  Send(borders, tick);
  std::span<const std::uint8_t> rest(data, size);
  while (rest.size() >= 2) {
    const std::uint8_t kind = rest[0] % 4;
    const std::size_t length = std::min<std::size_t>(rest[1], rest.size() - 2);
    const std::span<const std::uint8_t> bytes = rest.subspan(2, length);
    rest = rest.subspan(2 + length);
    if (kind == 2) {
      Step(borders, tick);
    } else if (kind == 3) {
      borders.TakeDown(neighbors[length % 2]);
    } else {
      const BorderFrame* taken = nullptr;
      const bool ok = borders.Put(neighbors[kind], bytes, tick, &taken).ok();
      if (!ok && taken != nullptr) std::abort();
      if (taken != nullptr) CheckStates(*taken);
    }
  }
  return 0;
}
