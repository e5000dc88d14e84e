// A convex shape against a mesh or a height field: triangle by triangle, with flat parts taken at once.
#include <algorithm>
#include <cmath>

#include "core/physics/collide/triangle_merge.h"
#include "core/physics/collide/triangle_pair.h"

namespace tessera::physics {
namespace {

// Triangles whose planes are closer than this, m and as the length between their normals, lie in one plane.
constexpr float kSamePlane_m = 1e-5f, kSamePlane = 1e-5f;
// Triangles that a search looks at. More: the first are kept.
constexpr std::size_t kMostTriangles = 4096;

// Keeps its memory from search to search, so that a search allocates nothing.
struct MeshScratch {
  std::vector<std::uint32_t> triangles;
  std::vector<TrianglePlace> places;
  std::vector<std::uint8_t> done;  // by place
  std::vector<TriangleManifold> contacts;
  TriangleMerger merger;
};

MeshScratch& MeshScratchOfThread() {
  static thread_local MeshScratch scratch;
  return scratch;
}

// Bounds of a in the surface's frame, wider by the distance that is searched and by rounding.
Aabb BoundsIn(const Geometry& a, const LocalPose& surface_in_a, float within_m) {
  const Bounds local = BoundsOf(a, Transposed(surface_in_a.rotation));
  const double margin = static_cast<double>(within_m) + 1e-5 * static_cast<double>(a.outer_radius_m);
  const Vec3d wide{margin, margin, margin};
  return {surface_in_a.a_in_b + Vec3d(local.min) - wide, surface_in_a.a_in_b + Vec3d(local.max) + wide};
}

bool ReachesInto(const Aabb& bounds, const std::array<Vec3d, 3>& c) {
  const auto apart = [](double a, double b, double d, double min, double max) {
    return (a < min && b < min && d < min) || (a > max && b > max && d > max);
  };
  return !apart(c[0].x, c[1].x, c[2].x, bounds.min.x, bounds.max.x) &&
         !apart(c[0].y, c[1].y, c[2].y, bounds.min.y, bounds.max.y) &&
         !apart(c[0].z, c[1].z, c[2].z, bounds.min.z, bounds.max.z);
}

// Fills `places` with the triangles that reach into the bounds of a, widened by `within_m`, in ascending order.
void FindTriangles(const Geometry& a, const Surface& surface, const LocalPose& surface_in_a, float within_m,
                   MeshScratch* s) {
  s->triangles.clear();
  s->places.clear();
  s->contacts.clear();
  const Aabb bounds = BoundsIn(a, surface_in_a, within_m);
  surface.TrianglesIn(bounds, &s->triangles);
  if (!surface.is_field()) std::sort(s->triangles.begin(), s->triangles.end());
  for (const std::uint32_t index : s->triangles) {
    if (!ReachesInto(bounds, surface.Corners(index))) continue;
    if (s->places.size() == kMostTriangles) return;
    const TrianglePlace place(surface, surface_in_a, index);
    if (place.normal != Vec3f{}) s->places.push_back(place);
  }
}

// Names a manifold from step to step. Across a face the name is the direction in the surface's own axes, which stays
// while a body slides from triangle to triangle; at an edge or corner, where directions follow the body, the triangle.
std::uint32_t KeyOf(Vec3f normal, const TrianglePlace& place) {
  if (std::abs(Dot(normal, place.normal)) < kSameWay) return 0x80000000u | place.index;
  const Vec3f n = Into(place.pose.rotation, normal);
  const auto part = [](float v) { return static_cast<std::uint32_t>(std::lround(v * 64)) & 0xffu; };
  return part(n.x) << 16 | part(n.y) << 8 | part(n.z);
}

bool IsOver(const TrianglePlace& place, Vec3f p) {
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3f a = place.corners[i], along = place.corners[(i + 1) % 3] - a;
    if (Dot(Cross(along, p - a), place.normal) < -1e-6f * LengthSquared(along)) return false;
  }
  return true;
}

bool InOnePlane(const TrianglePlace& place, const TrianglePlace& other) {
  return LengthSquared(other.normal - place.normal) <= kSamePlane * kSamePlane &&
         std::abs(Dot(place.normal, other.corners[0] - place.corners[0])) <= kSamePlane_m;
}

// Where every corner of the face of a stands on a triangle in the plane of place `first`, the triangles of that plane
// together make one contact and count as done. False, and nothing is done, where some corner stands on none of them.
bool TouchFlatPart(const Geometry& a, std::size_t first, float speculative_m, MeshScratch* s) {
  const TrianglePlace& plane = s->places[first];
  const Vec3f normal = plane.normal, origin = plane.corners[0];
  if (Dot(normal, a.middle - origin) < 0) return false;
  const SupportFace face = SupportFaceOf(AtOrigin(a), -normal);
  std::array<LocalPoint, kSupportVertices> points;
  std::uint32_t missing = 0;  // a bit for each corner that no triangle is known to carry
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(face.count); ++i) {
    const Vec3f p = face.vertices[i];
    const float height = Dot(normal, p - origin);
    if (height > speculative_m) continue;
    missing |= 1u << count;
    points[count++] = {p, p - normal * height, height, (face.id << 8) + i};
  }
  if (count == 0) return false;
  for (std::size_t i = first; i < s->places.size() && missing != 0; ++i) {
    if (s->done[i] != 0 || !InOnePlane(plane, s->places[i])) continue;
    for (std::size_t k = 0; k < count; ++k) {
      if ((missing >> k & 1u) != 0 && IsOver(s->places[i], points[k].on_a)) missing &= ~(1u << k);
    }
  }
  if (missing != 0) return false;
  for (std::size_t i = first; i < s->places.size(); ++i) {
    if (s->done[i] == 0 && InOnePlane(plane, s->places[i])) s->done[i] = 1;
  }
  TriangleManifold contact{{}, TriangleContact::kFront, KeyOf(-normal, plane)};
  contact.manifold.normal = -normal;
  Reduce({points.data(), count}, -normal, &contact.manifold);
  s->contacts.push_back(contact);
  return true;
}

