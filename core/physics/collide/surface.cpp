#include "core/physics/collide/surface.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <tuple>

namespace tessera::physics {
namespace {

// Of a triangle's height against its longest side: flatter ones have no normal worth the name.
constexpr double kSliver = 1e-6;

Vec3f NormalOf(Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d cross = Cross(b - a, c - a);
  const double longest = std::max({LengthSquared(b - a), LengthSquared(c - b), LengthSquared(a - c)});
  return Length(cross) > kSliver * longest ? Vec3f(Normalized(cross)) : Vec3f{};
}

struct HalfEdge {
  std::uint32_t low, high;  // vertices
  std::uint32_t triangle, edge;
  bool ascending;
  auto key() const { return std::tuple(low, high, triangle, edge); }
};

}  // namespace

std::shared_ptr<const Surface> Surface::Of(const TriangleMeshShape& mesh, const BodyFrame&) {
  auto surface = std::make_shared<Surface>();
  surface->Weld(mesh);
  surface->JoinEdges();
  surface->MakeRings();
  surface->FindSheets();
  surface->sharp_.assign(surface->vertices_.size(), 0);
  surface->MarkSharpCorners(static_cast<std::uint32_t>(surface->triangles_.size()));
  return surface;
}

std::shared_ptr<const Surface> Surface::Of(const HeightFieldShape& field, const BodyFrame& frame) {
  auto surface = std::make_shared<Surface>();
  surface->columns_ = field.columns;
  surface->rows_ = field.rows;
  surface->spacing_m_ = field.spacing_m;
  surface->base_y_m_ = -frame.origin.y;
  surface->heights_m_ = field.heights_m;
  surface->sharp_.assign(field.heights_m.size(), 0);
  surface->MarkSharpCorners(2 * (field.columns - 1) * (field.rows - 1));
  return surface;
}

void Surface::Weld(const TriangleMeshShape& mesh) {
  std::vector<std::uint32_t> order(mesh.vertices.size()), name(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto place = [&](std::uint32_t i) {
    const Vec3f& v = mesh.vertices[i];
    return std::tuple(v.x, v.y, v.z);
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return std::pair(place(a), a) < std::pair(place(b), b); });
  for (std::size_t i = 0; i < order.size(); ++i) {
    name[order[i]] = i > 0 && place(order[i]) == place(order[i - 1]) ? name[order[i - 1]] : order[i];
  }
  vertices_ = mesh.vertices;
  for (const auto& t : mesh.triangles) {
    Triangle triangle{{name[t[0]], name[t[1]], name[t[2]]}, {kNone, kNone, kNone}, {}, true};
    const auto& c = triangle.corners;
    triangle.normal = NormalOf(Vec3d(vertices_[c[0]]), Vec3d(vertices_[c[1]]), Vec3d(vertices_[c[2]]));
    triangles_.push_back(triangle);
  }
}

// The neighbour across an edge runs along it the other way. Where more than two triangles meet, the one that goes on
// straightest is taken: so both sides of a sheet with two faces are smooth.
void Surface::JoinEdges() {
  std::vector<HalfEdge> edges;
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    if (triangles_[i].normal == Vec3f{}) continue;
    for (std::uint32_t e = 0; e < 3; ++e) {
      const std::uint32_t a = triangles_[i].corners[e], b = triangles_[i].corners[(e + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), i, e, a < b});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) { return a.key() < b.key(); });
  const auto third = [&](const HalfEdge& h) { return triangles_[h.triangle].corners[(h.edge + 2) % 3]; };
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high) ++end;
    for (std::size_t i = begin; i < end; ++i) {
      float straightest = -2;
      for (std::size_t j = begin; j < end; ++j) {
        if (edges[i].ascending == edges[j].ascending || third(edges[i]) == third(edges[j])) continue;
        const float straight = Dot(triangles_[edges[i].triangle].normal, triangles_[edges[j].triangle].normal);
        if (straight <= straightest) continue;
        straightest = straight;
        triangles_[edges[i].triangle].opposite[edges[i].edge] = third(edges[j]);
      }
    }
  }
}

