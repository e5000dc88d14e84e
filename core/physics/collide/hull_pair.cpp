// Boxes and hulls: separating axes over the faces of both and over the pairs of edges that meet on the Gauss map
// (Gregorius, "The Separating Axis Test between Convex Polyhedra", GDC 2013), then faces cut or edges' nearest points.
#include <absl/container/inlined_vector.h>

#include <algorithm>
#include <cmath>

#include "core/physics/collide/polyhedron.h"
#include "core/physics/collide/primary_pairs.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

constexpr float kNoSeparation = -1e30f;
// ConvexCache::feature: a face of a, a face of b, or edges.
constexpr std::uint32_t kFeatureFaceA = 1, kFeatureFaceB = 1u << 16, kFeatureEdges = 1u << 17;

// A face and the separation of the other hull's lowest vertex over it.
struct FaceAxis {
  std::uint32_t face = 0;
  float separation = kNoSeparation;
};

float Over(const Polyhedron::Face& face, const Polyhedron& other, Vec3f normal_in_other, float offset) {
  return Dot(normal_in_other, other.vertices[SupportVertex(other, -normal_in_other)]) - (face.offset_m - offset);
}

// The face of p that has q furthest above it; `q_in_p` is where q is. Stops where that is more than `enough_m`.
FaceAxis BestFace(const Polyhedron& p, const Polyhedron& q, const LocalPose& q_in_p, float enough_m, std::uint32_t last,
                  float keep_m) {
  FaceAxis best;
  float best_score = kNoSeparation;
  for (std::uint32_t i = 0; i < p.faces.size(); ++i) {
    const Polyhedron::Face& face = p.faces[i];
    const float separation = Over(face, q, Into(q_in_p.rotation, face.normal), Dot(face.normal, q_in_p.position));
    const float score = separation + (i == last ? keep_m : 0);
    if (score > best_score) best_score = score, best = {i, separation};
    if (separation > enough_m) return {i, separation};
  }
  return best;
}

struct EdgeAxis {
  std::uint32_t a = 0, b = 0;
  Vec3f normal;  // unit, from a to b
  float separation = kNoSeparation;
};

// An edge of b as a sees it, its faces' normals turned about.
struct Edge {
  Vec3f from, along;
  Vec3f left, right;
};

EdgeAxis BestEdges(const Polyhedron& p, const Polyhedron& q, const LocalPose& q_in_p, float enough_m) {
  constexpr float kParallel = 1e-4f;  // squared sine
  absl::InlinedVector<Edge, 64> edges;
  for (const Polyhedron::Edge& e : q.edges) {
    const Vec3f from = q.vertices[e.a];
    edges.push_back({q_in_p.position + q_in_p.rotation * from, q_in_p.rotation * (q.vertices[e.b] - from),
                     -(q_in_p.rotation * q.faces[e.left].normal), -(q_in_p.rotation * q.faces[e.right].normal)});
  }
  EdgeAxis best;
  for (std::uint32_t i = 0; i < p.edges.size(); ++i) {
    const Polyhedron::Edge& e = p.edges[i];
    const Vec3f from = p.vertices[e.a], along = p.vertices[e.b] - from;
    const Vec3f left = p.faces[e.left].normal, right = p.faces[e.right].normal;
    for (std::uint32_t j = 0; j < edges.size(); ++j) {
      const Edge& other = edges[j];
      // The arcs between either edge's normals cross on the sphere: only then is their plane one of the difference's.
      const float c = Dot(other.left, along), d = Dot(other.right, along);
      if (c * d >= 0) continue;
      const float l = Dot(left, other.along), r = Dot(right, other.along);
      if (l * r >= 0 || c * r <= 0) continue;
      const Vec3f cross = Cross(along, other.along);
      const float square = LengthSquared(cross);
      if (square < kParallel * LengthSquared(along) * LengthSquared(other.along)) continue;
      Vec3f normal = cross / std::sqrt(square);
      if (Dot(normal, from - p.inside) < 0) normal = -normal;
      const float separation = Dot(normal, other.from - from);
      if (separation > best.separation) best = {i, j, normal, separation};
      if (separation > enough_m) return best;
    }
  }
  return best;
}

// Where on the two edges they are nearest; false where that is past an end.
bool EdgePoint(const Polyhedron& p, const Polyhedron& q, const LocalPose& q_in_p, const EdgeAxis& axis,
               LocalManifold* out) {
  const Polyhedron::Edge &e = p.edges[axis.a], &f = q.edges[axis.b];
  const Vec3f from = p.vertices[e.a], u = p.vertices[e.b] - from;
  const Vec3f other = q_in_p.position + q_in_p.rotation * q.vertices[f.a];
  const Vec3f v = q_in_p.rotation * (q.vertices[f.b] - q.vertices[f.a]);
  const Vec3f between = other - from;
  const float uu = Dot(u, u), vv = Dot(v, v), uv = Dot(u, v), du = Dot(between, u), dv = Dot(between, v);
  const float square = uu * vv - uv * uv;
  const float s = (du * vv - dv * uv) / square, t = (du * uv - dv * uu) / square;
  const float s_on = std::clamp(s, 0.0f, 1.0f), t_on = std::clamp(t, 0.0f, 1.0f);
  const Vec3f middle = (from + u * s_on + other + v * t_on) * 0.5f;
  out->normal = axis.normal;
  out->count = 1;
  out->points[0] = {.on_a = middle - axis.normal * (0.5f * axis.separation),
                    .on_b = middle + axis.normal * (0.5f * axis.separation),
                    .separation_m = axis.separation,
                    .feature = kFeatureEdges | axis.a << 20 | axis.b};
  return std::abs(s - s_on) <= kClipSlack && std::abs(t - t_on) <= kClipSlack;
}

