#include "core/physics/collide/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace tessera::physics {
namespace {

// A triangle whose height is a smaller share of its longest side than this has no normal worth the name.
constexpr double kSliver = 1e-6;

Vec3f NormalOf(Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d cross = Cross(b - a, c - a);
  const double longest = std::max({LengthSquared(b - a), LengthSquared(c - b), LengthSquared(a - c)});
  return Length(cross) > kSliver * longest ? Vec3f(Normalized(cross)) : Vec3f{};
}

void Weld(const TriangleMeshShape& mesh, MeshTopology* out) {
  std::vector<std::uint32_t> order(mesh.vertices.size()), welded(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto place = [&](std::uint32_t i) {
    const Vec3f& v = mesh.vertices[i];
    return std::tuple(v.x, v.y, v.z);
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return std::pair(place(a), a) < std::pair(place(b), b); });
  for (std::size_t i = 0; i < order.size(); ++i) {
    welded[order[i]] = i > 0 && place(order[i]) == place(order[i - 1]) ? welded[order[i - 1]] : order[i];
  }
  out->vertices = mesh.vertices;
  for (const auto& t : mesh.triangles) {
    MeshTriangle triangle;
    const auto& c = triangle.corners = {welded[t[0]], welded[t[1]], welded[t[2]]};
    triangle.normal = NormalOf(Vec3d(out->vertices[c[0]]), Vec3d(out->vertices[c[1]]), Vec3d(out->vertices[c[2]]));
    out->triangles.push_back(triangle);
  }
}

struct HalfEdge {
  std::uint32_t low, high;  // vertices
  std::uint32_t triangle, edge;
  bool ascending;
  auto key() const { return std::tuple(low, high, triangle, edge); }
};

// The neighbour across an edge runs along it the other way. Where more than two triangles meet, the one that continues
// straightest is the neighbour, so both sides of a sheet with two faces are smooth.
void JoinEdges(MeshTopology* out) {
  std::vector<MeshTriangle>& triangles = out->triangles;
  std::vector<HalfEdge> edges;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    if (triangles[i].normal == Vec3f{}) continue;
    for (std::uint32_t e = 0; e < 3; ++e) {
      const std::uint32_t a = triangles[i].corners[e], b = triangles[i].corners[(e + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), i, e, a < b});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) { return a.key() < b.key(); });
  const auto third = [&](const HalfEdge& h) { return triangles[h.triangle].corners[(h.edge + 2) % 3]; };
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high) ++end;
    for (std::size_t i = begin; i < end; ++i) {
      float straightest = -2;
      for (std::size_t j = begin; j < end; ++j) {
        if (edges[i].ascending == edges[j].ascending || third(edges[i]) == third(edges[j])) continue;
        const float straight = Dot(triangles[edges[i].triangle].normal, triangles[edges[j].triangle].normal);
        if (straight <= straightest) continue;
        straightest = straight;
        triangles[edges[i].triangle].opposite[edges[i].edge] = third(edges[j]);
      }
    }
  }
}

void MakeRings(MeshTopology* out) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> joined;
  for (const MeshTriangle& t : out->triangles) {
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t a = t.corners[e], b = t.corners[(e + 1) % 3];
      if (a == b) continue;
      joined.emplace_back(a, b);
      joined.emplace_back(b, a);
    }
  }
  std::sort(joined.begin(), joined.end());
  joined.erase(std::unique(joined.begin(), joined.end()), joined.end());
  out->ring_begin.assign(out->vertices.size() + 1, 0);
  for (const auto& [from, to] : joined) {
    ++out->ring_begin[from + 1];
    out->ring.push_back(to);
  }
  std::partial_sum(out->ring_begin.begin(), out->ring_begin.end(), out->ring_begin.begin());
}

// A border anywhere makes a sheet of everything that is connected to it.
void FindSheets(MeshTopology* out) {
  std::vector<std::uint32_t> leader(out->vertices.size());
  std::iota(leader.begin(), leader.end(), 0u);
  const auto leader_of = [&](std::uint32_t v) {
    while (leader[v] != v) v = leader[v] = leader[leader[v]];
    return v;
  };
  for (const MeshTriangle& t : out->triangles) {
    for (std::size_t e = 1; e < 3; ++e) leader[leader_of(t.corners[e])] = leader_of(t.corners[0]);
  }
  std::vector<bool> sheet(out->vertices.size());
  for (const MeshTriangle& t : out->triangles) {
    if (std::count(t.opposite.begin(), t.opposite.end(), MeshTriangle::kNone) > 0) {
      sheet[leader_of(t.corners[0])] = true;
    }
  }
  for (MeshTriangle& t : out->triangles) t.solid = !sheet[leader_of(t.corners[0])];
}

}  // namespace

MeshTopology TopologyOf(const TriangleMeshShape& mesh) {
  MeshTopology topology;
  Weld(mesh, &topology);
  JoinEdges(&topology);
  MakeRings(&topology);
  FindSheets(&topology);
  return topology;
}

}  // namespace tessera::physics
