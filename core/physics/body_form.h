// BodyForm: the frame, the inertia and the geometry that follow from a body's definition.
//
//   FormCache forms;
//   const BodyForm form = forms.Of(def);
//
// Thread rule: one thread at a time.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "core/physics/body_frame.h"
#include "core/physics/collide/geometry.h"
#include "core/physics/mass_properties.h"
#include "core/physics/weak_cache.h"
#include "core/world/scene.h"

namespace tessera::physics {

struct BodyForm {
  BodyFrame frame;
  Vec3d inertia;  // principal moments, kg m^2; 0 for a static body
  std::shared_ptr<const Geometry> geometry;
};

// Makes the forms of bodies. Bodies that share a scene shape and have it in the same frame share one geometry.
class FormCache {
 public:
  BodyForm Of(const BodyDef& def);

 private:
  struct OfShape {
    MassProperties mass;
    std::vector<std::pair<BodyFrame, std::weak_ptr<const Geometry>>> geometries;
  };
  WeakCache<const Shape, OfShape> shapes_;
};

}  // namespace tessera::physics