using Outline = absl::InlinedVector<Vec3f, 16>;

Outline LoopOf(const Polyhedron& p, const Polyhedron::Face& face, Vec3f position, const Mat3f& rotation) {
  Outline loop;
  for (std::uint32_t k = 0; k < face.count; ++k)
    loop.push_back(position + rotation * p.vertices[p.loops[face.first + k]]);
  return loop;
}

// The face that looks most against `direction` among those that hold the vertex furthest along -direction.
std::uint32_t Facing(const Polyhedron& p, Vec3f direction) {
  const std::uint32_t lowest = SupportVertex(p, -direction);
  std::uint32_t best = 0;
  float least = 2;
  for (std::uint32_t i = 0; i < p.faces.size(); ++i) {
    const float cosine = Dot(p.faces[i].normal, direction);
    const auto loop = p.loops.begin() + p.faces[i].first;
    if (cosine < least && std::find(loop, loop + p.faces[i].count, lowest) != loop + p.faces[i].count)
      best = i, least = cosine;
  }
  return best;
}

void FacePoints(const Polyhedron& p, const Polyhedron& q, const LocalPose& q_in_p, bool reference_is_a,
                std::uint32_t reference, float speculative_m, LocalManifold* out) {
  const Polyhedron &owner = reference_is_a ? p : q, &other = reference_is_a ? q : p;
  const Mat3f identity;
  const Mat3f &own_turn = reference_is_a ? identity : q_in_p.rotation,
              &turn = reference_is_a ? q_in_p.rotation : identity;
  const Vec3f own_place = reference_is_a ? Vec3f{} : q_in_p.position,
              place = reference_is_a ? q_in_p.position : Vec3f{};
  const Vec3f normal = own_turn * owner.faces[reference].normal;
  const std::uint32_t incident = Facing(other, Into(turn, normal));
  const Outline loop = LoopOf(owner, owner.faces[reference], own_place, own_turn);
  const Outline cut = LoopOf(other, other.faces[incident], place, turn);
  CollideFaces({normal, loop, reference}, {turn * other.faces[incident].normal, cut, incident}, reference_is_a,
               speculative_m, out);
}

// Along the axis of the last search.
float SeparationAlong(const Polyhedron& p, const Polyhedron& q, const LocalPose& q_in_p, Vec3f axis) {
  const Vec3f in_q = Into(q_in_p.rotation, axis);
  return Dot(axis, q_in_p.position) + Dot(in_q, q.vertices[SupportVertex(q, -in_q)]) -
         Dot(axis, p.vertices[SupportVertex(p, axis)]);
}

}  // namespace

void CollideHulls(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m, ConvexCache& cache,
                  LocalManifold* out) {
  const Polyhedron &p = *a.polyhedron, &q = *b.polyhedron;
  out->count = 0;
  cache.apart_m = 0;
  if (cache.feature != 0) {
    const float separation = SeparationAlong(p, q, pose, cache.axis);
    if (separation > speculative_m) {
      cache.apart_m = separation;
      return;
    }
  }
  const auto apart = [&](Vec3f axis, std::uint32_t feature, float separation) {
    cache = {.axis = axis, .feature = feature, .apart_m = separation};
  };
  const float size = std::min(a.middle_radius_m, b.middle_radius_m);
  const float keep = std::min(kKeepFace_m, kKeepFaceShare * size);
  const std::uint32_t last = cache.feature;
  const bool last_is_b = last >= kFeatureFaceB && last < kFeatureEdges;
  const FaceAxis on_a = BestFace(p, q, pose, speculative_m, last < kFeatureFaceB ? last - kFeatureFaceA : ~0u, keep);
  const Vec3f normal_a = p.faces[on_a.face].normal;
  if (on_a.separation > speculative_m) return apart(normal_a, kFeatureFaceA + on_a.face, on_a.separation);
  const FaceAxis on_b = BestFace(q, p, Reversed(pose), speculative_m, last_is_b ? last - kFeatureFaceB : ~0u, keep);
  const Vec3f normal_b = -(pose.rotation * q.faces[on_b.face].normal);
  if (on_b.separation > speculative_m) return apart(normal_b, kFeatureFaceB + on_b.face, on_b.separation);
  const EdgeAxis edges = BestEdges(p, q, pose, speculative_m);
  if (edges.separation > speculative_m) return apart(edges.normal, kFeatureEdges, edges.separation);

  // Rounding decides nothing: a's face rather than b's, the one of the last search rather than another.
  const bool reference_is_a = on_a.separation + (last_is_b ? -keep : keep) >= on_b.separation;
  const float face = reference_is_a ? on_a.separation : on_b.separation;
  const float lead = std::min(kEdgeLead_m, kEdgeLeadShare * size);
  const bool edge = edges.separation > face + lead;
  bool found;
  if (edge) {
    cache = {.axis = edges.normal, .feature = kFeatureEdges};
    found = EdgePoint(p, q, pose, edges, out);
  } else {
    cache = {.axis = reference_is_a ? normal_a : normal_b,
             .feature = reference_is_a ? kFeatureFaceA + on_a.face : kFeatureFaceB + on_b.face};
    FacePoints(p, q, pose, reference_is_a, reference_is_a ? on_a.face : on_b.face, speculative_m, out);
    found = Nearest(*out) <= face + lead;
  }
  if (found) return;
  const float separation = std::max(face, edges.separation);
  if (separation > 0) {
    // A corner near a corner, or an edge past the end of an edge.
    NearestPoint(a, b, pose, speculative_m, out);
    if (out->count == 0) cache.apart_m = speculative_m;
  } else if (!edge && edges.separation > face - lead) {
    EdgePoint(p, q, pose, edges, out);
  }
}

}  // namespace tessera::physics
