#include "core/physics/collide/hull.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/physics/collide/hull_growth.h"
#include "core/world/limits.h"

namespace tessera::physics {
namespace {

// All are shares of the hull's extent in their direction.
// Triangles that lie in one plane to within this are one face.
constexpr double kFlatShare = 2e-5;
// A point this little above a face counts as on it: somewhat more than floats round.
constexpr double kRounding = 1e-6;
// No point may lie further outside than this, unless rounding is larger.
constexpr double kFit = 1e-4;

using Index = std::uint32_t;
using Loop = std::vector<Index>;
using DirectedEdge = std::pair<Index, Index>;

double AreaSquared(const GrownHull& hull, const HullTriangle& t) {
  return LengthSquared(Cross(hull.points[t.v[1]] - hull.points[t.v[0]], hull.points[t.v[2]] - hull.points[t.v[0]]));
}

// Gives each triangle the number of its face: connected triangles that lie in the plane of the largest of them.
std::vector<int> GroupByPlane(const GrownHull& hull, double rounding, int* groups) {
  const std::vector<HullTriangle>& triangles = hull.triangles;
  std::map<DirectedEdge, std::size_t> owner;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) owner[{triangles[i].v[k], triangles[i].v[(k + 1) % 3]}] = i;
  std::vector<std::size_t> order(triangles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    return AreaSquared(hull, triangles[i]) > AreaSquared(hull, triangles[j]);
  });
  std::vector<int> group(triangles.size(), -1);
  *groups = 0;
  for (const std::size_t seed : order) {
    if (group[seed] >= 0) continue;
    const HullTriangle& plane = triangles[seed];
    const auto in_plane = [&](Index v) {
      return std::abs(Dot(plane.normal, hull.points[v]) - plane.offset) <= std::max(kFlatShare, rounding);
    };
    group[seed] = *groups;
    std::vector<std::size_t> open{seed};
    while (!open.empty()) {
      const HullTriangle t = triangles[open.back()];
      open.pop_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const auto next = owner.find({t.v[(k + 1) % 3], t.v[k]});
        if (next == owner.end() || group[next->second] >= 0) continue;
        const HullTriangle& other = triangles[next->second];
        // The normal of a thin sliver is rounding; one that faces away is another side of a thin hull.
        const bool flat = std::all_of(other.v.begin(), other.v.end(), in_plane);
        if (!flat || Dot(plane.normal, other.normal) < 0.5) continue;
        group[next->second] = *groups;
        open.push_back(next->second);
      }
    }
    ++*groups;
  }
  return group;
}

// The border of a group, counter-clockwise; empty where it is no simple loop.
Loop BorderOf(const GrownHull& hull, const std::vector<int>& group, int number) {
  std::map<DirectedEdge, bool> inside;
  for (std::size_t i = 0; i < hull.triangles.size(); ++i) {
    const auto& v = hull.triangles[i].v;
    for (std::size_t k = 0; k < 3 && group[i] == number; ++k) inside[{v[k], v[(k + 1) % 3]}] = true;
  }
  std::map<Index, Index> next;
  std::size_t edges = 0;
  for (const auto& [edge, unused] : inside) {
    if (inside.contains({edge.second, edge.first})) continue;
    next[edge.first] = edge.second;
    ++edges;
  }
  if (next.size() != edges) return {};
  Loop loop;
  for (Index v = next.begin()->first; loop.size() < edges; v = next.at(v)) {
    if (!loop.empty() && v == loop.front()) return {};
    loop.push_back(v);
  }
  return loop;
}

// Newell's normal of a loop, and how far out the loop reaches along it.
std::pair<Vec3d, double> PlaneOf(const std::vector<Vec3d>& points, const Loop& loop) {
  Vec3d sum;
  for (std::size_t k = 0; k < loop.size(); ++k)
    sum += Cross(points[loop[k]] - points[loop[0]], points[loop[(k + 1) % loop.size()]] - points[loop[0]]);
  const Vec3d normal = Normalized(sum);
  double offset = Dot(normal, points[loop[0]]);
  for (const Index v : loop) offset = std::max(offset, Dot(normal, points[v]));
  return {normal, offset};
}

