#include "core/physics/collide/gjk.h"

#include <algorithm>
#include <cmath>

namespace tessera::physics {
namespace {

constexpr int kIterations = 64;
// Distances are right to this share of themselves; a direction to about its root.
constexpr double kRelative = 1e-8;
// Nearer than this share of the simplex's size counts as touching, where a direction is no longer worth anything.
constexpr double kTouching = 1e-7;

struct Vertex {
  Vec3d a, b, w;  // w = a - b
};

// Up to four vertices and the weights of the point nearest to the origin.
struct Simplex {
  std::array<Vertex, 4> v;
  std::array<double, 4> weight{};
  int count = 0;

  Vec3d Nearest() const {
    Vec3d p;
    for (int i = 0; i < count; ++i) p += v[static_cast<std::size_t>(i)].w * weight[static_cast<std::size_t>(i)];
    return p;
  }
};

Simplex One(const Vertex& a) { return {{a}, {1}, 1}; }

Simplex OfSegment(const Vertex& a, const Vertex& b) {
  const Vec3d ab = b.w - a.w;
  const double along = -Dot(a.w, ab), all = LengthSquared(ab);
  if (along <= 0 || all <= 0) return One(a);
  if (along >= all) return One(b);
  const double t = along / all;
  return {{a, b}, {1 - t, t}, 2};
}

Simplex OfTriangle(const Vertex& a, const Vertex& b, const Vertex& c) {
  const Vec3d ab = b.w - a.w, ac = c.w - a.w;
  const double d1 = -Dot(ab, a.w), d2 = -Dot(ac, a.w);
  if (d1 <= 0 && d2 <= 0) return One(a);
  const double d3 = -Dot(ab, b.w), d4 = -Dot(ac, b.w);
  if (d3 >= 0 && d4 <= d3) return One(b);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return OfSegment(a, b);
  const double d5 = -Dot(ab, c.w), d6 = -Dot(ac, c.w);
  if (d6 >= 0 && d5 <= d6) return One(c);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return OfSegment(a, c);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return OfSegment(b, c);
  const double sum = va + vb + vc;
  if (!(sum > 0)) return OfSegment(a, b);
  return {{a, b, c}, {va / sum, vb / sum, vc / sum}, 3};
}

// The origin lies on the other side of abc than d, or in its plane.
bool Outside(const Vertex& a, const Vertex& b, const Vertex& c, const Vertex& d) {
  const Vec3d normal = Cross(b.w - a.w, c.w - a.w);
  const double origin = -Dot(a.w, normal), other = Dot(d.w - a.w, normal);
  return origin * other <= 0;
}

// Four vertices where the origin is inside. A flat one does not tell sides truly: where the two are known to be
// `apart`, the origin is outside.
Simplex OfTetrahedron(const Simplex& s, bool apart) {
  constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
  Simplex best;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& f : kFaces) {
    const Vertex &a = s.v[static_cast<std::size_t>(f[0])], &b = s.v[static_cast<std::size_t>(f[1])],
                 &c = s.v[static_cast<std::size_t>(f[2])], &d = s.v[static_cast<std::size_t>(f[3])];
    if (!apart && !Outside(a, b, c, d)) continue;
    const Simplex face = OfTriangle(a, b, c);
    const double distance = LengthSquared(face.Nearest());
    if (distance < nearest) nearest = distance, best = face;
  }
  if (best.count > 0) return best;
  Simplex inside = s;
  inside.weight = {0.25, 0.25, 0.25, 0.25};
  return inside;
}

Simplex Reduced(const Simplex& s, bool apart) {
  switch (s.count) {
    case 1:
      return One(s.v[0]);
    case 2:
      return OfSegment(s.v[0], s.v[1]);
    case 3:
      return OfTriangle(s.v[0], s.v[1], s.v[2]);
    default:
      return OfTetrahedron(s, apart);
  }
}

Vertex At(const Core& a, const Core& b, Vec3d towards_b) {
  const Vec3d on_a = a.Support(towards_b), on_b = b.Support(-towards_b);
  return {on_a, on_b, on_a - on_b};
}

bool Holds(const Simplex& s, Vec3d w) {
  for (int i = 0; i < s.count; ++i) {
    if (s.v[static_cast<std::size_t>(i)].w == w) return true;
  }
  return false;
}

double SizeSquared(const Simplex& s) {
  double size = 0;
  for (int i = 0; i < s.count; ++i) size = std::max(size, LengthSquared(s.v[static_cast<std::size_t>(i)].w));
  return size;
}

GjkResult Apart(const Simplex& s, Vec3d v) {
  GjkResult result;
  for (int i = 0; i < s.count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    result.on_a += s.v[k].a * s.weight[k];
    result.on_b += s.v[k].b * s.weight[k];
  }
  result.kind = GjkResult::Kind::kApart;
  result.distance_m = Length(v);
  result.axis = v / -result.distance_m;
  return result;
}

}  // namespace

GjkResult Gjk(const Core& a, const Core& b, Vec3d start, double within_m, double close_enough_m) {
  if (!(LengthSquared(start) > 0) || !IsFinite(start)) start = {1, 0, 0};
  Simplex simplex = One(At(a, b, start));
  Vec3d v = simplex.v[0].w;  // of a - b, nearest to the origin so far
  for (int i = 0; i < kIterations; ++i) {
    const double squared = LengthSquared(v);
    // Not >: what is not a number counts as overlap, for which there is always an answer.
    if (!(squared > kTouching * kTouching * SizeSquared(simplex)) || simplex.count == 4) return {};
    const Vertex next = At(a, b, -v);
    const double along = Dot(v, next.w);
    if (along > 0 && along * along > within_m * within_m * squared) {
      return {GjkResult::Kind::kFar, {}, {}, along / std::sqrt(squared), v / -std::sqrt(squared)};
    }
    const double error = squared - along;  // of the distance, times the distance
    if (error <= kRelative * squared || error * error <= close_enough_m * close_enough_m * squared ||
        Holds(simplex, next.w)) {
      return Apart(simplex, v);
    }
    Simplex grown = simplex;
    grown.v[static_cast<std::size_t>(grown.count++)] = next;
    grown = Reduced(grown, along > 0);
    const Vec3d nearer = grown.Nearest();
    if (grown.count < 4 && LengthSquared(nearer) >= squared) return Apart(simplex, v);  // rounding: no way on
    simplex = grown;
    v = nearer;
  }
  return Apart(simplex, v);
}

}  // namespace tessera::physics
