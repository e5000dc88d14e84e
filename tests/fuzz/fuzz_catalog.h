// The scene that fuzzed frames are checked against: bodies 1 to 40, two of them jointed, players, and a
// property of each type.
#pragma once

#include <memory>

#include "core/region/catalog.h"

namespace tessera::fuzz {

inline region::Catalog MakeCatalog() {
  auto scene = std::make_shared<Scene>();
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
  scene->properties = {{"armed", false}, {"health", std::int64_t{100}}, {"speed", 1.5}, {"team", std::string("none")}};
  return region::Catalog(scene);
}

}  // namespace tessera::fuzz
