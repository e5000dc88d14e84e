// The hull of points: triangles grown point by point (the beneath-beyond method), then merged to faces.
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>

#include "core/physics/collide/polyhedron.h"
#include "core/world/limits.h"

namespace tessera::physics {
namespace {

// All as shares of the hull's extent in their direction, so that a needle's or a sheet's sides are told apart too.
// Triangles in one plane to this are one face.
constexpr double kFlat = 2e-5;
// A point this little above a face is on it: somewhat more than floats round.
constexpr double kRounding = 1e-6;
// No point may be further outside than this, unless rounding is larger.
constexpr double kFit = 1e-4;

using Index = std::uint32_t;

struct Triangle {
  std::array<Index, 3> v{};
  Vec3d normal;  // unit, outward
  double offset = 0;
  bool alive = true;
};

class Builder {
 public:
  // What is above a plane by no more than `rounding` is on it.
  Builder(std::span<const Vec3f> points, double rounding) : rounding_(rounding) {
    for (const Vec3f& p : points) given_.push_back(Vec3d(p));
    outside_.resize(points.size());
    if (!Start()) return;
    // The furthest first: so there are few thin triangles, whose normals are rounding.
    for (Index next = Furthest(); outside_[next].height > rounding_; next = Furthest()) Add(next);
    std::erase_if(triangles_, [](const Triangle& t) { return !t.alive; });
  }

  std::shared_ptr<const Polyhedron> Finish();

 private:
  Triangle Of(Index a, Index b, Index c) const {
    Triangle t{.v = {a, b, c}, .normal = {}, .offset = 0, .alive = true};
    t.normal = Normalized(Cross(points_[b] - points_[a], points_[c] - points_[a]));
    t.offset = Dot(t.normal, points_[a]);
    return t;
  }

  // Four points that span the most: two furthest apart, the furthest from their line, from their plane. In coordinates
  // along their edges, which change no hull, they are the corners of the unit simplex.
  bool Start() {
    const auto furthest = [&](auto&& measure) {
      Index best = 0;
      for (Index i = 1; i < given_.size(); ++i)
        if (measure(given_[i]) > measure(given_[best])) best = i;
      return best;
    };
    std::array<Index, 4> f{};
    f[0] = furthest([&](Vec3d p) { return LengthSquared(p - given_[0]); });
    const Vec3d origin = given_[f[0]];
    f[1] = furthest([&](Vec3d p) { return LengthSquared(p - origin); });
    const Vec3d line = Normalized(given_[f[1]] - origin);
    f[2] = furthest([&](Vec3d p) { return LengthSquared(Cross(line, p - origin)); });
    const Vec3d plane = Normalized(Cross(line, given_[f[2]] - origin));
    f[3] = furthest([&](Vec3d p) { return std::abs(Dot(plane, p - origin)); });
    if (Dot(plane, given_[f[3]] - origin) < 0) std::swap(f[1], f[2]);
    const Vec3d u = given_[f[1]] - origin, v = given_[f[2]] - origin, w = given_[f[3]] - origin;
    const double volume = Dot(u, Cross(v, w));
    if (!(volume > 0)) return false;
    for (const Vec3d& p : given_) {
      const Vec3d q = p - origin;
      points_.push_back(Vec3d{Dot(q, Cross(v, w)), Dot(q, Cross(w, u)), Dot(q, Cross(u, v))} / volume);
    }
    triangles_ = {Of(f[0], f[2], f[1]), Of(f[0], f[1], f[3]), Of(f[1], f[2], f[3]), Of(f[2], f[0], f[3])};
    for (Index i = 0; i < points_.size(); ++i) Place(i);
    return true;
  }

  double HeightOver(const Triangle& t, Index point) const { return Dot(t.normal, points_[point]) - t.offset; }

  // Finds the triangle that a point is furthest above.
  void Place(Index point) {
    Outside& place = outside_[point];
    place = {};
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      const double height = triangles_[i].alive ? HeightOver(triangles_[i], point) : 0;
      if (height > place.height) place = {i, height};
    }
  }