void TouchTriangles(const Geometry& a, float speculative_m, bool was_in_front, MeshScratch* s) {
  s->done.assign(s->places.size(), 0);
  const Convex shape = AtOrigin(a);
  for (std::size_t i = 0; i < s->places.size(); ++i) {
    if (s->done[i] != 0) continue;
    const TrianglePlace& place = s->places[i];
    const double low = -ReachOf(shape, -place.normal) - Dot(Vec3d(place.normal), Vec3d(place.corners[0]));
    if (low > static_cast<double>(speculative_m)) continue;
    if (a.kind != GeometryKind::kSphere && TouchFlatPart(a, i, speculative_m, s)) continue;
    TriangleManifold touched;
    touched.contact = CollideTriangle(a, place, speculative_m, was_in_front, &touched.manifold);
    if (touched.contact == TriangleContact::kNone) continue;
    for (LocalPoint& p : touched.manifold.points) p.feature ^= (place.index + 1) * 0x9e3779b1u;
    touched.key = KeyOf(touched.manifold.normal, place);
    s->contacts.push_back(touched);
  }
}

// The one thing that a pair with a mesh remembers: the body was in front of what it touched last.
constexpr std::uint32_t kInFront = 1;

constexpr std::uint32_t kRetrieved = 0x40000000;  // the key of a manifold that takes a body back to the front

// Takes the shallowest way back.
void RetrieveFrom(const Geometry& a, MeshScratch* s) {
  for (const TrianglePlace& place : s->places) {
    TriangleManifold retrieved{{}, TriangleContact::kDeep, kRetrieved};
    if (!Retrieve(a, place, &retrieved.manifold)) continue;
    if (s->contacts.empty()) {
      s->contacts.push_back(retrieved);
    } else if (DeepestOf(retrieved.manifold) > DeepestOf(s->contacts[0].manifold)) {
      s->contacts[0] = retrieved;
    }
  }
}

}  // namespace

void CollideMesh(const Geometry& a, const Geometry& mesh, const LocalPose& mesh_in_a, float speculative_m,
                 PartCaches& parts, std::vector<LocalManifold>* out) {
  MeshScratch& scratch = MeshScratchOfThread();
  FindTriangles(a, *mesh.surface, mesh_in_a, speculative_m, &scratch);
  const bool was_in_front = !parts.empty() && parts[0].cache.feature == kInFront;
  TouchTriangles(a, speculative_m, was_in_front, &scratch);
  if (scratch.contacts.empty() && was_in_front) {
    FindTriangles(a, *mesh.surface, mesh_in_a, 2 * a.outer_radius_m, &scratch);
    RetrieveFrom(a, &scratch);
  }
  const bool front = std::any_of(scratch.contacts.begin(), scratch.contacts.end(),
                                 [](const TriangleManifold& c) { return c.contact != TriangleContact::kBack; });
  parts.assign(1, {0, {.axis = {}, .feature = front ? kInFront : 0, .apart_m = 0}});
  scratch.merger.Merge(scratch.contacts, out);
}

void CollideHeightField(const Geometry& a, const Geometry& field, const LocalPose& field_in_a, float speculative_m,
                        PartCaches&, std::vector<LocalManifold>* out) {
  MeshScratch& scratch = MeshScratchOfThread();
  FindTriangles(a, *field.surface, field_in_a, speculative_m, &scratch);
  TouchTriangles(a, speculative_m, true, &scratch);
  scratch.merger.Merge(scratch.contacts, out);
}

}  // namespace tessera::physics
