#include "core/physics/collide/triangle_pair.h"

#include <algorithm>
#include <cmath>

namespace tessera::physics {
namespace {

// Cosine and sine of what still counts as along a normal, and across an edge: 1 and 2 degrees.
constexpr float kFace = 0.99985f, kAcrossEdge = 0.035f;
// How far beyond the range of an edge's normals, sine, a direction may be to be taken back into it: one that is known
// exactly, and one that cores in an overlap have guessed.
constexpr float kBeyondExact = 1e-3f, kBeyondGuess = 0.035f;
// A direction this close to a face's normal, 1 - cosine, is the face's normal.
constexpr float kSame = 1e-6f;
// A face that is met no shallower than the deepest point, by at most this (m, and share of the ball inside), is met by
// the deepest point.
constexpr float kDeepest_m = 1e-3f, kDeepestShare = 0.05f;
// A shape that pokes through a sheet by less than this share of its height over the sheet came from behind.
constexpr float kFromBehind = 0.25f;

struct TriangleScene {
  const Geometry& geometry;
  Convex shape, triangle;
  const TrianglePlace& place;
  float speculative_m;
  bool was_in_front;
  float low, high, center;  // heights of the shape and its middle over the triangle's plane
};

// --- What normals an edge or corner has -----------------------------------------------------------------------------

// Across the edge from `a` to `b`, in the plane of that edge and `c`, towards c.
Vec3f Inward(Vec3f a, Vec3f b, Vec3f c) {
  const Vec3f edge = b - a, to = c - a;
  return Normalized(to - edge * (Dot(to, edge) / LengthSquared(edge)));
}

// Takes `up` into the range of normals at the edge; false if it lies beyond.
bool IntoEdgeRange(const TrianglePlace& place, std::size_t edge, float beyond, Vec3f* up) {
  const Vec3f a = place.corners[edge], b = place.corners[(edge + 1) % 3], c = place.corners[(edge + 2) % 3];
  if (Dot(*up, place.normal) < -beyond) return false;  // the neighbour's, if anyone's
  const Vec3f own = Inward(a, b, c);
  const float into_own = Dot(*up, own);
  if (into_own > beyond) return false;
  Vec3d other;
  if (place.surface.Opposite(place.index, edge, &other)) {
    const Vec3f d = place.In(other);
    const Vec3f next = Inward(a, b, d);
    const float into_next = Dot(*up, next);
    if (into_next > beyond || Dot(d - a, place.normal) > kBeyondGuess * Length(d - a)) return false;
    if (into_next > 0) *up -= next * into_next;
  }
  if (Dot(*up, own) > 0) *up -= own * Dot(*up, own);
  *up = Normalized(*up, place.normal);
  return true;
}

bool IntoCornerRange(const TrianglePlace& place, std::size_t corner, float beyond, Vec3f* up) {
  if (Dot(*up, place.normal) < -beyond) return false;
  std::array<Vec3d, Surface::kRing> ring;
  const std::size_t count = place.surface.Ring(place.index, corner, ring);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f to = Normalized(place.In(ring[i]) - place.corners[corner]);
    const float into = Dot(*up, to);
    if (into > beyond) return false;
    if (into > 0) *up -= to * into;
  }
  *up = Normalized(*up, place.normal);
  return true;
}

// Finds the feature of the triangle seen from `up` (face, edge or corner) and takes `up` into that feature's range.
bool IntoRange(const TrianglePlace& place, float beyond, Vec3f* up, bool* face) {
  *face = false;
  if (Dot(*up, place.normal) >= kFace) {
    *up = place.normal;
    return *face = true;
  }
  std::size_t far = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (Dot(*up, place.corners[i]) > Dot(*up, place.corners[far])) far = i;
  }
  const auto lean = [&](std::size_t i) {
    return std::abs(Dot(*up, Normalized(place.corners[i] - place.corners[far])));
  };
  const std::size_t next = (far + 1) % 3, last = (far + 2) % 3;
  const bool along_next = lean(next) <= lean(last);
  const bool edge = lean(along_next ? next : last) <= kAcrossEdge;
  if (edge ? !IntoEdgeRange(place, along_next ? far : last, beyond, up) : !IntoCornerRange(place, far, beyond, up)) {
    return false;
  }
  if (1 - Dot(*up, place.normal) <= (edge ? kSame : 1 - kFace)) *up = place.normal;
  return true;
}

struct NearestOnTriangle {
  Vec3d point;
  int feature = 0;  // 0: face; 1 + edge; 4 + corner
};