  Index Furthest() const {
    const auto lower = [](const Outside& x, const Outside& y) { return x.height < y.height; };
    return static_cast<Index>(std::max_element(outside_.begin(), outside_.end(), lower) - outside_.begin());
  }

  // Takes away what the point sees and closes the hole with triangles to it.
  void Add(Index point) {
    std::map<std::pair<Index, Index>, bool> seen;  // directed edges of what goes
    for (Triangle& t : triangles_) {
      if (!t.alive || HeightOver(t, point) <= rounding_) continue;
      t.alive = false;
      for (std::size_t k = 0; k < 3; ++k) seen[{t.v[k], t.v[(k + 1) % 3]}] = true;
    }
    for (const auto& [edge, unused] : seen)
      if (!seen.contains({edge.second, edge.first})) triangles_.push_back(Of(edge.first, edge.second, point));
    outside_[point] = {};
    for (Index i = 0; i < points_.size(); ++i)
      if (outside_[i].height > rounding_ && !triangles_[outside_[i].triangle].alive) Place(i);
  }

  // Groups of triangles that lie in the plane of the largest of them and hang together.
  void Merge();
  // The border of a group, counter-clockwise; nothing where it is no simple loop.
  std::vector<Index> BorderOf(int group) const;
  bool Holds(const std::vector<Index>& loop) const;

  struct Outside {
    std::size_t triangle = 0;
    double height = 0;
  };

  double rounding_;
  std::vector<Vec3d> given_, points_;  // in metres, and along the edges of the first simplex
  std::vector<Outside> outside_;       // of each point
  std::vector<Triangle> triangles_;
  std::vector<int> group_;
  int groups_ = 0;
};

void Builder::Merge() {
  const std::size_t n = triangles_.size();
  std::map<std::pair<Index, Index>, std::size_t> owner;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < 3; ++k) owner[{triangles_[i].v[k], triangles_[i].v[(k + 1) % 3]}] = i;
  const auto area = [&](const Triangle& t) {
    return LengthSquared(Cross(points_[t.v[1]] - points_[t.v[0]], points_[t.v[2]] - points_[t.v[0]]));
  };
  std::vector<std::size_t> order(n);
  for (std::size_t i = 0; i < n; ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return area(triangles_[i]) > area(triangles_[j]); });
  group_.assign(n, -1);
  for (const std::size_t seed : order) {
    if (group_[seed] >= 0) continue;
    const Triangle& plane = triangles_[seed];
    group_[seed] = groups_;
    std::vector<std::size_t> open{seed};
    while (!open.empty()) {
      const Triangle t = triangles_[open.back()];
      open.pop_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const auto next = owner.find({t.v[(k + 1) % 3], t.v[k]});
        if (next == owner.end() || group_[next->second] >= 0) continue;
        const Triangle& other = triangles_[next->second];
        const bool flat = std::all_of(other.v.begin(), other.v.end(), [&](Index v) {
          return std::abs(Dot(plane.normal, points_[v]) - plane.offset) <= std::max(kFlat, rounding_);
        });
        // A thin sliver's own normal is rounding; one that faces away is another side of a thin hull.
        if (!flat || Dot(plane.normal, other.normal) < 0.5) continue;
        group_[next->second] = groups_;
        open.push_back(next->second);
      }
    }
    ++groups_;
  }
}

std::vector<Index> Builder::BorderOf(int group) const {
  std::map<Index, Index> next;
  std::size_t edges = 0;
  std::map<std::pair<Index, Index>, bool> inside;
  for (std::size_t i = 0; i < triangles_.size(); ++i)
    for (std::size_t k = 0; k < 3 && group_[i] == group; ++k)
      inside[{triangles_[i].v[k], triangles_[i].v[(k + 1) % 3]}] = true;
  for (const auto& [edge, unused] : inside) {
    if (inside.contains({edge.second, edge.first})) continue;
    next[edge.first] = edge.second;
    ++edges;
  }
  if (next.size() != edges) return {};
  std::vector<Index> loop;
  for (Index v = next.begin()->first; loop.size() < edges; v = next.at(v)) {
    if (!loop.empty() && v == loop.front()) return {};
    loop.push_back(v);
  }
  return loop;
}

