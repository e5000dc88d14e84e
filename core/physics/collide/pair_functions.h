// The contract inside this folder: how each family of pairs is searched.
//
// A pair function works in float in the frame of one body, a. It knows nothing of the world: the same relative pose
// gives the same bits. Normals run from a to b. Where two surfaces have several places worth holding, it says where
// they are up to `speculative_m` apart; at most four points make a manifold.
//
//   LocalManifold m;
//   CollideConvex(box, hull, hull_in_box, 0.02f, cache, &m);
//   if (m.count > 0) ...
//
// Order: `Collide` and `CollideLocal` take any two; the families below take them as they say.
// Thread rule: free functions without state; Bullet's own statics allow one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/collide/geometry.h"
#include "core/physics/collide/manifold.h"

namespace tessera::physics {

// Where b is, seen from a.
struct LocalPose {
  Vec3f position;
  Mat3f rotation;
  Vec3d a_in_b;  // a's origin in b's frame, in doubles: features of a kilometres wide b near a are measured from
                 // here without loss; p_b = a_in_b + Into(rotation, p_a)
};

// The same pair, seen from b.
LocalPose Reversed(const LocalPose& b_in_a);

// on_b - on_a = separation_m * normal, up to rounding.
struct LocalPoint {
  Vec3f on_a, on_b;  // on the surfaces, both in a's frame
  float separation_m = 0;
  std::uint32_t feature = 0;  // names the point from search to search
};

struct LocalManifold {
  Vec3f normal;  // unit, from a to b, a's frame
  int count = 0;
  std::array<LocalPoint, kManifoldPoints> points;
  std::uint32_t key = 0;  // names a part or a group of triangles; 0 for convex pairs
};

// The same manifold as b sees it.
LocalManifold Reversed(const LocalManifold& manifold, const LocalPose& b_in_a);

// A convex pair's memory from search to search, in the order it was called with. All zero: empty.
struct ConvexCache {
  Vec3f axis;                 // last axis, from a to b in a's frame
  std::uint32_t feature = 0;  // the features that make the axis, in each family's own code
  float apart_m = 0;          // where nothing was found: no nearer than this; 0 where that is not known
};

// A part of a compound, or a triangle, has a cache of its own. Ascending by key; who writes the keys makes them unique.
struct PartCache {
  std::uint32_t key = 0;
  ConvexCache cache;
};
using PartCaches = std::vector<PartCache>;

// A half space as a sees it: solid where dot(normal, p) <= offset_m.
struct LocalPlane {
  Vec3f normal;
  float offset_m = 0;
};
LocalPlane PlaneIn(const Geometry& plane, const LocalPose& plane_in_a);

// --- collide.cpp: dispatch ------------------------------------------------------------------------------------------

// Any two convex shapes in any order. Sets `out->count` to 0 where they are further apart than `speculative_m`.
void CollideConvex(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                   ConvexCache& cache, LocalManifold* out);

// A convex shape and a plane.
void CollidePlane(const Geometry& a, const LocalPlane& plane, float speculative_m, LocalManifold* out);

// Any pair but two static kinds. Appends to `out`.
void CollideLocal(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m, PartCaches& parts,
                  std::vector<LocalManifold>* out);

// --- faces.cpp: what polyhedra and supporting faces share ------------------------------------------------------------

// A flat convex polygon, counter-clockwise seen from where its normal points.
struct FaceView {
  Vec3f normal;
  std::span<const Vec3f> loop;  // in a's frame
  std::uint32_t id = 0;         // the face's number in its shape
};
inline constexpr int kMaxFaceVertices = 255;

// Cuts `incident` to the prism over `reference` and keeps what is at most `speculative_m` above the reference face,
// reduced to four points. `normal` of the result is the reference face's, turned to run from a to b; points are where
// the incident face is, and above or below them on the reference face.
void CollideFaces(const FaceView& reference, const FaceView& incident, bool reference_is_a, float speculative_m,
                  LocalManifold* out);

// Fills `out->points` with at most four of `candidates`: the deepest, and those that spread widest about it across
// `normal`. Ties go to the earlier candidate.
void Reduce(std::span<const LocalPoint> candidates, Vec3f normal, LocalManifold* out);

// --- convex_pair.cpp -------------------------------------------------------------------------------------------------

// Any two convex shapes by GJK and EPA, with faces that look at each other found and clipped. Serves the pairs without
// a function of their own: cylinders and cones against all.
void CollideConvexPair(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                       ConvexCache& cache, LocalManifold* out);
// Cylinder or cone above a plane.
void CollideRoundPlane(const Geometry& a, const LocalPlane& plane, float speculative_m, LocalManifold* out);
// Nearest point of two convex shapes' surfaces, or the way out where they overlap; exact to GJK's tolerance. One point.
void NearestPoint(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                  LocalManifold* out);

// --- compound_pair.cpp, mesh_pair.cpp --------------------------------------------------------------------------------

// At least one is a compound; a is convex or a compound, b may be anything.
void CollideCompound(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                     PartCaches& parts, std::vector<LocalManifold>* out);
// a is convex.
void CollideMesh(const Geometry& a, const Geometry& mesh, const LocalPose& mesh_in_a, float speculative_m,
                 PartCaches& parts, std::vector<LocalManifold>* out);
void CollideHeightField(const Geometry& a, const Geometry& field, const LocalPose& field_in_a, float speculative_m,
                        PartCaches& parts, std::vector<LocalManifold>* out);

}  // namespace tessera::physics
