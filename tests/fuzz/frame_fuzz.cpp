// A frame of another region. One that is accepted says the same when it is written again, and holds only states that a
// world may be given.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "core/region/catalog.h"
#include "core/region/frame.h"
#include "core/region/frame_check.h"
#include "core/world/state_check.h"

namespace {

using tessera::BodyDef;
using tessera::BodyId;
using tessera::JointDef;
using tessera::JointId;

tessera::region::Catalog MakeCatalog() {
  auto scene = std::make_shared<tessera::Scene>();
  for (std::uint64_t id = 1; id <= 40; ++id) {
    BodyDef def;
    def.id = BodyId(id);
    scene->bodies.push_back(def);
  }
  JointDef joint;
  joint.id = JointId(1);
  joint.body_a = BodyId(20);
  joint.body_b = BodyId(21);
  scene->joints.push_back(joint);
  scene->player.emplace().max_force_n = 100;
  return tessera::region::Catalog(scene);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tessera::region::Catalog catalog = MakeCatalog();
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
