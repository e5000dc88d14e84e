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
// A pair's manifolds, and triangles that are looked at. More: the deepest and the first are kept.
constexpr std::size_t kMostGroups = 8, kMostTriangles = 4096;

struct Touch {
  LocalManifold manifold;
  TriangleContact contact;
};

// What a search needs, kept from one to the next so that it allocates nothing.
struct Scratch {
  std::vector<std::uint32_t> triangles;
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

void TouchTriangles(const Geometry& a, const Surface& surface, const LocalPose& pose, const Bounds& bounds,
                    float speculative_m, Scratch* scratch) {
  std::size_t looked_at = 0;
  for (const std::uint32_t index : scratch->triangles) {
    if (!Reaches(bounds, surface.Corners(index))) continue;
    if (++looked_at > kMostTriangles) return;
    const TrianglePlace place(surface, pose, index);
    if (place.normal == Vec3f{}) continue;
    Touch touch;
    touch.contact = CollideTriangle(a, place, speculative_m, &touch.manifold);
    if (touch.contact == TriangleContact::kNone) continue;
    for (LocalPoint& p : touch.manifold.points) p.feature ^= (index + 1) * 0x9e3779b1u;
    scratch->touches.push_back(touch);
  }
}

float DeepestOf(const LocalManifold& m) {
  float deepest = std::numeric_limits<float>::infinity();
  for (int i = 0; i < m.count; ++i) deepest = std::min(deepest, m.points[static_cast<std::size_t>(i)].separation_m);
  return deepest;
}

// The name of a direction in the surface's own axes, so that it stays while a body slides from triangle to triangle.
std::uint32_t NameOf(Vec3f normal) {
  const auto part = [](float v) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(v * 64))) & 0xffu;
  };
  return part(normal.x) << 16 | part(normal.y) << 8 | part(normal.z);
}

// A point the way the group's normal runs, with the middle where it was.
LocalPoint Along(Vec3f normal, const LocalPoint& p) {
  const Vec3f middle = (p.on_a + p.on_b) * 0.5f, half = normal * (p.separation_m / 2);
  return {middle - half, middle + half, p.separation_m, p.feature};
}

void AddPoint(const LocalPoint& p, std::vector<LocalPoint>* points) {
  for (LocalPoint& other : *points) {
    if (LengthSquared(other.on_a - p.on_a) > kSamePoint_m * kSamePoint_m) continue;
    if (p.separation_m < other.separation_m) other = p;
    return;
  }
  points->push_back(p);
}

// One manifold of all that look like touch `first`, by the normal of the deepest among them.
LocalManifold Group(std::size_t first, Scratch* s) {
  const Vec3f like = s->touches[first].manifold.normal;
  LocalManifold group;
  group.normal = like;
  float deepest = std::numeric_limits<float>::infinity();
  const auto belongs = [&](std::size_t i) { return s->grouped[i] == 1; };
  for (std::size_t i = first; i < s->touches.size(); ++i) {
    if (s->grouped[i] != 0 || Dot(s->touches[i].manifold.normal, like) < kSameWay) continue;
    s->grouped[i] = 1;
    const float depth = DeepestOf(s->touches[i].manifold);
    if (depth < deepest) deepest = depth, group.normal = s->touches[i].manifold.normal;
  }
  s->points.clear();
  for (std::size_t i = first; i < s->touches.size(); ++i) {
    if (!belongs(i)) continue;
    s->grouped[i] = 2;
    const LocalManifold& m = s->touches[i].manifold;
    for (int k = 0; k < m.count; ++k) AddPoint(Along(group.normal, m.points[static_cast<std::size_t>(k)]), &s->points);
  }
  Reduce(s->points, group.normal, &group);
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

void Merge(const Mat3f& surface_rotation, Scratch* s, std::vector<LocalManifold>* out) {
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
    group.key = NameOf(Into(surface_rotation, group.normal));
    const auto taken = [&](const LocalManifold& other) { return other.key == group.key; };
    const auto end = s->groups.begin() + static_cast<std::ptrdiff_t>(i);
    while (std::any_of(s->groups.begin(), end, taken)) group.key += 0x1000000;
    out->push_back(group);
  }
}

}  // namespace

void CollideMesh(const Geometry& a, const Geometry& mesh, const LocalPose& mesh_in_a, float speculative_m, PartCaches&,
                 std::vector<LocalManifold>* out) {
  Scratch& scratch = ScratchOfThread();
  scratch.triangles.clear();
  scratch.touches.clear();
  const Bounds bounds = BoundsIn(a, mesh_in_a, speculative_m);
  Collector collector(&scratch.triangles);
  auto* tree = static_cast<btBvhTriangleMeshShape*>(mesh.bullet->bullet())->getOptimizedBvh();
  // The tree works in float; rounded outwards.
  const double slack = 1e-6 * (Length(bounds.min) + Length(bounds.max));
  const Vec3d wide{slack, slack, slack};
  tree->reportAabbOverlappingNodex(&collector, ToBullet(bounds.min - wide), ToBullet(bounds.max + wide));
  std::sort(scratch.triangles.begin(), scratch.triangles.end());
  TouchTriangles(a, *mesh.surface, mesh_in_a, bounds, speculative_m, &scratch);
  Merge(mesh_in_a.rotation, &scratch, out);
}

void CollideHeightField(const Geometry& a, const Geometry& field, const LocalPose& field_in_a, float speculative_m,
                        PartCaches&, std::vector<LocalManifold>* out) {
  Scratch& scratch = ScratchOfThread();
  scratch.triangles.clear();
  scratch.touches.clear();
  const Bounds bounds = BoundsIn(a, field_in_a, speculative_m);
  field.surface->FieldTriangles(bounds.min, bounds.max, &scratch.triangles);
  TouchTriangles(a, *field.surface, field_in_a, bounds, speculative_m, &scratch);
  Merge(field_in_a.rotation, &scratch, out);
}

}  // namespace tessera::physics