void Surface::MakeRings() {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> joined;
  for (const Triangle& t : triangles_) {
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t a = t.corners[e], b = t.corners[(e + 1) % 3];
      if (a == b) continue;
      joined.emplace_back(a, b);
      joined.emplace_back(b, a);
    }
  }
  std::sort(joined.begin(), joined.end());
  joined.erase(std::unique(joined.begin(), joined.end()), joined.end());
  ring_begin_.assign(vertices_.size() + 1, 0);
  for (const auto& [from, to] : joined) {
    ++ring_begin_[from + 1];
    ring_.push_back(to);
  }
  std::partial_sum(ring_begin_.begin(), ring_begin_.end(), ring_begin_.begin());
}

// A border anywhere makes a sheet of all that hangs together with it.
void Surface::FindSheets() {
  std::vector<std::uint32_t> leader(vertices_.size());
  std::iota(leader.begin(), leader.end(), 0u);
  const auto leader_of = [&](std::uint32_t v) {
    while (leader[v] != v) v = leader[v] = leader[leader[v]];
    return v;
  };
  for (const Triangle& t : triangles_) {
    for (std::size_t e = 1; e < 3; ++e) leader[leader_of(t.corners[e])] = leader_of(t.corners[0]);
  }
  std::vector<bool> sheet(vertices_.size());
  for (const Triangle& t : triangles_) {
    if (std::count(t.opposite.begin(), t.opposite.end(), kNone) > 0) sheet[leader_of(t.corners[0])] = true;
  }
  for (Triangle& t : triangles_) t.solid = !sheet[leader_of(t.corners[0])];
}

bool Surface::IsSolid(std::uint32_t triangle) const { return is_field() || triangles_[triangle].solid; }

Vec3f Surface::Normal(std::uint32_t triangle) const {
  if (!is_field()) return triangles_[triangle].normal;
  const auto [a, b, c] = Corners(triangle);
  return Vec3f(Normalized(Cross(b - a, c - a)));
}

std::array<std::size_t, 3> Surface::VerticesOf(std::uint32_t triangle) const {
  if (!is_field()) {
    const auto& c = triangles_[triangle].corners;
    return {c[0], c[1], c[2]};
  }
  const auto [x, z, second] = CellOf(triangle);
  const std::size_t i = static_cast<std::size_t>(z) * columns_ + x;
  if (second) return {i + 1, i + columns_, i + columns_ + 1};
  return {i, i + columns_, i + 1};
}

bool Surface::IsSharp(std::uint32_t triangle) const {
  const auto [a, b, c] = VerticesOf(triangle);
  return (sharp_[a] | sharp_[b] | sharp_[c]) != 0;
}

void Surface::MarkSharpCorners(std::uint32_t triangles) {
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const std::array<Vec3d, 3> corners = Corners(i);
    const std::array<std::size_t, 3> vertices = VerticesOf(i);
    const Vec3d normal(Normal(i));
    for (std::size_t edge = 0; edge < 3; ++edge) {
      const std::size_t next = (edge + 1) % 3;
      Vec3d other;
      bool sharp = true;
      if (Opposite(i, edge, &other)) {
        const Vec3d to = other - corners[edge], beyond = Cross(to, corners[next] - corners[edge]);
        sharp = Dot(to, normal) < 0 && Dot(beyond, normal) < static_cast<double>(kSharp) * Length(beyond);
      }
      if (sharp) sharp_[vertices[edge]] = sharp_[vertices[next]] = 1;
    }
  }
}

Surface::Cell Surface::CellOf(std::uint32_t triangle) const {
  const std::uint32_t cell = triangle / 2, across = columns_ - 1;
  return {cell % across, cell / across, triangle % 2 == 1};
}

Vec3d Surface::Sample(std::uint32_t x, std::uint32_t z) const {
  const std::size_t i = static_cast<std::size_t>(z) * columns_ + x;
  return {(x - (columns_ - 1) / 2.0) * spacing_m_, heights_m_[i] + base_y_m_, (z - (rows_ - 1) / 2.0) * spacing_m_};
}