// NearestOnTriangle point of a triangle to the origin (Ericson, Real-Time Collision Detection, 5.1.5).
NearestOnTriangle NearestTo(Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d ab = b - a, ac = c - a;
  const double d1 = -Dot(ab, a), d2 = -Dot(ac, a);
  if (d1 <= 0 && d2 <= 0) return {a, 4};
  const double d3 = -Dot(ab, b), d4 = -Dot(ac, b);
  if (d3 >= 0 && d4 <= d3) return {b, 5};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {a + ab * (d1 / (d1 - d3)), 1};
  const double d5 = -Dot(ab, c), d6 = -Dot(ac, c);
  if (d6 >= 0 && d5 <= d6) return {c, 6};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {a + ac * (d2 / (d2 - d6)), 3};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return {b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), 2};
  const double sum = va + vb + vc;
  return {a + ab * (vb / sum) + ac * (vc / sum), 0};
}

// --- Ways to touch --------------------------------------------------------------------------------------------------

// The part of the shape that looks at the triangle, cut to the prism over it. False if nothing of it is there.
bool OverFace(const TriangleScene& s, LocalManifold* out) {
  out->count = 0;
  const SupportFace face = SupportFaceOf(s.shape, -s.place.normal);
  const FaceView top{s.place.normal, s.place.corners, 0};
  if (face.count > 2) {
    CollideFaces(top, {face.normal, face.loop(), face.id}, false, s.speculative_m, out);
    return out->count > 0;
  }
  return CollideOnFace(top, face, s.speculative_m, out);
}

float Deepest(const LocalManifold& m) {
  float separation = m.points[0].separation_m;
  for (int i = 1; i < m.count; ++i)
    separation = std::min(separation, m.points[static_cast<std::size_t>(i)].separation_m);
  return separation;
}

bool Above(const TrianglePlace& place, Vec3f p) {
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3f a = place.corners[i], b = place.corners[(i + 1) % 3];
    if (Dot(Cross(b - a, p - a), place.normal) < -1e-5f * LengthSquared(b - a)) return false;
  }
  return true;
}

// The centre is behind the triangle: out in front, unless this is a sheet that was met from behind.
bool ComesFromFront(const TriangleScene& s) {
  return s.was_in_front || s.place.surface.IsSolid(s.place.index) || s.high > kFromBehind * (s.high - s.low);
}

// As most triangles about a body are: the way to the point nearest to its middle separates them.
bool FarFrom(const TriangleScene& s) {
  const auto& [a, b, c] = s.place.corners;
  const Vec3d middle(s.geometry.middle);
  const Vec3f way(NearestTo(Vec3d(a) - middle, Vec3d(b) - middle, Vec3d(c) - middle).point);
  const float length = Length(way);
  return length > 0 && SeparationAlong(s.shape, s.triangle, way / length) > s.speculative_m;
}

// And no edge or corner is met.
TriangleContact FromBehind(const TriangleScene& s, LocalManifold* out) {
  if (!Above(s.place, s.geometry.middle)) return TriangleContact::kNone;
  const bool front = ComesFromFront(s);
  const Gap gap =
      front ? Gap{-s.place.normal, s.low, s.geometry.middle} : Gap{s.place.normal, -s.high, s.geometry.middle};
  MakeManifold(s.shape, s.triangle, gap, s.speculative_m, out);
  if (out->count == 0) return TriangleContact::kNone;
  return front ? TriangleContact::kDeep : TriangleContact::kBack;
}

TriangleContact General(const TriangleScene& s, LocalManifold* out) {
  LocalManifold over;
  const bool front = s.center >= 0, smooth = !s.place.surface.IsSharp(s.place.index);
  if (front || (smooth && s.was_in_front)) OverFace(s, &over);
  // The middle of a thin body may well be behind what it lies on; but deeper than its size it is on the other side.
  if (!front && over.count > 0 && Deepest(over) < -s.geometry.outer_radius_m) over.count = 0;
  if (smooth) {
    // Other ways than along the normal are the neighbours' or hardly differ.
    if (over.count > 0) {
      *out = over;
      return TriangleContact::kFront;
    }
    if (!front) return FromBehind(s, out);
  }
  if (over.count > 0 && s.low >= 0) {
    const float tolerance = std::min(kDeepest_m, kDeepestShare * s.geometry.middle_radius_m);
    if (Deepest(over) <= s.low + tolerance) {
      *out = over;
      return TriangleContact::kFront;
    }
  }
  if (FarFrom(s)) return TriangleContact::kNone;
  Gap gap;
  if (!FindGap(s.shape, s.triangle, s.speculative_m, &gap)) return TriangleContact::kNone;
  Vec3f up = -gap.normal;
  bool face = false;
  if (IntoRange(s.place, gap.exact ? kBeyondExact : kBeyondGuess, &up, &face) && (front || !face)) {
    if (front && up == s.place.normal) {
      *out = over;  // empty where the shape is beside the triangle: that is for its neighbour
      return out->count > 0 ? TriangleContact::kFront : TriangleContact::kNone;
    }
    gap.normal = -up;
    gap.separation_m = SeparationAlong(s.shape, s.triangle, gap.normal);
    MakeManifold(s.shape, s.triangle, gap, s.speculative_m, out);
    return out->count > 0 ? TriangleContact::kFront : TriangleContact::kNone;
  }
  if (!front) return FromBehind(s, out);
  if (over.count == 0) return TriangleContact::kNone;
  *out = over;
  return TriangleContact::kFront;
}

