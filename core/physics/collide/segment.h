// Segments: the axes of capsules, and edges, as the pairs of capsules see them.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/physics/collide/pair_functions.h"

namespace tessera::physics {

// Squared sine of the angle below which two lines count as parallel, and touch along their length: 6 degrees.
inline constexpr float kAlong = 0.01f;
// A face this much in line with the contact's normal is what the capsule lies on; cosine, 18 degrees.
inline constexpr float kFlat = 0.95f;

struct Segment {
  Vec3f center, half;  // from center - half to center + half
  float radius = 0;
  Vec3f At(float t) const { return center + half * t; }
};

inline Segment SegmentOf(const Geometry& capsule, const LocalPose& pose) {
  return {pose.position, pose.rotation.y * capsule.half_height_m, capsule.radius_m};
}

// A point of the segment against the plane at `surface` through a's skin, with its separation along the manifold's
// normal.
inline void Add(const Segment& segment, float t, float height, std::uint32_t feature, float speculative_m,
                LocalManifold* out) {
  const float separation = height - segment.radius;
  if (separation > speculative_m) return;
  const Vec3f at = segment.At(t);
  out->points[static_cast<std::size_t>(out->count++)] = {.on_a = at - out->normal * height,
                                                         .on_b = at - out->normal * segment.radius,
                                                         .separation_m = separation,
                                                         .feature = feature};
}

// Nearest parameters, each in [-1, 1], of two segments (Ericson, Real-Time Collision Detection, 5.1.9).
struct Meeting {
  float s = 0, t = 0;
};
inline Meeting MeetingOf(const Segment& p, const Segment& q) {
  const Vec3f r = p.center - q.center;
  const float a = LengthSquared(p.half), e = LengthSquared(q.half), f = Dot(q.half, r);
  if (a <= 0 && e <= 0) return {};
  if (a <= 0) return {0, std::clamp(f / e, -1.0f, 1.0f)};
  const float c = Dot(p.half, r);
  if (e <= 0) return {std::clamp(-c / a, -1.0f, 1.0f), 0};
  const float b = Dot(p.half, q.half), denominator = a * e - b * b;
  Meeting n;
  if (denominator > 1e-6f * a * e) n.s = std::clamp((b * f - c * e) / denominator, -1.0f, 1.0f);
  n.t = (b * n.s + f) / e;
  if (std::abs(n.t) > 1) {
    n.t = std::clamp(n.t, -1.0f, 1.0f);
    n.s = std::clamp((b * n.t - c) / a, -1.0f, 1.0f);
  }
  return n;
}

// Cuts [low, high] to where  start + t * slope <= limit.
inline bool CutRange(float start, float slope, float limit, float* low, float* high) {
  if (slope > 0) {
    *high = std::min(*high, (limit - start) / slope);
  } else if (slope < 0) {
    *low = std::max(*low, (limit - start) / slope);
  } else if (start > limit) {
    return false;
  }
  return *low <= *high;
}

// The segment over an edge of a (from edge.center - edge.half to + half) that it runs along: one point at either end of
// where they lie side by side. The manifold's normal is set.
inline void AddAlong(const Segment& edge, const Segment& segment, float speculative_m, LocalManifold* out) {
  const float square = LengthSquared(edge.half);
  const float start = Dot(segment.center - edge.center, edge.half) / square;
  const float slope = Dot(segment.half, edge.half) / square;
  float low = -1, high = 1;
  if (!CutRange(start, slope, 1, &low, &high) || !CutRange(-start, -slope, 1, &low, &high)) return;
  // In the order of the edge, so that both points keep their names however the capsule turns.
  const float ends[2] = {slope >= 0 ? low : high, slope >= 0 ? high : low};
  for (std::uint32_t k = 0; k < (low < high ? 2u : 1u); ++k) {
    const Vec3f at = segment.At(ends[k]), on_edge = edge.At(start + slope * ends[k]);
    Add(segment, ends[k], Dot(at - on_edge, out->normal) - edge.radius, 2 + k, speculative_m, out);
  }
}

inline bool Parallel(Vec3f u, Vec3f v) {
  return LengthSquared(Cross(u, v)) < kAlong * LengthSquared(u) * LengthSquared(v);
}

}  // namespace tessera::physics
