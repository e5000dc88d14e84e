// Meshes and height fields: their triangles, one by one, against a convex shape; and the contacts of triangles that
// look the same way made one.
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/physics/bullet_math.h"
#include "core/physics/collide/triangle_pair.h"

namespace tessera::physics {
namespace {

// Normals closer than this, cosine of about a degree, share a manifold.
constexpr float kSameWay = 0.99985f;
// Points nearer than this, m, are one: triangles share edges and corners.
constexpr float kSamePoint_m = 1e-5f;
// Planes of triangles closer than this, m and as the length between their normals, are one.
constexpr float kSamePlane_m = 1e-5f, kSamePlane = 1e-5f;
// A pair's manifolds, and triangles that are looked at. More: the deepest and the first are kept.
constexpr std::size_t kMostGroups = 8, kMostTriangles = 4096;

struct Touch {
  LocalManifold manifold;
  TriangleContact contact;
  std::uint32_t key = 0;
};

// What a search needs, kept from one to the next so that it allocates nothing.
struct Scratch {
  std::vector<std::uint32_t> triangles;
  std::vector<TrianglePlace> places;
  std::vector<std::uint8_t> done;  // of places
  std::vector<Touch> touches;
  std::vector<std::uint8_t> grouped;
  std::vector<LocalPoint> points;
  std::vector<LocalManifold> groups;
};

Scratch& ScratchOfThread() {
  static thread_local Scratch scratch;
  return scratch;
}

class Collector : public btNodeOverlapCallback {
 public:
  explicit Collector(std::vector<std::uint32_t>* found) : found_(found) {}
  void processNode(int, int triangle) override { found_->push_back(static_cast<std::uint32_t>(triangle)); }

 private:
  std::vector<std::uint32_t>* found_;
};

struct Bounds {
  Vec3d min, max;
};

// Of a in the surface's frame, widened by what is searched and by rounding.
Bounds BoundsIn(const Geometry& a, const LocalPose& surface_in_a, float speculative_m) {
  const LocalBounds local = BoundsOf(a, Transposed(surface_in_a.rotation));
  const double margin = static_cast<double>(speculative_m) + 1e-5 * static_cast<double>(a.outer_radius_m);
  const Vec3d wide{margin, margin, margin};
  return {surface_in_a.a_in_b + Vec3d(local.min) - wide, surface_in_a.a_in_b + Vec3d(local.max) + wide};
}

bool Reaches(const Bounds& bounds, const std::array<Vec3d, 3>& c) {
  const auto apart = [](double a, double b, double d, double min, double max) {
    return (a < min && b < min && d < min) || (a > max && b > max && d > max);
  };
  return !apart(c[0].x, c[1].x, c[2].x, bounds.min.x, bounds.max.x) &&
         !apart(c[0].y, c[1].y, c[2].y, bounds.min.y, bounds.max.y) &&
         !apart(c[0].z, c[1].z, c[2].z, bounds.min.z, bounds.max.z);
}

void PlaceTriangles(const Surface& surface, const LocalPose& pose, const Bounds& bounds, Scratch* s) {
  s->places.clear();
  for (const std::uint32_t index : s->triangles) {
    if (!Reaches(bounds, surface.Corners(index))) continue;
    if (s->places.size() == kMostTriangles) return;
    const TrianglePlace place(surface, pose, index);
    if (place.normal != Vec3f{}) s->places.push_back(place);
  }
}

// Names a manifold from step to step: across a face by its direction in the surface's own axes, which stays while a
// body slides from triangle to triangle; at an edge or corner, where directions follow the body's, by the triangle.
std::uint32_t KeyOf(Vec3f normal, const TrianglePlace& place) {
  if (std::abs(Dot(normal, place.normal)) < kSameWay) return 0x80000000u | place.index;
  const Vec3f n = Into(place.pose.rotation, normal);
  const auto part = [](float v) { return static_cast<std::uint32_t>(std::lround(v * 64)) & 0xffu; };
  return part(n.x) << 16 | part(n.y) << 8 | part(n.z);
}

// --- Flat parts: where the corners of a face stand on triangles of one plane, the other triangles of that plane add
// nothing.

bool Above(const TrianglePlace& place, Vec3f p) {
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3f a = place.corners[i], along = place.corners[(i + 1) % 3] - a;
    if (Dot(Cross(along, p - a), place.normal) < -1e-6f * LengthSquared(along)) return false;
  }
  return true;
}

// Marks the triangles of the plane of place `first` as done if every corner stands on one of them.
bool TouchFlatPart(const Geometry& a, std::size_t first, float speculative_m, Scratch* s) {
  const Vec3f normal = s->places[first].normal, origin = s->places[first].corners[0];
  if (Dot(normal, a.middle - origin) < 0) return false;
  const SupportFace face = SupportFaceOf(AtOrigin(a), -normal);
  std::array<LocalPoint, kSupportVertices> points;
  std::uint32_t missing = 0;
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(face.count); ++i) {
    const Vec3f p = face.vertices[i];
    const float height = Dot(normal, p - origin);
    if (height > speculative_m) continue;
    missing |= 1u << count;
    points[count++] = {p, p - normal * height, height, (face.id << 8) + i};
  }
  if (count == 0) return false;
  const auto same = [&](const TrianglePlace& place) {
    return LengthSquared(place.normal - normal) <= kSamePlane * kSamePlane &&
           std::abs(Dot(normal, place.corners[0] - origin)) <= kSamePlane_m;
  };
  for (std::size_t i = first; i < s->places.size() && missing != 0; ++i) {
    if (s->done[i] != 0 || !same(s->places[i])) continue;
    for (std::size_t k = 0; k < count; ++k) {
      if ((missing >> k & 1u) != 0 && Above(s->places[i], points[k].on_a)) missing &= ~(1u << k);
    }
  }
  if (missing != 0) return false;
  for (std::size_t i = first; i < s->places.size(); ++i) {
    if (s->done[i] == 0 && same(s->places[i])) s->done[i] = 1;
  }
  Touch touch{{}, TriangleContact::kFront, 0};
  touch.manifold.normal = -normal;
  touch.key = KeyOf(-normal, s->places[first]);
  Reduce({points.data(), count}, -normal, &touch.manifold);
  s->touches.push_back(touch);
  return true;
}

