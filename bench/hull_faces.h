// Faces of a convex hull that is given by its corners, for what needs planes and edges of a few points.
//
// Tries all triples, which for the tens of points of a game's hull takes less than anything cleverer would. Points
// inside the hull belong to no face. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/world/math.h"

namespace tessera::bench {

struct HullFace {
  Vec3d normal;                      // outward, unit
  double offset_m = 0;               // dot(normal, p) of its points
  std::vector<std::size_t> corners;  // indices of points, counter-clockwise seen from outside
};

// `points`: at least 4, not all in one plane.
std::vector<HullFace> FacesOf(std::span<const Vec3f> points);

}  // namespace tessera::bench
