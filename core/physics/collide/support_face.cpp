#include "core/physics/collide/support_face.h"

#include <algorithm>
#include <cmath>

namespace tessera::physics {
namespace {

// Beyond this slope of a direction against a round shape's axis, sine, its side is no longer what it shows.
constexpr float kSide = 0.70710678f;
// A cap that leans less than this, sine, has no lowest point.
constexpr float kLean = 1e-4f;

constexpr int kRim = 12;
constexpr float kHalf = 0.5f, kRoot = 0.86602540f;
// Counter-clockwise seen from -y: x, z.
constexpr std::array<std::array<float, 2>, kRim> kRimPoints{{{1, 0},
                                                             {kRoot, kHalf},
                                                             {kHalf, kRoot},
                                                             {0, 1},
                                                             {-kHalf, kRoot},
                                                             {-kRoot, kHalf},
                                                             {-1, 0},
                                                             {-kRoot, -kHalf},
                                                             {-kHalf, -kRoot},
                                                             {0, -1},
                                                             {kHalf, -kRoot},
                                                             {kRoot, -kHalf}}};

// The disc of `radius` at height `y` that looks along `up` * y.
void AddDisc(const Convex& convex, Vec3f local, float radius, float y, bool up, SupportFace* face) {
  std::array<std::array<float, 2>, kRim> rim = kRimPoints;
  const float lean = std::sqrt(local.x * local.x + local.z * local.z);
  if (lean > kLean) {
    const float x = local.x / lean, z = local.z / lean;
    std::size_t nearest = 0;
    float best = -2;
    for (std::size_t i = 0; i < kRim; ++i) {
      const float along = rim[i][0] * x + rim[i][1] * z;
      if (along > best) best = along, nearest = i;
    }
    rim[nearest] = {x, z};
  }
  for (std::size_t i = 0; i < kRim; ++i) {
    const auto& p = rim[up ? kRim - 1 - i : i];
    face->Add(convex.Out({p[0] * radius, y, p[1] * radius}));
  }
  face->normal = up ? convex.rotation.y : -convex.rotation.y;
  face->id = up ? 1 : 0;
}

// Unit, across the y axis.
Vec3f Outward(Vec3f local) {
  const float across = std::sqrt(local.x * local.x + local.z * local.z);
  return across > 0 ? Vec3f{local.x / across, 0, local.z / across} : Vec3f{1, 0, 0};
}

void AddBoxFace(const Convex& convex, Vec3f local, SupportFace* face) {
  const Vec3f h = convex.geometry->half_extents_m;
  const float x = std::abs(local.x), y = std::abs(local.y), z = std::abs(local.z);
  const int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  const bool plus = (axis == 0 ? local.x : axis == 1 ? local.y : local.z) >= 0;
  const Mat3f& r = convex.rotation;
  const Vec3f axes[3] = {r.x, r.y, r.z};
  const float halves[3] = {h.x, h.y, h.z};
  const int next = (axis + 1) % 3, last = (axis + 2) % 3;
  const Vec3f out = plus ? axes[axis] : -axes[axis];
  const Vec3f middle = convex.position + out * halves[axis];
  const Vec3f u = axes[next] * halves[next], v = axes[last] * (plus ? halves[last] : -halves[last]);
  for (const Vec3f& corner : {u + v, v - u, -(u + v), u - v}) face->Add(middle + corner);
  face->normal = out;
  face->id = static_cast<std::uint32_t>(2 * axis + (plus ? 1 : 0));
}

std::size_t NearestFace(const Polyhedron& hull, Vec3f local) {
  std::size_t nearest = 0;
  float best = -2;
  for (std::size_t i = 0; i < hull.faces.size(); ++i) {
    const float along = Dot(hull.faces[i].normal, local);
    if (along > best) best = along, nearest = i;
  }
  return nearest;
}

void AddHullFace(const Convex& convex, Vec3f local, SupportFace* face) {
  const Polyhedron& hull = *convex.geometry->polyhedron;
  const std::size_t nearest = NearestFace(hull, local);
  const Polyhedron::Face& f = hull.faces[nearest];
  const std::uint32_t step = (f.count + kSupportVertices - 1) / kSupportVertices;
  for (std::uint32_t i = 0; i < f.count; i += step) face->Add(convex.Out(hull.vertices[hull.loops[f.first + i]]));
  face->normal = convex.rotation * f.normal;
  face->id = static_cast<std::uint32_t>(nearest);
}

// Normal of a cone's side where it looks most along `local`.
Vec3f ConeSide(const Geometry& cone, Vec3f local) {
  const float height = 2 * cone.half_height_m, slant = std::sqrt(height * height + cone.radius_m * cone.radius_m);
  const Vec3f out = Outward(local);
  return {out.x * height / slant, cone.radius_m / slant, out.z * height / slant};
}

void AddConeFace(const Convex& convex, Vec3f local, SupportFace* face) {
  const Geometry& cone = *convex.geometry;
  if (-local.y >= Dot(ConeSide(cone, local), local)) {
    AddDisc(convex, local, cone.radius_m, cone.base_y_m, false, face);
    return;
  }
  const Vec3f out = Outward(local);
  face->Add(convex.Out({out.x * cone.radius_m, cone.base_y_m, out.z * cone.radius_m}));
  face->Add(convex.Out({0, cone.base_y_m + 2 * cone.half_height_m, 0}));
  face->id = 2;
}

void AddTriangle(const Convex& convex, Vec3f direction, SupportFace* face) {
  const auto& [a, b, c] = convex.triangle;
  const Vec3f normal = Vec3f(Normalized(Cross(Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a))));
  const bool front = Dot(normal, direction) >= 0;
  face->normal = front ? normal : -normal;
  face->Add(a);
  face->Add(front ? b : c);
  face->Add(front ? c : b);
}

}  // namespace

