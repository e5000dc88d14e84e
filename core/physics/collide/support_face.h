// SupportFace: what of a convex shape lies farthest in a direction, as a polygon, a segment or a point.
//
// Round faces become polygons: the cap of a cylinder and the base of a cone have twelve corners at fixed places, of
// which the one nearest to the lowest point of the rim is moved there, so a tilted cap keeps its true depth.
//
//   const SupportFace face = SupportFaceOf(cylinder, {0, -1, 0});
//
// Thread rule: values; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/physics/collide/convex.h"

namespace tessera::physics {

inline constexpr int kSupportVertices = 32;  // a hull's larger face leaves out every second or third

struct SupportFace {
  int count = 0;  // 1: a point, 2: a segment, more: a polygon, counter-clockwise from outside
  std::array<Vec3f, kSupportVertices> vertices;  // pair's frame
  Vec3f normal;                                  // outward; of polygons only
  std::uint32_t id = 0;                          // the face's number in its shape

  std::span<const Vec3f> loop() const { return {vertices.data(), static_cast<std::size_t>(count)}; }
  void Add(Vec3f v) { vertices[static_cast<std::size_t>(count++)] = v; }
};

// `direction`: unit, pair's frame.
SupportFace SupportFaceOf(const Convex& convex, Vec3f direction);

// The normal of a surface, flat or round, that comes nearest to `direction`; none where the shape has only points
// there.
bool SurfaceNormal(const Convex& convex, Vec3f direction, Vec3f* normal);

}  // namespace tessera::physics
