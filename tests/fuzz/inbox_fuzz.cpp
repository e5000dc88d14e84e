// A neighbour's whole say: frames of a border in the order in which they come, among steps of the receiver and
// closings. Whatever comes, the inbox answers with a frame or an error, steps while it is ready, and takes in sane
// states alone.
//
// Input: records of kind u8 (its low two bits: a frame of region 2, of region 3, a step, a closing), length u8, bytes.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <vector>

#include "core/region/inbox.h"
#include "core/world/state_check.h"
#include "tests/fuzz/fuzz_catalog.h"

namespace {

using tessera::MapVersion;
using tessera::RegionId;
using tessera::Tick;
using tessera::region::Frame;
using tessera::region::Inbox;
using tessera::region::Link;

void CheckStates(const Frame& frame) {
  for (const auto& ghost : frame.ghosts) {
    if (!tessera::IsSane(ghost.state)) std::abort();
  }
  for (const auto& grant : frame.grants) {
    for (const auto& body : grant.bodies) {
      if (!tessera::IsSane(body.state)) std::abort();
    }
  }
}

void Step(Inbox& inbox, Tick& tick) {
  for (std::size_t i = 0; i < 2; ++i) {
    if (!inbox.link(i).Ready()) return;
  }
  const Tick before = tick;
  for (std::size_t i = 0; i < 2; ++i) {
    const Frame frame = inbox.link(i).Take(before);
    CheckStates(frame);
    tick = std::max(tick, frame.tick);
  }
  for (std::size_t i = 0; i < 2 && tick > before; ++i) inbox.link(i).Jumped();
  ++tick;
  for (std::size_t i = 0; i < 2; ++i) {
    const Link::Duty duty = inbox.link(i).DutyNow(tick);
    if (duty == Link::Duty::kFrame || duty == Link::Duty::kFirstFrame) (void)inbox.link(i).StampFrame(0);
    if (duty == Link::Duty::kOffer) (void)inbox.link(i).StampOffer();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tessera::region::Catalog catalog = tessera::fuzz::MakeCatalog();
  static const std::vector<RegionId> neighbors = {RegionId(2), RegionId(3)};
  Inbox inbox(RegionId(1), neighbors, MapVersion(1), catalog);
  Tick tick;
  for (std::size_t i = 0; i < 2; ++i) (void)inbox.link(i).StampFrame(0);
  std::span<const std::uint8_t> rest(data, size);
  while (rest.size() >= 2) {
    const std::uint8_t kind = rest[0] % 4;
    const std::size_t length = std::min<std::size_t>(rest[1], rest.size() - 2);
    const std::span<const std::uint8_t> bytes = rest.subspan(2, length);
    rest = rest.subspan(2 + length);
    if (kind == 2) {
      Step(inbox, tick);
    } else if (kind == 3) {
      inbox.link(length % 2).Close();
    } else {
      const Frame* taken = nullptr;
      const bool ok = inbox.Put(neighbors[kind], bytes, tick, &taken).ok();
      if (!ok && taken != nullptr) std::abort();
      if (taken != nullptr) CheckStates(*taken);
    }
  }
  return 0;
}
