#include "core/physics/collide/surface.h"

#include <algorithm>
#include <limits>

namespace tessera::physics {
namespace {

constexpr float kUnbounded = std::numeric_limits<float>::max();

Bounds BoundsOfMesh(const MeshTopology& mesh) {
  Bounds bounds{{kUnbounded, kUnbounded, kUnbounded}, {-kUnbounded, -kUnbounded, -kUnbounded}};
  for (const MeshTriangle& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle.corners) bounds.Include(mesh.vertices[corner]);
  }
  return bounds;
}

Bounds BoundsOfField(const HeightFieldShape& field, const BodyFrame& frame) {
  const auto [low, high] = std::minmax_element(field.heights_m.begin(), field.heights_m.end());
  const auto half = [&](std::uint32_t samples) {
    return static_cast<float>(samples - 1) * static_cast<float>(field.spacing_m) * 0.5f;
  };
  const float x = half(field.columns), z = half(field.rows);
  return {{-x, static_cast<float>(*low - frame.origin.y), -z}, {x, static_cast<float>(*high - frame.origin.y), z}};
}

}  // namespace

Surface::Surface(const TriangleMeshShape& mesh)
    : mesh_(TopologyOf(mesh)), tree_(std::make_unique<TriangleTree>(mesh)), bounds_(BoundsOfMesh(mesh_)) {
  MarkSharpCorners(mesh_.vertices.size(), static_cast<std::uint32_t>(mesh_.triangles.size()));
}

Surface::Surface(const HeightFieldShape& field, const BodyFrame& frame)
    : grid_(field, -frame.origin.y), bounds_(BoundsOfField(field, frame)) {
  MarkSharpCorners(field.heights_m.size(), grid_.triangle_count());
}

void Surface::MarkSharpCorners(std::size_t vertices, std::uint32_t triangles) {
  sharp_.assign(vertices, 0);
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const std::array<Vec3d, 3> corners = Corners(i);
    const std::array<std::size_t, 3> own = VerticesOf(i);
    const Vec3d normal(Normal(i));
    for (std::size_t edge = 0; edge < 3; ++edge) {
      const std::size_t next = (edge + 1) % 3;
      Vec3d other;
      bool sharp = true;
      if (Opposite(i, edge, &other)) {
        const Vec3d to = other - corners[edge], beyond = Cross(to, corners[next] - corners[edge]);
        sharp = Dot(to, normal) < 0 && Dot(beyond, normal) < static_cast<double>(kSharp) * Length(beyond);
      }
      if (sharp) sharp_[own[edge]] = sharp_[own[next]] = 1;
    }
  }
}

void Surface::TrianglesIn(const Aabb& box, std::vector<std::uint32_t>* found, std::size_t most) const {
  // Bullet's tree and the corners for sweeps are in single precision.
  const Aabb wide = box.Expanded(1e-6 * (1 + Length(box.min) + Length(box.max)));
  if (is_field()) {
    grid_.TrianglesIn(wide, found, most);
  } else {
    tree_->TrianglesIn(wide, found, most);
  }
}

double Surface::PieceLength() const {
  // A field's boxes hold a few cells each; a mesh's triangles are of any size, so its boxes are a small share of it.
  constexpr double kCells = 4, kShare = 1.0 / 64, kLeast_m = 1e-3;
  const double length = is_field() ? kCells * field().spacing_m : kShare * Length(Vec3d(bounds_.max - bounds_.min));
  return std::max(length, kLeast_m);
}

std::array<std::size_t, 3> Surface::VerticesOf(std::uint32_t triangle) const {
  if (is_field()) return grid_.VerticesOf(triangle);
  const auto& c = mesh_.triangles[triangle].corners;
  return {c[0], c[1], c[2]};
}

std::array<Vec3d, 3> Surface::Corners(std::uint32_t triangle) const {
  if (is_field()) return grid_.Corners(triangle);
  const auto& c = mesh_.triangles[triangle].corners;
  return {Vec3d(mesh_.vertices[c[0]]), Vec3d(mesh_.vertices[c[1]]), Vec3d(mesh_.vertices[c[2]])};
}

std::array<Vec3f, 3> Surface::RoundedCorners(std::uint32_t triangle) const {
  if (is_field()) return grid_.RoundedCorners(triangle);
  const auto& c = mesh_.triangles[triangle].corners;
  return {mesh_.vertices[c[0]], mesh_.vertices[c[1]], mesh_.vertices[c[2]]};
}

Vec3f Surface::Normal(std::uint32_t triangle) const {
  if (!is_field()) return mesh_.triangles[triangle].normal;
  const auto [a, b, c] = grid_.Corners(triangle);
  return Vec3f(Normalized(Cross(b - a, c - a)));
}

bool Surface::IsSharp(std::uint32_t triangle) const {
  const auto [a, b, c] = VerticesOf(triangle);
  return (sharp_[a] | sharp_[b] | sharp_[c]) != 0;
}

bool Surface::IsSolid(std::uint32_t triangle) const { return is_field() || mesh_.triangles[triangle].solid; }

bool Surface::Opposite(std::uint32_t triangle, std::size_t edge, Vec3d* corner) const {
  if (is_field()) return grid_.Opposite(triangle, edge, corner);
  const std::uint32_t vertex = mesh_.triangles[triangle].opposite[edge];
  if (vertex == MeshTriangle::kNone) return false;
  *corner = Vec3d(mesh_.vertices[vertex]);
  return true;
}

std::size_t Surface::Ring(std::uint32_t triangle, std::size_t corner, std::span<Vec3d, kRing> vertices) const {
  if (is_field()) return grid_.Ring(triangle, corner, vertices);
  const std::uint32_t vertex = mesh_.triangles[triangle].corners[corner];
  const std::uint32_t begin = mesh_.ring_begin[vertex];
  const std::size_t count = std::min<std::size_t>(mesh_.ring_begin[vertex + 1] - begin, kRing);
  for (std::size_t i = 0; i < count; ++i) vertices[i] = Vec3d(mesh_.vertices[mesh_.ring[begin + i]]);
  return count;
}

}  // namespace tessera::physics
