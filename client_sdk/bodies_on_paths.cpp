#include "client_sdk/bodies_on_paths.h"

#include <algorithm>
#include <utility>

#include "core/physics/body_path.h"

namespace tessera::client {

BodiesOnPaths::BodiesOnPaths(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) {
  for (const BodyDef& def : scene_->bodies) {
    if (def.path != nullptr) defs_.push_back(&def);
  }
}

void BodiesOnPaths::AddTo(std::vector<ShownBody>& shown, double time_s) const {
  const auto of_regions = std::ssize(shown);
  for (const BodyDef* def : defs_) shown.push_back({def->id, physics::PoseOn(*def->path, std::max(time_s, 0.0))});
  std::ranges::inplace_merge(shown, shown.begin() + of_regions, {}, &ShownBody::id);
}

}  // namespace tessera::client
