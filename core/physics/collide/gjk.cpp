#include "core/physics/collide/gjk.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::physics {
namespace {

constexpr int kGjkIterations = 64;
// Distances are right to this share of themselves; a direction to about its root.
constexpr double kRelative = 1e-8;
// Nearer than this share of the simplex's size counts as touching, where a direction is no longer worth anything.
constexpr double kTouching = 1e-7;

struct Vertex {
  Vec3d a, b, w;  // w = a - b
};

// Up to four vertices.
struct Simplex {
  std::array<Vertex, 4> v;
  std::size_t count = 0;
};

// Those of a simplex's vertices, with weights, that make up its point nearest to the origin.
struct NearestOnSimplex {
  std::array<std::uint8_t, 4> index{};
  std::array<double, 4> weight{};
  std::size_t count = 0;
  Vec3d point;
};

NearestOnSimplex One(const Simplex& s, std::uint8_t i) { return {{i}, {1}, 1, s.v[i].w}; }

NearestOnSimplex OfSegment(const Simplex& s, std::uint8_t i, std::uint8_t j) {
  const Vec3d a = s.v[i].w, ab = s.v[j].w - a;
  const double along = -Dot(a, ab), all = LengthSquared(ab);
  if (along <= 0 || all <= 0) return One(s, i);
  if (along >= all) return One(s, j);
  const double t = along / all;
  return {{i, j}, {1 - t, t}, 2, a * (1 - t) + s.v[j].w * t};
}

NearestOnSimplex OfTriangle(const Simplex& s, std::uint8_t i, std::uint8_t j, std::uint8_t k) {
  const Vec3d a = s.v[i].w, b = s.v[j].w, c = s.v[k].w, ab = b - a, ac = c - a;
  const double d1 = -Dot(ab, a), d2 = -Dot(ac, a);
  if (d1 <= 0 && d2 <= 0) return One(s, i);
  const double d3 = -Dot(ab, b), d4 = -Dot(ac, b);
  if (d3 >= 0 && d4 <= d3) return One(s, j);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return OfSegment(s, i, j);
  const double d5 = -Dot(ab, c), d6 = -Dot(ac, c);
  if (d6 >= 0 && d5 <= d6) return One(s, k);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return OfSegment(s, i, k);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return OfSegment(s, j, k);
  const double sum = va + vb + vc;
  if (!(sum > 0)) return OfSegment(s, i, j);
  const double x = va / sum, y = vb / sum, z = vc / sum;
  return {{i, j, k}, {x, y, z}, 3, a * x + b * y + c * z};
}

// The origin lies on the other side of abc than d, or in its plane.
bool Outside(Vec3d a, Vec3d b, Vec3d c, Vec3d d) {
  const Vec3d normal = Cross(b - a, c - a);
  const double origin = -Dot(a, normal), other = Dot(d - a, normal);
  return origin * other <= 0;
}

// Four vertices where the origin is inside. A flat one does not separate its sides truly: where the two are known to be
// `apart`, the origin is outside.
NearestOnSimplex OfTetrahedron(const Simplex& s, bool apart) {
  constexpr std::uint8_t kFaces[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
  NearestOnSimplex best;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& f : kFaces) {
    if (!apart && !Outside(s.v[f[0]].w, s.v[f[1]].w, s.v[f[2]].w, s.v[f[3]].w)) continue;
    const NearestOnSimplex face = OfTriangle(s, f[0], f[1], f[2]);
    const double distance = LengthSquared(face.point);
    if (distance < nearest) nearest = distance, best = face;
  }
  if (best.count > 0) return best;
  return {{0, 1, 2, 3}, {0.25, 0.25, 0.25, 0.25}, 4, (s.v[0].w + s.v[1].w + s.v[2].w + s.v[3].w) * 0.25};
}

NearestOnSimplex NearestOf(const Simplex& s, bool apart) {
  switch (s.count) {
    case 1:
      return One(s, 0);
    case 2:
      return OfSegment(s, 0, 1);
    case 3:
      return OfTriangle(s, 0, 1, 2);
    default:
      return OfTetrahedron(s, apart);
  }
}

Vertex VertexAt(const Core& a, const Core& b, Vec3d towards_b) {
  const Vec3d on_a = a.Support(towards_b), on_b = b.Support(-towards_b);
  return {on_a, on_b, on_a - on_b};
}

bool Holds(const Simplex& s, Vec3d w) {
  for (std::size_t i = 0; i < s.count; ++i) {
    if (s.v[i].w == w) return true;
  }
  return false;
}

double SizeSquared(const Simplex& s) {
  double size = 0;
  for (std::size_t i = 0; i < s.count; ++i) size = std::max(size, LengthSquared(s.v[i].w));
  return size;
}

// `weight` of the vertices of `s`.
GjkResult Apart(const Simplex& s, const std::array<double, 4>& weight, Vec3d v) {
  GjkResult result;
  for (std::size_t i = 0; i < s.count; ++i) {
    result.on_a += s.v[i].a * weight[i];
    result.on_b += s.v[i].b * weight[i];
  }
  result.kind = GjkResult::Kind::kApart;
  result.distance_m = Length(v);
  result.axis = v / -result.distance_m;
  return result;
}

}  // namespace

GjkResult Gjk(const Core& a, const Core& b, Vec3d start, double within_m, double close_enough_m) {
  if (!(LengthSquared(start) > 0) || !IsFinite(start)) start = {1, 0, 0};
  Simplex simplex{{VertexAt(a, b, start)}, 1};
  std::array<double, 4> weight{1};
  Vec3d v = simplex.v[0].w;  // the point of a - b nearest to the origin so far
  for (int i = 0; i < kGjkIterations; ++i) {
    const double squared = LengthSquared(v);
    // Not >: what is not a number counts as overlap, for which there is always an answer.
    if (!(squared > kTouching * kTouching * SizeSquared(simplex)) || simplex.count == 4) return {};
    const Vertex next = VertexAt(a, b, -v);
    const double along = Dot(v, next.w);
    if (along > 0 && along * along > within_m * within_m * squared) {
      return {GjkResult::Kind::kFar, {}, {}, along / std::sqrt(squared), v / -std::sqrt(squared)};
    }
    const double error = squared - along;  // error of the distance, times the distance
    if (error <= kRelative * squared || error * error <= close_enough_m * close_enough_m * squared ||
        Holds(simplex, next.w)) {
      return Apart(simplex, weight, v);
    }
    const std::size_t before = simplex.count;
    simplex.v[simplex.count++] = next;
    const NearestOnSimplex nearest = NearestOf(simplex, along > 0);
    if (nearest.count < 4 && LengthSquared(nearest.point) >= squared) {  // rounding: no way on
      simplex.count = before;
      return Apart(simplex, weight, v);
    }
    // Indices of faces need not ascend.
    const std::array<Vertex, 4> old = simplex.v;
    for (std::size_t k = 0; k < nearest.count; ++k) simplex.v[k] = old[nearest.index[k]];
    simplex.count = nearest.count;
    weight = nearest.weight;
    v = nearest.point;
  }
  return Apart(simplex, weight, v);
}

}  // namespace tessera::physics