// Newell's normal of a loop, and how far out it reaches.
std::pair<Vec3d, double> PlaneOf(const std::vector<Vec3d>& points, const std::vector<Index>& loop) {
  Vec3d sum;
  for (std::size_t k = 0; k < loop.size(); ++k)
    sum += Cross(points[loop[k]] - points[loop[0]], points[loop[(k + 1) % loop.size()]] - points[loop[0]]);
  const Vec3d normal = Normalized(sum);
  double offset = Dot(normal, points[loop[0]]);
  for (const Index v : loop) offset = std::max(offset, Dot(normal, points[v]));
  return {normal, offset};
}

// Whether all points lie below the face.
bool Builder::Holds(const std::vector<Index>& loop) const {
  const std::pair<Vec3d, double> plane = PlaneOf(points_, loop);
  const double highest = plane.second + std::max(kFit, 2 * rounding_);
  return std::all_of(points_.begin(), points_.end(), [&](Vec3d p) { return Dot(plane.first, p) <= highest; });
}

std::shared_ptr<const Polyhedron> Builder::Finish() {
  if (triangles_.empty()) return nullptr;
  Merge();
  std::vector<std::vector<Index>> loops;
  for (int group = 0; group < groups_; ++group) {
    std::vector<Index> loop = BorderOf(group);
    if (!loop.empty()) {
      loops.push_back(std::move(loop));
      continue;
    }
    for (std::size_t i = 0; i < triangles_.size(); ++i)
      if (group_[i] == group) loops.emplace_back(triangles_[i].v.begin(), triangles_[i].v.end());
  }
  // A vertex of only two faces lies within an edge.
  std::vector<int> faces_of(points_.size(), 0);
  for (const auto& loop : loops)
    for (const Index v : loop) ++faces_of[v];
  auto result = std::make_shared<Polyhedron>();
  std::vector<Index> number(points_.size(), 0);
  Vec3d middle;
  for (Index v = 0; v < points_.size(); ++v) {
    if (faces_of[v] < 3) continue;
    number[v] = static_cast<Index>(result->vertices.size());
    result->vertices.push_back(Vec3f(given_[v]));
    middle += given_[v];
  }
  result->inside = Vec3f(middle / static_cast<double>(result->vertices.size()));
  for (auto& loop : loops) {
    std::erase_if(loop, [&](Index v) { return faces_of[v] < 3; });
    if (loop.size() < 3 || !Holds(loop)) return nullptr;
    const auto [normal, offset] = PlaneOf(given_, loop);
    result->faces.push_back({.normal = Vec3f(normal),
                             .offset_m = static_cast<float>(offset),
                             .first = static_cast<Index>(result->loops.size()),
                             .count = static_cast<Index>(loop.size())});
    for (const Index v : loop) result->loops.push_back(number[v]);
  }
  return JoinFaces(result.get()) ? result : nullptr;
}

// Of points in one plane, as floats may leave a sheet that is far larger than thick: their bounds.
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

bool JoinFaces(Polyhedron* polyhedron) {
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
  // Euler's formula holds for what is closed.
  return open.empty() && polyhedron->vertices.size() + polyhedron->faces.size() == polyhedron->edges.size() + 2;
}

std::shared_ptr<const Polyhedron> HullOf(std::span<const Vec3f> points) {
  assert(points.size() >= 4);
  // Where rounding spoils it, fewer points are told apart.
  for (double rounding = kRounding; rounding < 0.2; rounding *= 10)
    if (auto hull = Builder(points, rounding).Finish()) return hull;
  return BoundsAsHull(points);
}

}  // namespace tessera::physics
