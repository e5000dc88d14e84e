// Mass properties of shapes of uniform density, in closed form where there is one.
//
//   MassProperties cone = MassPropertiesOf(Shape{ConeShape{.radius_m = 1, .height_m = 4}});
//   cone.center_of_mass;     // (0, -1, 0): a quarter of the height above the base
//   cone.principal * 2.5;    // moments of inertia of a cone of 2.5 kg
#pragma once

#include "core/world/scene.h"

namespace tessera::physics {

struct MassProperties {
  double volume_m3 = 0;
  Vec3d center_of_mass;  // in the shape's own coordinates
  Vec3d principal;       // moments about the centre of mass, of 1 kg, m^2
  // Axes of those moments: turns principal to shape coordinates. No turn unless the shape (a hull, a compound) is
  // lopsided.
  Quatd axes;
};

// Mass properties of a shape with a volume. Parts of a compound have one density, and where they overlap they count
// twice. Zero for meshes, height fields and planes, which are always static.
MassProperties MassPropertiesOf(const Shape& shape);

// Where a body's centre of mass, which BodyState::position means, lies in its shape's own coordinates, in which its
// joints' frames are given too. Zero for all but cones, hulls and compounds, and for static bodies, whose position is
// the shape's origin.
Vec3d CenterOfMass(const BodyDef& def);

}  // namespace tessera::physics
