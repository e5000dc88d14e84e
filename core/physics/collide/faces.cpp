#include <algorithm>
#include <cmath>

#include "core/physics/collide/pair_functions.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// Index of the largest value; the earlier of two that are equal.
template <class Value>
std::size_t Largest(std::span<const LocalPoint> points, Value value) {
  std::size_t best = 0;
  float best_value = value(points[0]);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const float v = value(points[i]);
    if (v > best_value) best = i, best_value = v;
  }
  return best;
}

// A corner of the incident face while it is cut, named by the edges that meet there: of the incident face, or sides of
// the reference face from kSides on.
struct FaceCorner {
  Vec3f place;
  std::uint16_t in = 0, out = 0;
};
constexpr std::uint16_t kSides = 256;

// A point that is less than this above the deepest, m, is as good.
constexpr float kAsDeep_m = 1e-5f;

// Keeps what lies at most `slack` outside; at most as many corners as `to` has room for.
std::size_t Cut(std::span<const FaceCorner> from, Vec3f outward, float offset, float slack, std::uint16_t side,
                std::span<FaceCorner> to) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < from.size() && kept + 2 <= to.size(); ++i) {
    const FaceCorner &p = from[i], &q = from[i + 1 == from.size() ? 0 : i + 1];
    const float dp = offset - Dot(outward, p.place), dq = offset - Dot(outward, q.place);
    const bool p_in = dp >= -slack, q_in = dq >= -slack;
    if (p_in) to[kept++] = p;
    if (p_in == q_in) continue;
    const float t = std::clamp(dp / (dp - dq), 0.0f, 1.0f);
    const Vec3f place = p.place + (q.place - p.place) * t;
    to[kept++] = q_in ? FaceCorner{place, side, p.out} : FaceCorner{place, p.out, side};
  }
  return kept;
}

std::uint32_t NameOf(const FaceView& reference, const FaceView& incident, bool reference_is_a,
                     const FaceCorner& corner) {
  // Faces and edges are too many for 32 bits side by side, so they are mixed; two that clash only swap impulses.
  std::uint32_t name = reference.id * 0x9e3779b1u ^ incident.id * 0x85ebca77u;
  name ^= (static_cast<std::uint32_t>(corner.in) << 16 | corner.out) * 0xc2b2ae3du;
  return (name & ~1u) | (reference_is_a ? 1u : 0u);
}

// Room for polygons of up to kRoom corners in all.
template <std::size_t kRoom>
void Collide(const FaceView& reference, const FaceView& incident, bool reference_is_a, float speculative_m,
             LocalManifold* out) {
  std::array<FaceCorner, kRoom> buffers[2];
  std::size_t count = incident.loop.size();
  for (std::size_t i = 0; i < count; ++i) {
    buffers[0][i] = {incident.loop[i], static_cast<std::uint16_t>(i == 0 ? count - 1 : i - 1),
                     static_cast<std::uint16_t>(i)};
  }
  int now = 0;
  const std::size_t sides = reference.loop.size();
  for (std::size_t k = 0; k < sides && count > 0; ++k) {
    const Vec3f from = reference.loop[k], along = reference.loop[k + 1 == sides ? 0 : k + 1] - from;
    const float length = Length(along);
    if (length <= 0) continue;
    const Vec3f outward = Cross(along, reference.normal) / length;
    count = Cut({buffers[now].data(), count}, outward, Dot(outward, from), kClipSlack * length / 2,
                static_cast<std::uint16_t>(kSides + k), buffers[1 - now]);
    now = 1 - now;
  }
  std::array<LocalPoint, kRoom> points;
  std::size_t kept = 0;
  const float offset = Dot(reference.normal, reference.loop[0]);
  for (const FaceCorner& corner : std::span(buffers[now].data(), count)) {
    const float height = Dot(reference.normal, corner.place) - offset;
    if (height > speculative_m) continue;
    const Vec3f below = corner.place - reference.normal * height;
    points[kept++] = {.on_a = reference_is_a ? below : corner.place,
                      .on_b = reference_is_a ? corner.place : below,
                      .separation_m = height,
                      .feature = NameOf(reference, incident, reference_is_a, corner)};
  }
  out->normal = reference_is_a ? reference.normal : -reference.normal;
  Reduce({points.data(), kept}, out->normal, out);
}

}  // namespace

void Reduce(std::span<const LocalPoint> candidates, Vec3f normal, LocalManifold* out) {
  if (candidates.size() <= kManifoldPoints) {
    std::copy(candidates.begin(), candidates.end(), out->points.begin());
    out->count = static_cast<int>(candidates.size());
    return;
  }
  // The deepest, of those about as deep the one farthest out, so that rounding does not choose; the furthest from it;
  // and on either side of the line between them what spans most.
  Vec3f middle;
  float deepest = candidates[0].separation_m;
  for (const LocalPoint& p : candidates) {
    middle += p.on_a;
    deepest = std::min(deepest, p.separation_m);
  }
  middle = middle / static_cast<float>(candidates.size());
  const float as_deep = deepest + kAsDeep_m;
  const std::size_t first = Largest(
      candidates, [&](const LocalPoint& p) { return p.separation_m <= as_deep ? LengthSquared(p.on_a - middle) : -1; });
  const Vec3f origin = candidates[first].on_a;
  const std::size_t second = Largest(candidates, [&](const LocalPoint& p) { return LengthSquared(p.on_a - origin); });
  const Vec3f across = Cross(normal, candidates[second].on_a - origin);
  const auto side = [&](const LocalPoint& p) { return Dot(across, p.on_a - origin); };
  const std::size_t third = Largest(candidates, side);
  const std::size_t fourth = Largest(candidates, [&](const LocalPoint& p) { return -side(p); });
  out->count = 0;
  out->points[out->count++] = candidates[first];
  if (second != first) out->points[out->count++] = candidates[second];
  if (side(candidates[third]) > 0) out->points[out->count++] = candidates[third];
  if (side(candidates[fourth]) < 0) out->points[out->count++] = candidates[fourth];
}

void CollideFaces(const FaceView& reference, const FaceView& incident, bool reference_is_a, float speculative_m,
                  LocalManifold* out) {
  // A convex polygon gains at most one corner by a cut.
  constexpr std::size_t kFew = 32, kMost = 2 * kMaxFaceVertices + 2;
  if (reference.loop.size() + incident.loop.size() + 2 <= kFew)
    Collide<kFew>(reference, incident, reference_is_a, speculative_m, out);
  else
    Collide<kMost>(reference, incident, reference_is_a, speculative_m, out);
}

}  // namespace tessera::physics
