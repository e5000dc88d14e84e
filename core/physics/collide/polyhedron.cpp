#include "core/physics/collide/polyhedron.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace tessera::physics {
namespace {

// The point of the face nearest to `from`, which lies above the plane of the face.
Vec3f NearestOnFace(const Polyhedron& p, const Polyhedron::Face& face, Vec3f from) {
  Vec3f nearest = from - face.normal * (Dot(face.normal, from) - face.offset_m);
  float best = std::numeric_limits<float>::max();
  const Vec3f below = nearest;
  for (std::uint32_t k = 0; k < face.count; ++k) {
    const Vec3f u = p.vertices[p.loops[face.first + k]];
    const Vec3f v = p.vertices[p.loops[face.first + (k + 1 == face.count ? 0 : k + 1)]];
    const Vec3f along = v - u;
    if (Dot(Cross(along, face.normal), below - u) <= 0) continue;  // inside of this edge
    const float t = std::clamp(Dot(from - u, along) / LengthSquared(along), 0.0f, 1.0f);
    const Vec3f on_edge = u + along * t;
    const float square = LengthSquared(from - on_edge);
    if (square < best) best = square, nearest = on_edge;
  }
  return nearest;
}

}  // namespace

std::uint32_t SupportVertex(const Polyhedron& polyhedron, Vec3f direction) {
  std::uint32_t best = 0;
  float furthest = Dot(direction, polyhedron.vertices[0]);
  for (std::uint32_t i = 1; i < polyhedron.vertices.size(); ++i) {
    const float along = Dot(direction, polyhedron.vertices[i]);
    if (along > furthest) best = i, furthest = along;
  }
  return best;
}

PolyhedronPoint NearestOn(const Polyhedron& polyhedron, Vec3f from, float enough_m) {
  PolyhedronPoint result{.point = {}, .normal = {}, .distance_m = -std::numeric_limits<float>::max()};
  for (const Polyhedron::Face& face : polyhedron.faces) {
    const float height = Dot(face.normal, from) - face.offset_m;
    if (height > result.distance_m) result.normal = face.normal, result.distance_m = height;
  }
  result.point = from - result.normal * result.distance_m;
  if (result.distance_m <= 0 || result.distance_m > enough_m) return result;
  float best = std::numeric_limits<float>::max();
  for (const Polyhedron::Face& face : polyhedron.faces) {
    if (Dot(face.normal, from) <= face.offset_m) continue;
    const Vec3f nearest = NearestOnFace(polyhedron, face, from);
    const float square = LengthSquared(from - nearest);
    if (square < best) best = square, result.point = nearest;
  }
  // So near the surface the direction to it is rounding, and the normal of the face stays.
  constexpr float kOnSurface_m = 1e-6f;
  const float distance = std::sqrt(best);
  if (distance > kOnSurface_m) result.normal = (from - result.point) / distance;
  result.distance_m = distance;
  return result;
}

std::shared_ptr<const Polyhedron> BoxOf(Vec3f h) {
  auto box = std::make_shared<Polyhedron>();
  for (unsigned i = 0; i < 8; ++i)
    box->vertices.push_back({i & 1 ? h.x : -h.x, i & 2 ? h.y : -h.y, i & 4 ? h.z : -h.z});
  const auto face = [&](Vec3f normal, float offset, std::initializer_list<std::uint32_t> loop) {
    box->faces.push_back({.normal = normal,
                          .offset_m = offset,
                          .first = static_cast<std::uint32_t>(box->loops.size()),
                          .count = static_cast<std::uint32_t>(loop.size())});
    box->loops.insert(box->loops.end(), loop);
  };
  face({-1, 0, 0}, h.x, {0, 4, 6, 2});
  face({1, 0, 0}, h.x, {1, 3, 7, 5});
  face({0, -1, 0}, h.y, {0, 1, 5, 4});
  face({0, 1, 0}, h.y, {2, 6, 7, 3});
  face({0, 0, -1}, h.z, {0, 2, 3, 1});
  face({0, 0, 1}, h.z, {4, 5, 7, 6});
  JoinFaces(box.get());
  return box;
}

bool JoinFaces(Polyhedron* polyhedron) {
  using Index = std::uint32_t;
  std::map<std::pair<Index, Index>, Index> open;  // edges that wait for their other face
  polyhedron->edges.clear();
  for (Index f = 0; f < polyhedron->faces.size(); ++f) {
    const Polyhedron::Face& face = polyhedron->faces[f];
    for (Index k = 0; k < face.count; ++k) {
      const Index u = polyhedron->loops[face.first + k];
      const Index v = polyhedron->loops[face.first + (k + 1 == face.count ? 0 : k + 1)];
      if (const auto other = open.find({v, u}); other != open.end()) {
        polyhedron->edges.push_back({.a = v, .b = u, .left = other->second, .right = f});
        open.erase(other);
      } else if (!open.try_emplace({u, v}, f).second) {
        return false;
      }
    }
  }
  // A closed surface satisfies Euler's formula.
  return open.empty() && polyhedron->vertices.size() + polyhedron->faces.size() == polyhedron->edges.size() + 2;
}

}  // namespace tessera::physics
