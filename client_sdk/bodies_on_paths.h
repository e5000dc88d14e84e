// BodiesOnPaths: the bodies of a scene that move by paths: no region sends them, for they are where the time says.
//
// Pure. Thread rule: one thread at a time.
#pragma once

#include <memory>
#include <vector>

#include "client_sdk/client.h"
#include "core/world/scene.h"

namespace tessera::client {

class BodiesOnPaths {
 public:
  BodiesOnPaths() = default;  // none
  explicit BodiesOnPaths(std::shared_ptr<const Scene> scene);

  // Adds them to `shown`, ascending by id before and after, where they are so long after the world's beginning; before
  // that, where they begin.
  void AddTo(std::vector<ShownBody>& shown, double time_s) const;

 private:
  std::shared_ptr<const Scene> scene_;
  std::vector<const BodyDef*> defs_;  // the scene has them; ascending by id
};

}  // namespace tessera::client