std::array<Vec3d, 3> Surface::Corners(std::uint32_t triangle) const {
  if (!is_field()) {
    const auto& c = triangles_[triangle].corners;
    return {Vec3d(vertices_[c[0]]), Vec3d(vertices_[c[1]]), Vec3d(vertices_[c[2]])};
  }
  const auto [x, z, second] = CellOf(triangle);
  if (second) return {Sample(x + 1, z), Sample(x, z + 1), Sample(x + 1, z + 1)};
  return {Sample(x, z), Sample(x, z + 1), Sample(x + 1, z)};
}

bool Surface::Opposite(std::uint32_t triangle, std::size_t edge, Vec3d* corner) const {
  if (!is_field()) {
    const std::uint32_t vertex = triangles_[triangle].opposite[edge];
    if (vertex == kNone) return false;
    *corner = Vec3d(vertices_[vertex]);
    return true;
  }
  const auto [x, z, second] = CellOf(triangle);
  const auto sample = [&, column = x, row = z](std::int64_t dx, std::int64_t dz) {
    const std::int64_t sx = column + dx, sz = row + dz;
    if (sx < 0 || sz < 0 || sx >= columns_ || sz >= rows_) return false;
    *corner = Sample(static_cast<std::uint32_t>(sx), static_cast<std::uint32_t>(sz));
    return true;
  };
  if (second) return edge == 0 ? sample(0, 0) : edge == 1 ? sample(0, 2) : sample(2, 0);
  return edge == 0 ? sample(-1, 1) : edge == 1 ? sample(1, 1) : sample(1, -1);
}

std::size_t Surface::Ring(std::uint32_t triangle, std::size_t corner, std::span<Vec3d, kRing> vertices) const {
  std::size_t count = 0;
  if (!is_field()) {
    const std::uint32_t vertex = triangles_[triangle].corners[corner];
    for (std::uint32_t i = ring_begin_[vertex]; i < ring_begin_[vertex + 1] && count < kRing; ++i) {
      vertices[count++] = Vec3d(vertices_[ring_[i]]);
    }
    return count;
  }
  const auto [cell_x, cell_z, second] = CellOf(triangle);
  const std::uint32_t x = cell_x + (corner == 2 || (second && corner == 0) ? 1 : 0);
  const std::uint32_t z = cell_z + (corner == 1 || (second && corner == 2) ? 1 : 0);
  constexpr std::array<std::array<int, 2>, 6> kSteps{{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
  for (const auto& [dx, dz] : kSteps) {
    const std::int64_t sx = static_cast<std::int64_t>(x) + dx, sz = static_cast<std::int64_t>(z) + dz;
    if (sx < 0 || sz < 0 || sx >= columns_ || sz >= rows_) continue;
    vertices[count++] = Sample(static_cast<std::uint32_t>(sx), static_cast<std::uint32_t>(sz));
  }
  return count;
}

void Surface::FieldTriangles(Vec3d min, Vec3d max, std::vector<std::uint32_t>* found) const {
  assert(is_field());
  const auto cell = [&](double p, std::uint32_t samples) {
    const double i = std::floor(p / spacing_m_ + (samples - 1) / 2.0);
    return static_cast<std::int64_t>(std::clamp(i, -1.0, static_cast<double>(samples)));
  };
  const auto last_x = static_cast<std::int64_t>(columns_) - 2, last_z = static_cast<std::int64_t>(rows_) - 2;
  const std::int64_t x0 = std::max<std::int64_t>(cell(min.x, columns_), 0),
                     x1 = std::min(cell(max.x, columns_), last_x);
  const std::int64_t z0 = std::max<std::int64_t>(cell(min.z, rows_), 0), z1 = std::min(cell(max.z, rows_), last_z);
  for (std::int64_t z = z0; z <= z1; ++z) {
    for (std::int64_t x = x0; x <= x1; ++x) {
      const std::size_t i = static_cast<std::size_t>(z * columns_ + x);
      const auto [low, high] =
          std::minmax({heights_m_[i], heights_m_[i + 1], heights_m_[i + columns_], heights_m_[i + columns_ + 1]});
      if (static_cast<double>(low) + base_y_m_ > max.y || static_cast<double>(high) + base_y_m_ < min.y) continue;
      const auto first = static_cast<std::uint32_t>(2 * (z * (columns_ - 1) + x));
      found->push_back(first);
      found->push_back(first + 1);
    }
  }
}

}  // namespace tessera::physics