SupportFace SupportFaceOf(const Convex& convex, Vec3f direction) {
  SupportFace face;
  if (convex.geometry == nullptr) {
    AddTriangle(convex, direction, &face);
    return face;
  }
  const Geometry& g = *convex.geometry;
  const Vec3f local = Into(convex.rotation, direction);
  switch (g.kind) {
    case GeometryKind::kSphere:
      face.Add(convex.position + direction * g.radius_m);
      return face;
    case GeometryKind::kCapsule: {
      const Vec3f half = convex.rotation.y * g.half_height_m, out = convex.position + direction * g.radius_m;
      if (std::abs(local.y) > kSide) {
        face.Add(local.y > 0 ? out + half : out - half);
        face.id = local.y > 0 ? 1 : 0;
      } else {
        face.Add(out - half);
        face.Add(out + half);
        face.id = 2;
      }
      return face;
    }
    case GeometryKind::kBox:
      AddBoxFace(convex, local, &face);
      return face;
    case GeometryKind::kCylinder:
      if (std::abs(local.y) > kSide) {
        AddDisc(convex, local, g.radius_m, local.y > 0 ? g.half_height_m : -g.half_height_m, local.y > 0, &face);
      } else {
        const Vec3f out = Outward(local) * g.radius_m;
        face.Add(convex.Out({out.x, -g.half_height_m, out.z}));
        face.Add(convex.Out({out.x, g.half_height_m, out.z}));
        face.id = 2;
      }
      return face;
    case GeometryKind::kCone:
      AddConeFace(convex, local, &face);
      return face;
    default:
      AddHullFace(convex, local, &face);
      return face;
  }
}

bool SurfaceNormal(const Convex& convex, Vec3f direction, Vec3f* normal) {
  if (convex.geometry == nullptr) {
    SupportFace face;
    AddTriangle(convex, direction, &face);
    *normal = face.normal;
    return true;
  }
  const Geometry& g = *convex.geometry;
  const Vec3f local = Into(convex.rotation, direction);
  switch (g.kind) {
    case GeometryKind::kSphere:
    case GeometryKind::kCapsule:
      return false;
    case GeometryKind::kCylinder:
      *normal =
          convex.rotation * (std::abs(local.y) > kSide ? Vec3f{0, local.y > 0 ? 1.0f : -1.0f, 0} : Outward(local));
      return true;
    case GeometryKind::kCone: {
      const Vec3f side = ConeSide(g, local);
      *normal = convex.rotation * (-local.y >= Dot(side, local) ? Vec3f{0, -1, 0} : side);
      return true;
    }
    case GeometryKind::kBox: {
      const float x = std::abs(local.x), y = std::abs(local.y), z = std::abs(local.z);
      const Vec3f axis = x >= y && x >= z ? convex.rotation.x : y >= z ? convex.rotation.y : convex.rotation.z;
      *normal = Dot(axis, direction) >= 0 ? axis : -axis;
      return true;
    }
    default:
      *normal = convex.rotation * g.polyhedron->faces[NearestFace(*g.polyhedron, local)].normal;
      return true;
  }
}

}  // namespace tessera::physics