void TouchTriangles(const Geometry& a, float speculative_m, bool was_in_front, Scratch* s) {
  s->done.assign(s->places.size(), 0);
  const Convex shape = AtOrigin(a);
  for (std::size_t i = 0; i < s->places.size(); ++i) {
    if (s->done[i] != 0) continue;
    const TrianglePlace& place = s->places[i];
    const double low = -ReachOf(shape, -place.normal) - Dot(Vec3d(place.normal), Vec3d(place.corners[0]));
    if (low > static_cast<double>(speculative_m)) continue;
    if (a.kind != GeometryKind::kSphere && TouchFlatPart(a, i, speculative_m, s)) continue;
    Touch touch;
    touch.contact = CollideTriangle(a, place, speculative_m, was_in_front, &touch.manifold);
    if (touch.contact == TriangleContact::kNone) continue;
    for (LocalPoint& p : touch.manifold.points) p.feature ^= (place.index + 1) * 0x9e3779b1u;
    touch.key = KeyOf(touch.manifold.normal, place);
    s->touches.push_back(touch);
  }
}

float DeepestOf(const LocalManifold& m) {
  float deepest = std::numeric_limits<float>::infinity();
  for (int i = 0; i < m.count; ++i) deepest = std::min(deepest, m.points[static_cast<std::size_t>(i)].separation_m);
  return deepest;
}

// A point the way the group's normal runs, with the middle where it was.
LocalPoint Along(Vec3f normal, const LocalPoint& p) {
  const Vec3f middle = (p.on_a + p.on_b) * 0.5f, half = normal * (p.separation_m / 2);
  return {middle - half, middle + half, p.separation_m, p.feature};
}

// Triangles share edges and corners, and so points.
void DropTwins(LocalManifold* m) {
  int kept = 0;
  for (int i = 0; i < m->count; ++i) {
    const LocalPoint& p = m->points[static_cast<std::size_t>(i)];
    const auto end = m->points.begin() + kept;
    const auto twin = [&](const LocalPoint& q) {
      return LengthSquared(q.on_a - p.on_a) <= kSamePoint_m * kSamePoint_m;
    };
    if (std::none_of(m->points.begin(), end, twin)) m->points[static_cast<std::size_t>(kept++)] = p;
  }
  m->count = kept;
}

// One manifold of all that look like touch `first`, by the normal of the deepest among them.
LocalManifold Group(std::size_t first, Scratch* s) {
  const Vec3f like = s->touches[first].manifold.normal;
  LocalManifold group;
  group.normal = like;
  group.key = s->touches[first].key;
  float deepest = std::numeric_limits<float>::infinity();
  for (std::size_t i = first; i < s->touches.size(); ++i) {
    if (s->grouped[i] != 0 || Dot(s->touches[i].manifold.normal, like) < kSameWay) continue;
    s->grouped[i] = 1;
    const float depth = DeepestOf(s->touches[i].manifold);
    if (depth < deepest) deepest = depth, group.normal = s->touches[i].manifold.normal;
  }
  s->points.clear();
  for (std::size_t i = first; i < s->touches.size(); ++i) {
    if (s->grouped[i] != 1) continue;
    s->grouped[i] = 2;
    const LocalManifold& m = s->touches[i].manifold;
    for (int k = 0; k < m.count; ++k) s->points.push_back(Along(group.normal, m.points[static_cast<std::size_t>(k)]));
  }
  Reduce(s->points, group.normal, &group);
  DropTwins(&group);
  return group;
}

