#include "core/world/scene_visuals.h"

#include <set>

namespace tessera {

std::vector<std::string> VisualFiles(const v1::Scene& scene) {
  std::set<std::string> files;
  const auto add = [&files](const auto& bodies) {
    for (const v1::Body& body : bodies) {
      for (const v1::Visual& visual : body.shape().visuals()) files.insert(visual.sha256());
    }
  };
  add(scene.bodies());
  for (const v1::Scatter& scatter : scene.scatters()) add(scatter.templates());
  for (const v1::Prefab& prefab : scene.prefabs()) add(prefab.bodies());
  for (const v1::Visual& visual : scene.player().body().shape().visuals()) files.insert(visual.sha256());
  return {files.begin(), files.end()};
}

}  // namespace tessera
