// Every hull must have a thickness and every triangle an area, wherever a scene comes from.
//
// For use inside core/world only. Thread rule: free functions on values.
#pragma once

#include <algorithm>
#include <vector>

#include "core/world/math.h"

namespace tessera {

// Thickness of the points in their thinnest direction, m, as a tetrahedron of extreme points shows it: 0 exactly if the
// points lie in one plane, on one line or in one place.
double ThicknessOf(const std::vector<Vec3f>& points);
// The least that a hull of these points must have, m: thinner, and it is flat in float coordinates.
double LeastThicknessOf(const std::vector<Vec3f>& points);

// False for a triangle that is flatter than float coordinates resolve: its normal would be noise.
inline bool HasArea(Vec3f a, Vec3f b, Vec3f c) {
  const Vec3d ab(b - a), ac(c - a), bc(c - b);
  const double longest = std::max({LengthSquared(ab), LengthSquared(ac), LengthSquared(bc)});
  return LengthSquared(Cross(ab, ac)) > 1e-14 * longest * longest;
}

}  // namespace tessera
