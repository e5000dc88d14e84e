// Slow truths for the tests of this folder: polyhedra by trying everything, in doubles.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/physics/collide/pair_functions.h"

namespace tessera::physics {

// A polyhedron placed in some frame.
struct Solid {
  const Polyhedron* shape;
  Vec3d position;
  Mat3f rotation;

  Vec3d Turned(Vec3f v) const { return Vec3d(rotation.x) * v.x + Vec3d(rotation.y) * v.y + Vec3d(rotation.z) * v.z; }
  Vec3d Vertex(std::uint32_t i) const { return position + Turned(shape->vertices[i]); }
  // Reach of the solid along a direction.
  double Most(Vec3d direction) const {
    double most = -std::numeric_limits<double>::max();
    for (std::uint32_t i = 0; i < shape->vertices.size(); ++i) most = std::max(most, Dot(direction, Vertex(i)));
    return most;
  }
};

inline Solid SolidOf(const Geometry& g) { return {g.polyhedron.get(), {}, {}}; }
inline Solid SolidOf(const Geometry& g, const LocalPose& pose) {
  return {g.polyhedron.get(), Vec3d(pose.position), pose.rotation};
}

inline double Gap(const Solid& a, const Solid& b, Vec3d direction) { return -b.Most(-direction) - a.Most(direction); }

// Along the axis that has them furthest apart: negative, their depth.
inline double LargestGap(const Solid& a, const Solid& b) {
  double best = -std::numeric_limits<double>::max();
  for (const Polyhedron::Face& face : a.shape->faces) best = std::max(best, Gap(a, b, a.Turned(face.normal)));
  for (const Polyhedron::Face& face : b.shape->faces) best = std::max(best, Gap(a, b, -b.Turned(face.normal)));
  for (const Polyhedron::Edge& e : a.shape->edges)
    for (const Polyhedron::Edge& f : b.shape->edges) {
      const Vec3d u = a.Vertex(e.b) - a.Vertex(e.a), v = b.Vertex(f.b) - b.Vertex(f.a), cross = Cross(u, v);
      if (Length(cross) < 1e-6 * Length(u) * Length(v)) continue;
      const Vec3d axis = Normalized(cross);
      best = std::max({best, Gap(a, b, axis), Gap(a, b, -axis)});
    }
  return best;
}

inline double DistanceToSegment(Vec3d p, Vec3d a, Vec3d b) {
  const Vec3d along = b - a;
  const double square = LengthSquared(along);
  const double t = square > 0 ? std::clamp(Dot(p - a, along) / square, 0.0, 1.0) : 0;
  return Length(p - a - along * t);
}

inline double DistanceOfSegments(Vec3d a, Vec3d b, Vec3d c, Vec3d d) {
  const Vec3d u = b - a, v = d - c, w = a - c;
  double best = std::min(
      {DistanceToSegment(a, c, d), DistanceToSegment(b, c, d), DistanceToSegment(c, a, b), DistanceToSegment(d, a, b)});
  const double uu = Dot(u, u), vv = Dot(v, v), uv = Dot(u, v), square = uu * vv - uv * uv;
  if (square > 1e-12 * uu * vv) {
    const double s = (uv * Dot(v, w) - vv * Dot(u, w)) / square, t = (uu * Dot(v, w) - uv * Dot(u, w)) / square;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) best = std::min(best, Length(w + u * s - v * t));
  }
  return best;
}

// From a point outside.
inline double DistanceToSurface(Vec3d p, const Solid& solid) {
  double best = std::numeric_limits<double>::max();
  for (const Polyhedron::Face& face : solid.shape->faces) {
    const Vec3d normal = solid.Turned(face.normal);
    bool over = true;
    for (std::uint32_t k = 0; k < face.count; ++k) {
      const Vec3d u = solid.Vertex(solid.shape->loops[face.first + k]);
      const Vec3d v = solid.Vertex(solid.shape->loops[face.first + (k + 1) % face.count]);
      best = std::min(best, DistanceToSegment(p, u, v));
      over = over && Dot(Cross(normal, v - u), p - u) >= 0;
    }
    if (over) {
      best = std::min(best, std::abs(Dot(normal, p - solid.Vertex(solid.shape->loops[face.first]))));
    }
  }
  return best;
}

// Distance of two solids that do not overlap: from a corner to a face, or from an edge to an edge.
inline double DistanceOf(const Solid& a, const Solid& b) {
  double best = std::numeric_limits<double>::max();
  for (std::uint32_t i = 0; i < a.shape->vertices.size(); ++i) best = std::min(best, DistanceToSurface(a.Vertex(i), b));
  for (std::uint32_t i = 0; i < b.shape->vertices.size(); ++i) best = std::min(best, DistanceToSurface(b.Vertex(i), a));
  for (const Polyhedron::Edge& e : a.shape->edges)
    for (const Polyhedron::Edge& f : b.shape->edges)
      best = std::min(best, DistanceOfSegments(a.Vertex(e.a), a.Vertex(e.b), b.Vertex(f.a), b.Vertex(f.b)));
  return best;
}

}  // namespace tessera::physics