// Whether all points lie below the face.
bool Holds(const GrownHull& hull, const Loop& loop, double rounding) {
  const std::pair<Vec3d, double> plane = PlaneOf(hull.points, loop);
  const double highest = plane.second + std::max(kFit, 2 * rounding);
  return std::all_of(hull.points.begin(), hull.points.end(), [&](Vec3d p) { return Dot(plane.first, p) <= highest; });
}

// The loops of all faces. A group without a simple border stays in triangles.
std::vector<Loop> LoopsOf(const GrownHull& hull, double rounding) {
  int groups = 0;
  const std::vector<int> group = GroupByPlane(hull, rounding, &groups);
  std::vector<Loop> loops;
  for (int number = 0; number < groups; ++number) {
    Loop loop = BorderOf(hull, group, number);
    if (!loop.empty()) {
      loops.push_back(std::move(loop));
      continue;
    }
    for (std::size_t i = 0; i < hull.triangles.size(); ++i) {
      const auto& v = hull.triangles[i].v;
      if (group[i] == number) loops.emplace_back(v.begin(), v.end());
    }
  }
  return loops;
}

// None where rounding spoiled the hull.
std::shared_ptr<const Polyhedron> TryHull(std::span<const Vec3f> points, double rounding) {
  const GrownHull hull = GrowHull(points, rounding);
  if (hull.triangles.empty()) return nullptr;
  std::vector<Loop> loops = LoopsOf(hull, rounding);
  // A vertex of only two faces lies within an edge.
  std::vector<int> faces_of(hull.points.size(), 0);
  for (const Loop& loop : loops)
    for (const Index v : loop) ++faces_of[v];
  auto result = std::make_shared<Polyhedron>();
  std::vector<Index> number(hull.points.size(), 0);
  Vec3d middle;
  for (Index v = 0; v < hull.points.size(); ++v) {
    if (faces_of[v] < 3) continue;
    number[v] = static_cast<Index>(result->vertices.size());
    result->vertices.push_back(Vec3f(hull.given[v]));
    middle += hull.given[v];
  }
  result->inside = Vec3f(middle / static_cast<double>(result->vertices.size()));
  for (Loop& loop : loops) {
    std::erase_if(loop, [&](Index v) { return faces_of[v] < 3; });
    if (loop.size() < 3 || !Holds(hull, loop, rounding)) return nullptr;
    const auto [normal, offset] = PlaneOf(hull.given, loop);
    result->faces.push_back({.normal = Vec3f(normal),
                             .offset_m = static_cast<float>(offset),
                             .first = static_cast<Index>(result->loops.size()),
                             .count = static_cast<Index>(loop.size())});
    for (const Index v : loop) result->loops.push_back(number[v]);
  }
  return JoinFaces(result.get()) ? result : nullptr;
}

// A box about the points, at least a little thick in every direction.
std::shared_ptr<const Polyhedron> BoundsAsHull(std::span<const Vec3f> points) {
  Vec3f low = points[0], high = points[0];
  for (const Vec3f& p : points) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  constexpr float kThin = 1e-4f;
  const Vec3f middle = (low + high) * 0.5f;
  const float least = kThin * Length(high - low) + static_cast<float>(kMinExtent_m);
  Vec3f half = (high - low) * 0.5f;
  half = {std::max(half.x, least), std::max(half.y, least), std::max(half.z, least)};
  auto box = std::make_shared<Polyhedron>(*BoxOf(half));
  for (Vec3f& v : box->vertices) v += middle;
  for (Polyhedron::Face& face : box->faces) face.offset_m += Dot(face.normal, middle);
  box->inside = middle;
  return box;
}

}  // namespace

std::shared_ptr<const Polyhedron> HullOf(std::span<const Vec3f> points) {
  assert(points.size() >= 4);
  // Where rounding spoils the hull, coarser rounding keeps fewer points apart.
  for (double rounding = kRounding; rounding < 0.2; rounding *= 10)
    if (auto hull = TryHull(points, rounding)) return hull;
  return BoundsAsHull(points);
}

}  // namespace tessera::physics
