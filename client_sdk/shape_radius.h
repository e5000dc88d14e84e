// RadiusOf: a ball about a body's origin, or about its centre of mass, that holds its shape.
//
// Thread rule: a free function.
#pragma once

#include "core/world/scene.h"

namespace tessera::client {

// m; 0 for a mesh, a height field and a plane, which have no body near their origin.
double RadiusOf(const Shape& shape);

}  // namespace tessera::client
