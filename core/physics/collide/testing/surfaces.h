// Surfaces for the tests of this folder, and bodies put on them.
#pragma once

#include <memory>
#include <vector>

#include "core/physics/collide/surface.h"
#include "core/physics/collide/testing/shapes.h"

namespace tessera::physics {

using LocalManifolds = std::vector<LocalManifold>;

// `body` at a place over a surface that lies at the origin.
inline LocalManifolds On(const Geometry& body, const Geometry& surface, const Pose& body_pose,
                         float speculative_m = 0.02f) {
  const Quatd back = Conjugate(body_pose.orientation);
  const LocalPose pose{Vec3f(Rotate(back, -body_pose.position)), RotationOf(back), body_pose.position};
  PartCaches parts;
  LocalManifolds found;
  if (body.kind == GeometryKind::kCompound) {
    CollideCompound(body, surface, pose, speculative_m, parts, &found);
  } else if (surface.kind == GeometryKind::kMesh) {
    CollideMesh(body, surface, pose, speculative_m, parts, &found);
  } else {
    CollideHeightField(body, surface, pose, speculative_m, parts, &found);
  }
  // Into the surface's axes, for the tests to read.
  for (LocalManifold& m : found) {
    m.normal = Vec3f(Rotate(body_pose.orientation, Vec3d(m.normal)));
    for (LocalPoint& p : m.points) {
      p.on_a = Vec3f(body_pose.position + Rotate(body_pose.orientation, Vec3d(p.on_a)));
      p.on_b = Vec3f(body_pose.position + Rotate(body_pose.orientation, Vec3d(p.on_b)));
    }
  }
  return found;
}

// A grid of cells of one metre with its corner at -half, -half.
template <class Height>
std::shared_ptr<const Geometry> Grid(int cells, Height height, Vec3f offset = {}, float spacing = 1) {
  TriangleMeshShape mesh;
  const auto across = static_cast<std::uint32_t>(cells) + 1;
  for (std::uint32_t i = 0; i < across * across; ++i) {
    const float x = spacing * (static_cast<float>(i % across) - static_cast<float>(cells) / 2);
    const float z = spacing * (static_cast<float>(i / across) - static_cast<float>(cells) / 2);
    mesh.vertices.push_back(Vec3f{x, height(x, z), z} + offset);
  }
  for (std::uint32_t z = 0; z + 1 < across; ++z) {
    for (std::uint32_t x = 0; x + 1 < across; ++x) {
      const std::uint32_t a = z * across + x, below = a + across;
      mesh.triangles.push_back({a, below, a + 1});
      mesh.triangles.push_back({a + 1, below, below + 1});
    }
  }
  return GeometryOf(mesh);
}

template <class Height>
std::shared_ptr<const Geometry> Field(std::uint32_t samples, double spacing, Height height) {
  HeightFieldShape field{.columns = samples, .rows = samples, .spacing_m = spacing, .heights_m = {}};
  for (std::uint32_t z = 0; z < samples; ++z) {
    for (std::uint32_t x = 0; x < samples; ++x) {
      const double half = (samples - 1) / 2.0;
      field.heights_m.push_back(
          height(static_cast<float>((x - half) * spacing), static_cast<float>((z - half) * spacing)));
    }
  }
  return GeometryOf(field);
}

inline float Flat(float, float) { return 0; }

inline std::shared_ptr<const Geometry> Quad() {
  TriangleMeshShape mesh;
  mesh.vertices = {{-5, 0, -5}, {5, 0, -5}, {5, 0, 5}, {-5, 0, 5}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  return GeometryOf(mesh);
}

// The same with every triangle's vertices its own.
inline std::shared_ptr<const Geometry> UnweldedQuad() {
  TriangleMeshShape mesh;
  mesh.vertices = {{-5, 0, -5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, {-5, 0, 5}, {5, 0, 5}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  return GeometryOf(mesh);
}

inline std::vector<std::shared_ptr<const Geometry>> FlatGrounds() {
  return {Quad(), UnweldedQuad(), Grid(20, Flat), Field(21, 1, Flat), Grid(60, Flat, {}, 0.13f)};
}

}  // namespace tessera::physics
