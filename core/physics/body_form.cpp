#include "core/physics/body_form.h"

#include <algorithm>

namespace tessera::physics {
namespace {

BodyFrame FrameOf(const BodyDef& def, const MassProperties& mass) {
  BodyFrame frame;
  if (def.motion == Motion::kDynamic || def.kinematic) {
    frame.origin = mass.center_of_mass;
    if (!def.inertia_kg_m2) frame.axes = mass.axes;
  } else if (const auto* field = std::get_if<HeightFieldShape>(&def.shape->form)) {
    const auto [low, high] = std::minmax_element(field->heights_m.begin(), field->heights_m.end());
    frame.origin.y = (static_cast<double>(*low) + *high) / 2;
  }
  return frame;
}

}  // namespace

BodyForm FormCache::Of(const BodyDef& def) {
  OfShape& known = shapes_.Of(def.shape, [&] { return OfShape{MassPropertiesOf(*def.shape), {}}; });
  BodyForm form{.frame = FrameOf(def, known.mass), .inertia = {}, .geometry = nullptr};
  if (def.motion == Motion::kDynamic) form.inertia = def.inertia_kg_m2.value_or(known.mass.principal * def.mass_kg);
  std::erase_if(known.geometries, [](const auto& made) { return made.second.expired(); });
  for (const auto& [frame, geometry] : known.geometries) {
    if (frame == form.frame) form.geometry = geometry.lock();
  }
  if (!form.geometry) {
    form.geometry = MakeGeometry(*def.shape, form.frame);
    known.geometries.emplace_back(form.frame, form.geometry);
  }
  return form;
}

}  // namespace tessera::physics
