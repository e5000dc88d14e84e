// ShapeResolver: makes shapes from their messages; bodies that look alike share one.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "core/world/faults.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

class ShapeResolver {
 public:
  explicit ShapeResolver(Faults& faults) : faults_(faults) {}

  // The shape, one and the same for equal messages; null, and a fault in `faults`, if it is wrong. `field` is its path,
  // e.g. "shape".
  ShapePtr Resolve(const std::string& field, const v1::Shape& shape, Motion motion);

 private:
  ShapePtr Build(const std::string& field, const v1::Shape& shape, std::vector<Visual> visuals);

  Faults& faults_;
  std::unordered_map<std::string, ShapePtr> known_;  // by serialised message
};

}  // namespace tessera
