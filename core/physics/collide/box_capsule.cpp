// Box and capsule: the squared distance of a point on the segment from the box is convex and piecewise quadratic, so
// its slope is sought where it crosses 0.
#include <algorithm>
#include <cmath>

#include "core/physics/collide/primary_pairs.h"
#include "core/physics/collide/segment.h"

namespace tessera::physics {
namespace {

struct Line {
  float center[3], half[3], box[3];

  // How far the point at t is outside of the slab of axis i, with its sign.
  float Outside(int i, float t) const {
    const float x = center[i] + t * half[i];
    return x - std::clamp(x, -box[i], box[i]);
  }
  // Half the derivative of the squared distance.
  float Slope(float t) const { return half[0] * Outside(0, t) + half[1] * Outside(1, t) + half[2] * Outside(2, t); }
};

// Where on the segment, in [-1, 1], the box is nearest.
float NearestOn(const Line& line) {
  float low = -1, high = 1, at_low = line.Slope(low), at_high = line.Slope(high);
  if (at_low >= 0) return low;
  if (at_high <= 0) return high;
  for (int i = 0; i < 3; ++i) {
    if (line.half[i] == 0) continue;
    for (const float side : {-line.box[i], line.box[i]}) {
      const float t = (side - line.center[i]) / line.half[i];
      if (!(t > low && t < high)) continue;
      const float slope = line.Slope(t);
      if (slope == 0) return t;
      if (slope < 0)
        low = t, at_low = slope;
      else
        high = t, at_high = slope;
    }
  }
  return std::clamp(low - at_low * (high - low) / (at_high - at_low), low, high);
}

Vec3f ToVector(const float v[3]) { return {v[0], v[1], v[2]}; }

// Adds the part of the segment that lies over the face of axis i, with separations along the manifold's normal n.
void AddOverFace(const Line& line, const Segment& segment, int i, const float n[3], float speculative_m,
                 LocalManifold* out) {
  float low = -1, high = 1;
  for (const int k : {kNext[i], kAfter[i]})
    if (!CutRange(line.center[k], line.half[k], line.box[k], &low, &high) ||
        !CutRange(-line.center[k], -line.half[k], line.box[k], &low, &high))
      return;
  const float sign = n[i] > 0 ? 1.0f : -1.0f;
  // Named by the ends of the capsule, however it is turned.
  for (std::uint32_t k = 0; k < (low < high ? 2u : 1u); ++k) {
    const float t = k == 0 ? low : high;
    const float height = (sign * (line.center[i] + t * line.half[i]) - line.box[i]) / std::abs(n[i]);
    Add(segment, t, height, 4 + k, speculative_m, out);
  }
}

}  // namespace

void CollideBoxCapsule(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                       LocalManifold* out) {
  out->count = 0;
  const Segment segment = SegmentOf(b, pose);
  const Vec3f h = a.half_extents_m, c = segment.center, d = segment.half;
  const Line line{{c.x, c.y, c.z}, {d.x, d.y, d.z}, {h.x, h.y, h.z}};
  const float reach = b.radius_m + speculative_m;
  for (int i = 0; i < 3; ++i)
    if (std::abs(line.center[i]) - std::abs(line.half[i]) - line.box[i] > reach) return;
  const float t = NearestOn(line);
  const float away[3] = {line.Outside(0, t), line.Outside(1, t), line.Outside(2, t)};
  const float square = away[0] * away[0] + away[1] * away[1] + away[2] * away[2];
  if (square > reach * reach) return;
  // So near the axis that the way to it is rounding, or inside: by the axes that separate them.
  constexpr float kInside = 1e-4f;
  if (square <= kInside * kInside * b.radius_m * b.radius_m) return CollideHullCapsule(a, b, pose, speculative_m, out);

  const float distance = std::sqrt(square);
  const float n[3] = {away[0] / distance, away[1] / distance, away[2] / distance};
  out->normal = ToVector(n);
  int most = 0, least = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(n[k]) > std::abs(n[most])) most = k;
    if (std::abs(n[k]) <= std::abs(n[least])) least = k;
  }
  if (std::abs(n[most]) > kFlat) {
    AddOverFace(line, segment, most, n, speculative_m, out);
  } else if (line.half[least] * line.half[least] > (1 - kAlong) * LengthSquared(d)) {
    float edge[3] = {}, half[3] = {};
    half[least] = line.box[least];
    for (const int k : {kNext[least], kAfter[least]}) edge[k] = n[k] >= 0 ? line.box[k] : -line.box[k];
    AddAlong({ToVector(edge), ToVector(half), 0}, segment, speculative_m, out);
  }
  // Whatever else there is, the nearest point is among them.
  const float deepest = distance - b.radius_m;
  if (Nearest(*out) > deepest + 1e-3f * (b.radius_m + std::abs(deepest)))
    Add(segment, t, distance, 1, speculative_m, out);
}

}  // namespace tessera::physics