// Of more groups than a pair may have, the deepest; in the order they came.
void KeepDeepest(std::vector<LocalManifold>* groups) {
  while (groups->size() > kMostGroups) {
    std::size_t shallowest = 0;
    for (std::size_t i = 1; i < groups->size(); ++i) {
      if (DeepestOf((*groups)[i]) >= DeepestOf((*groups)[shallowest])) shallowest = i;
    }
    groups->erase(groups->begin() + static_cast<std::ptrdiff_t>(shallowest));
  }
}

void Merge(Scratch* s, std::vector<LocalManifold>* out) {
  const bool front = std::any_of(s->touches.begin(), s->touches.end(),
                                 [](const Touch& t) { return t.contact == TriangleContact::kFront; });
  if (front) std::erase_if(s->touches, [](const Touch& t) { return t.contact != TriangleContact::kFront; });
  s->grouped.assign(s->touches.size(), 0);
  s->groups.clear();
  for (std::size_t i = 0; i < s->touches.size(); ++i) {
    if (s->grouped[i] == 0) s->groups.push_back(Group(i, s));
  }
  KeepDeepest(&s->groups);
  for (std::size_t i = 0; i < s->groups.size(); ++i) {
    LocalManifold& group = s->groups[i];
    const auto taken = [&](const LocalManifold& other) { return other.key == group.key; };
    const auto end = s->groups.begin() + static_cast<std::ptrdiff_t>(i);
    while (std::any_of(s->groups.begin(), end, taken)) group.key += 0x1000000;
    out->push_back(group);
  }
}

// Fills `places` with the triangles of a mesh that reach into what is `within_m` of a.
void Search(const Geometry& a, const Geometry& mesh, const LocalPose& mesh_in_a, float within_m, Scratch* s) {
  s->triangles.clear();
  s->touches.clear();
  const Bounds bounds = BoundsIn(a, mesh_in_a, within_m);
  Collector collector(&s->triangles);
  auto* tree = static_cast<btBvhTriangleMeshShape*>(mesh.bullet->bullet())->getOptimizedBvh();
  // The tree works in float; rounded outwards.
  const double slack = 1e-6 * (Length(bounds.min) + Length(bounds.max));
  const Vec3d wide{slack, slack, slack};
  tree->reportAabbOverlappingNodex(&collector, ToBullet(bounds.min - wide), ToBullet(bounds.max + wide));
  std::sort(s->triangles.begin(), s->triangles.end());
  PlaceTriangles(*mesh.surface, mesh_in_a, bounds, s);
}

// What a pair with a mesh remembers: that it was last in front of what it touched.
constexpr std::uint32_t kInFront = 1;

constexpr std::uint32_t kRetrieved = 0x40000000;  // the key of such a manifold

// The shallowest way back.
void RetrieveFrom(const Geometry& a, Scratch* s) {
  for (const TrianglePlace& place : s->places) {
    Touch touch{{}, TriangleContact::kDeep, kRetrieved};
    if (!Retrieve(a, place, &touch.manifold)) continue;
    if (s->touches.empty()) {
      s->touches.push_back(touch);
    } else if (DeepestOf(touch.manifold) > DeepestOf(s->touches[0].manifold)) {
      s->touches[0] = touch;
    }
  }
}

}  // namespace

void CollideMesh(const Geometry& a, const Geometry& mesh, const LocalPose& mesh_in_a, float speculative_m,
                 PartCaches& parts, std::vector<LocalManifold>* out) {
  Scratch& scratch = ScratchOfThread();
  Search(a, mesh, mesh_in_a, speculative_m, &scratch);
  const bool was_in_front = !parts.empty() && parts[0].cache.feature == kInFront;
  TouchTriangles(a, speculative_m, was_in_front, &scratch);
  if (scratch.touches.empty() && was_in_front) {
    Search(a, mesh, mesh_in_a, 2 * a.outer_radius_m, &scratch);
    RetrieveFrom(a, &scratch);
  }
  const bool front = std::any_of(scratch.touches.begin(), scratch.touches.end(),
                                 [](const Touch& t) { return t.contact != TriangleContact::kBack; });
  parts.assign(1, {0, {.axis = {}, .feature = front ? kInFront : 0, .apart_m = 0}});
  Merge(&scratch, out);
}

void CollideHeightField(const Geometry& a, const Geometry& field, const LocalPose& field_in_a, float speculative_m,
                        PartCaches&, std::vector<LocalManifold>* out) {
  Scratch& scratch = ScratchOfThread();
  scratch.triangles.clear();
  scratch.touches.clear();
  const Bounds bounds = BoundsIn(a, field_in_a, speculative_m);
  field.surface->FieldTriangles(bounds.min, bounds.max, &scratch.triangles);
  PlaceTriangles(*field.surface, field_in_a, bounds, &scratch);
  TouchTriangles(a, speculative_m, true, &scratch);
  Merge(&scratch, out);
}

}  // namespace tessera::physics