// --- Spheres --------------------------------------------------------------------------------------------------------

TriangleContact Ball(const TriangleScene& s, LocalManifold* out) {
  const auto& [a, b, c] = s.place.corners;
  const NearestOnTriangle near = NearestTo(Vec3d(a), Vec3d(b), Vec3d(c));
  const float distance = static_cast<float>(Length(near.point));
  if (distance - s.geometry.radius_m > s.speculative_m) return TriangleContact::kNone;
  Vec3f up = s.place.normal;
  float height = s.center;
  if (near.feature != 0) {
    if (s.center < 0) return TriangleContact::kNone;
    up = Normalized(-Vec3f(near.point), up);
    const auto feature = static_cast<std::size_t>(near.feature);
    if (feature < 4 ? !IntoEdgeRange(s.place, feature - 1, kBeyondExact, &up)
                    : !IntoCornerRange(s.place, feature - 4, kBeyondExact, &up)) {
      return TriangleContact::kNone;
    }
    if (1 - Dot(up, s.place.normal) <= kSame) up = s.place.normal;
    height = -Dot(up, Vec3f(near.point));
  }
  TriangleContact contact = TriangleContact::kFront;
  if (s.center < 0) {
    contact = ComesFromFront(s) ? TriangleContact::kDeep : TriangleContact::kBack;
    if (contact == TriangleContact::kBack) up = -up, height = -height;
  }
  out->normal = -up;
  out->count = 1;
  out->points[0] = {up * -s.geometry.radius_m, up * -height, height - s.geometry.radius_m, 0};
  return contact;
}

TriangleScene SceneOf(const Geometry& convex, const TrianglePlace& place, float speculative_m, bool was_in_front) {
  TriangleScene s{convex, AtOrigin(convex), TriangleAt(place.corners), place, speculative_m, was_in_front, 0, 0, 0};
  const double offset = Dot(Vec3d(place.normal), Vec3d(place.corners[0]));
  s.low = static_cast<float>(-ReachOf(s.shape, -place.normal) - offset);
  s.high = static_cast<float>(ReachOf(s.shape, place.normal) - offset);
  s.center = static_cast<float>(Dot(Vec3d(place.normal), Vec3d(convex.middle)) - offset);
  return s;
}

}  // namespace

TrianglePlace::TrianglePlace(const Surface& surface_in, const LocalPose& pose_in, std::uint32_t index_in)
    : surface(surface_in), pose(pose_in), index(index_in) {
  const std::array<Vec3d, 3> at = surface.Corners(index);
  corners = {In(at[0]), In(at[1]), In(at[2])};
  normal = pose.rotation * surface.Normal(index);
}

TriangleContact CollideTriangle(const Geometry& convex, const TrianglePlace& place, float speculative_m,
                                bool was_in_front, LocalManifold* out) {
  out->count = 0;
  const TriangleScene s = SceneOf(convex, place, speculative_m, was_in_front);
  if (s.low > speculative_m || s.high < 0) return TriangleContact::kNone;
  return convex.kind == GeometryKind::kSphere ? Ball(s, out) : General(s, out);
}

bool Retrieve(const Geometry& convex, const TrianglePlace& place, LocalManifold* out) {
  out->count = 0;
  const TriangleScene s = SceneOf(convex, place, 0, true);
  if (s.high >= 0 || -s.center > 2 * convex.outer_radius_m || !Above(place, convex.middle)) return false;
  MakeManifold(s.shape, s.triangle, {-place.normal, s.low, convex.middle}, 0, out);
  return out->count > 0;
}

}  // namespace tessera::physics
