// Capsules against capsules, boxes and hulls. A capsule is a segment with a radius: what is nearest to the segment is
// nearest to the capsule.
#include <algorithm>
#include <cmath>

#include "core/physics/collide/polyhedron.h"
#include "core/physics/collide/primary_pairs.h"
#include "core/physics/collide/segment.h"

namespace tessera::physics {
void CollideCapsules(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                     LocalManifold* out) {
  out->count = 0;
  const Segment other = SegmentOf(b, pose), own{{}, {0, a.half_height_m, 0}, a.radius_m};
  const Meeting near = MeetingOf(own, other);
  const Vec3f at_a = own.At(near.s), at_b = other.At(near.t), between = at_b - at_a;
  const float reach = a.radius_m + b.radius_m + speculative_m, square = LengthSquared(between);
  if (square > reach * reach) return;
  const float distance = std::sqrt(square);
  if (distance > 0) {
    out->normal = between / distance;
  } else {  // the axes cross: out to the side of both
    out->normal = Normalized(Cross(own.half, other.half), Vec3f{1, 0, 0});
  }
  if (Parallel(own.half, other.half) && std::abs(out->normal.y) < 0.5f) {
    AddAlong(own, other, speculative_m, out);
    if (out->count == 2) return;
  }
  out->count = 1;
  out->points[0] = {.on_a = at_a + out->normal * a.radius_m,
                    .on_b = at_b - out->normal * b.radius_m,
                    .separation_m = distance - a.radius_m - b.radius_m,
                    .feature = 1};
}

namespace {

// --- Polyhedra. `half` of a segment may be zero: a capsule without a cylinder.

constexpr float kNoDepth = -1e30f;

struct Touch {
  Vec3f normal;                 // out of the polyhedron
  float distance_m = kNoDepth;  // from the segment itself; negative where it is inside
  float t = 0;                  // where on the segment
};

Segment EdgeOf(const Polyhedron& p, const Polyhedron::Edge& edge) {
  const Vec3f u = p.vertices[edge.a], v = p.vertices[edge.b];
  return {(u + v) * 0.5f, (v - u) * 0.5f, 0};
}

// Whether some of the segment lies inside.
bool Pierces(const Polyhedron& p, const Segment& s) {
  float low = -1, high = 1;
  for (const Polyhedron::Face& face : p.faces)
    if (!CutRange(Dot(face.normal, s.center), Dot(face.normal, s.half), face.offset_m, &low, &high)) return false;
  return true;
}

// Nearest points where the segment is wholly outside: one of its ends over the polyhedron, or it and an edge.
Touch NearestOutside(const Polyhedron& p, const Segment& s, float enough_m) {
  Touch best;
  best.distance_m = -kNoDepth;
  for (const float t : {-1.0f, 1.0f}) {
    const PolyhedronPoint near = NearestOn(p, s.At(t), enough_m);
    if (near.distance_m < best.distance_m) best = {near.normal, near.distance_m, t};
  }
  for (const Polyhedron::Edge& e : p.edges) {
    const Segment edge = EdgeOf(p, e);
    const Meeting near = MeetingOf(edge, s);
    const Vec3f away = s.At(near.t) - edge.At(near.s);
    const float square = LengthSquared(away);
    // The slack leaves it to an end where both give the same.
    if (best.distance_m <= 0 || square >= best.distance_m * best.distance_m * (1 - 1e-6f)) continue;
    const float distance = std::sqrt(square);
    if (distance > 0) best = {away / distance, distance, near.t};
  }
  return best;
}

// The shallowest way out where the segment is inside: along a face's normal or across an edge and the segment.
Touch NearestInside(const Polyhedron& p, const Segment& s) {
  Touch best;
  for (const Polyhedron::Face& face : p.faces) {
    const float start = Dot(face.normal, s.center) - face.offset_m, slope = Dot(face.normal, s.half);
    const float lowest = start - std::abs(slope);
    if (lowest > best.distance_m) best = {face.normal, lowest, slope > 0 ? -1.0f : 1.0f};
  }
  const float lead = 1e-4f * std::abs(best.distance_m);
  for (const Polyhedron::Edge& e : p.edges) {
    const Segment edge = EdgeOf(p, e);
    const Vec3f cross = Cross(edge.half, s.half);
    const float length = Length(cross);
    if (length * length < 1e-4f * LengthSquared(edge.half) * LengthSquared(s.half) || length <= 0) continue;
    Vec3f normal = cross / length;
    if (Dot(normal, edge.center - p.inside) < 0) normal = -normal;
    // Only edges whose two faces look to either side of the normal bear it.
    const Vec3f vertex = p.vertices[SupportVertex(p, normal)];
    if (Dot(vertex - edge.center, normal) > 1e-5f * length) continue;
    const float distance = Dot(s.center - edge.center, normal);
    if (distance > best.distance_m + lead) best = {normal, distance, MeetingOf(edge, s).t};
  }
  return best;
}

// Both ends of the part that lies over the face, with separations along the normal.
void AddOverFace(const Polyhedron& p, const Polyhedron::Face& face, const Segment& s, float speculative_m,
                 LocalManifold* out) {
  float low = -1, high = 1;
  for (std::uint32_t k = 0; k < face.count; ++k) {
    const Vec3f from = p.vertices[p.loops[face.first + k]];
    const Vec3f to = p.vertices[p.loops[face.first + (k + 1 == face.count ? 0 : k + 1)]];
    const Vec3f outward = Cross(to - from, out->normal);
    if (!CutRange(Dot(outward, s.center - from), Dot(outward, s.half), 0, &low, &high)) return;
  }
  const float scale = 1 / Dot(face.normal, out->normal);
  for (std::uint32_t k = 0; k < (low < high ? 2u : 1u); ++k) {
    const float t = k == 0 ? low : high;
    Add(s, t, (Dot(face.normal, s.At(t)) - face.offset_m) * scale, 4 + k, speculative_m, out);
  }
}

// Where the segment runs along an edge that looks its way.
void AddAlongEdge(const Polyhedron& p, const Segment& s, float speculative_m, LocalManifold* out) {
  const float most = Dot(out->normal, p.vertices[SupportVertex(p, out->normal)]);
  for (const Polyhedron::Edge& e : p.edges) {
    const Segment edge = EdgeOf(p, e);
    const float lowest = Dot(out->normal, edge.center) - std::abs(Dot(out->normal, edge.half));
    if (!Parallel(edge.half, s.half) || lowest < most - std::sqrt(kAlong) * 2 * Length(edge.half)) continue;
    AddAlong(edge, s, speculative_m, out);
    return;
  }
}

void CollidePolyhedronCapsule(const Polyhedron& p, const Segment& s, float speculative_m, LocalManifold* out) {
  out->count = 0;
  const bool inside = Pierces(p, s);
  const Touch touch = inside ? NearestInside(p, s) : NearestOutside(p, s, s.radius + speculative_m);
  if (touch.distance_m > s.radius + speculative_m) return;
  out->normal = touch.normal;
  const Polyhedron::Face* face = nullptr;
  float flattest = kFlat;
  for (const Polyhedron::Face& f : p.faces) {
    const float cosine = Dot(f.normal, touch.normal);
    if (cosine > flattest) face = &f, flattest = cosine;
  }
  if (face != nullptr) AddOverFace(p, *face, s, speculative_m, out);
  if (face == nullptr) AddAlongEdge(p, s, speculative_m, out);
  // Whatever else there is, the nearest point is among them.
  const float deepest = touch.distance_m - s.radius;
  if (Nearest(*out) > deepest + 1e-3f * (s.radius + std::abs(deepest)))
    Add(s, touch.t, touch.distance_m, 1, speculative_m, out);
}

}  // namespace

void CollideHullCapsule(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                        LocalManifold* out) {
  CollidePolyhedronCapsule(*a.polyhedron, SegmentOf(b, pose), speculative_m, out);
}

}  // namespace tessera::physics
