// Compounds: their parts, one by one, against the other body or its parts.
#include <algorithm>

#include "core/physics/collide/pair_functions.h"

namespace tessera::physics {
namespace {

// Bounds of a geometry that is placed by `pose`.
Bounds BoundsAt(const Geometry& geometry, const LocalPose& pose) {
  return BoundsOf(geometry, pose.rotation).Moved(pose.position);
}

bool Near(const Bounds& a, const Bounds& b, float within) {
  return a.min.x <= b.max.x + within && b.min.x <= a.max.x + within && a.min.y <= b.max.y + within &&
         b.min.y <= a.max.y + within && a.min.z <= b.max.z + within && b.min.z <= a.max.z + within;
}

LocalPose PoseOf(const Geometry::Child& child) {
  return {child.position, child.rotation, Vec3d(-Into(child.rotation, child.position))};
}

// b as the child of a sees it. What is far and large (`a_in_b`) stays in doubles.
LocalPose FromChild(const Geometry::Child& child, const LocalPose& b_in_a) {
  LocalPose pose;
  pose.rotation = Into(child.rotation, b_in_a.rotation);
  pose.position = Into(child.rotation, b_in_a.position - child.position);
  pose.a_in_b = b_in_a.a_in_b + Vec3d(Into(b_in_a.rotation, child.position));
  return pose;
}

void OutOfChild(const Geometry::Child& child, LocalManifold* m) {
  m->normal = child.rotation * m->normal;
  for (int i = 0; i < m->count; ++i) {
    LocalPoint& p = m->points[static_cast<std::size_t>(i)];
    p.on_a = child.position + child.rotation * p.on_a;
    p.on_b = child.position + child.rotation * p.on_b;
  }
}

std::uint32_t Mixed(std::uint32_t part, std::uint32_t key) { return (part + 1) * 0x9e3779b1u ^ key; }

// Kept from search to search, so that one allocates nothing.
struct Scratch {
  PartCaches of_a, of_b, found, none;
};

Scratch& ScratchOfThread() {
  static thread_local Scratch scratch;
  return scratch;
}

// Parts of a against b, which is no compound.
void CollideParts(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m, PartCaches& parts,
                  std::vector<LocalManifold>* out) {
  const bool everywhere = b.kind == GeometryKind::kPlane;
  const bool surface = b.kind == GeometryKind::kMesh || b.kind == GeometryKind::kHeightField;
  const Bounds bounds = everywhere || surface ? Bounds{} : BoundsAt(b, b_in_a);
  Scratch& scratch = ScratchOfThread();
  PartCaches& known = scratch.of_a;
  known.assign(parts.begin(), parts.end());
  parts.clear();
  for (std::uint32_t i = 0; i < a.children.size(); ++i) {
    const Geometry::Child& child = a.children[i];
    if (!everywhere && !surface && !Near(BoundsAt(*child.geometry, PoseOf(child)), bounds, speculative_m)) continue;
    const LocalPose pose = FromChild(child, b_in_a);
    const std::size_t begin = out->size();
    if (b.convex()) {
      PartCache part{i, {}};
      const auto old = std::lower_bound(known.begin(), known.end(), i,
                                        [](const PartCache& p, std::uint32_t key) { return p.key < key; });
      if (old != known.end() && old->key == i) part = *old;
      LocalManifold m;
      CollideConvex(*child.geometry, b, pose, speculative_m, part.cache, &m);
      parts.push_back(part);
      if (m.count > 0) out->push_back(m);
    } else {
      scratch.none.clear();
      CollideLocal(*child.geometry, b, pose, speculative_m, scratch.none, out);
    }
    for (std::size_t k = begin; k < out->size(); ++k) {
      OutOfChild(child, &(*out)[k]);
      (*out)[k].key = surface ? Mixed(i, (*out)[k].key) : i;
    }
  }
}

}  // namespace

void CollideCompound(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                     PartCaches& parts, std::vector<LocalManifold>* out) {
  if (b.kind != GeometryKind::kCompound) return CollideParts(a, b, b_in_a, speculative_m, parts, out);
  PartCaches &known = ScratchOfThread().of_b, &found = ScratchOfThread().found;
  known.assign(parts.begin(), parts.end());
  parts.clear();
  const Bounds bounds = BoundsOf(a, Mat3f{});
  const auto stride = static_cast<std::uint32_t>(std::max<std::size_t>(a.children.size(), 1));
  for (std::uint32_t i = 0; i < b.children.size(); ++i) {
    const Geometry::Child& child = b.children[i];
    LocalPose pose;
    pose.position = b_in_a.position + b_in_a.rotation * child.position;
    pose.rotation = b_in_a.rotation * child.rotation;
    pose.a_in_b = Vec3d(Into(child.rotation, Vec3f(b_in_a.a_in_b) - child.position));
    if (!Near(bounds, BoundsAt(*child.geometry, pose), speculative_m)) continue;
    const std::size_t begin = out->size();
    const auto within = [&](std::uint32_t key) {
      return std::lower_bound(known.begin(), known.end(), key,
                              [](const PartCache& p, std::uint32_t k) { return p.key < k; });
    };
    found.assign(within(i * stride), within((i + 1) * stride));
    for (PartCache& part : found) part.key -= i * stride;
    if (a.kind == GeometryKind::kCompound) {
      CollideParts(a, *child.geometry, pose, speculative_m, found, out);
    } else {
      LocalManifold m;
      PartCache part = found.empty() ? PartCache{} : found.front();
      CollideConvex(a, *child.geometry, pose, speculative_m, part.cache, &m);
      found.assign(1, part);
      if (m.count > 0) out->push_back(m);
    }
    for (std::size_t k = begin; k < out->size(); ++k) (*out)[k].key += i * stride;
    for (PartCache& part : found) {
      part.key += i * stride;
      parts.push_back(part);
    }
  }
}

}  // namespace tessera::physics
