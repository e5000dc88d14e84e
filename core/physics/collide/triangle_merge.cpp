#include "core/physics/collide/triangle_merge.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace tessera::physics {
namespace {

// Points nearer than this, m, are one: triangles share edges and corners.
constexpr float kSamePoint_m = 1e-5f;
constexpr std::size_t kMostManifolds = 8;  // a pair

enum : std::uint8_t { kWaiting, kChosen, kMerged };

// The same separation about the same middle, along another normal.
LocalPoint Along(Vec3f normal, const LocalPoint& p) {
  const Vec3f middle = (p.on_a + p.on_b) * 0.5f, half = normal * (p.separation_m / 2);
  return {middle - half, middle + half, p.separation_m, p.feature};
}

// Neighbouring triangles make the same point at an edge or corner that they share.
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

// Keeps the order in which the manifolds came.
void KeepDeepest(std::vector<LocalManifold>* manifolds) {
  while (manifolds->size() > kMostManifolds) {
    std::size_t shallowest = 0;
    for (std::size_t i = 1; i < manifolds->size(); ++i) {
      if (DeepestOf((*manifolds)[i]) >= DeepestOf((*manifolds)[shallowest])) shallowest = i;
    }
    manifolds->erase(manifolds->begin() + static_cast<std::ptrdiff_t>(shallowest));
  }
}

}  // namespace

float DeepestOf(const LocalManifold& m) {
  float deepest = std::numeric_limits<float>::infinity();
  for (int i = 0; i < m.count; ++i) deepest = std::min(deepest, m.points[static_cast<std::size_t>(i)].separation_m);
  return deepest;
}

LocalManifold TriangleMerger::MergeWith(std::size_t first, const std::vector<TriangleManifold>& contacts) {
  const Vec3f like = contacts[first].manifold.normal;
  LocalManifold merged;
  merged.normal = like;
  merged.key = contacts[first].key;
  float deepest = std::numeric_limits<float>::infinity();
  for (std::size_t i = first; i < contacts.size(); ++i) {
    if (state_[i] != kWaiting || Dot(contacts[i].manifold.normal, like) < kSameWay) continue;
    state_[i] = kChosen;
    const float depth = DeepestOf(contacts[i].manifold);
    if (depth < deepest) deepest = depth, merged.normal = contacts[i].manifold.normal;
  }
  points_.clear();
  for (std::size_t i = first; i < contacts.size(); ++i) {
    if (state_[i] != kChosen) continue;
    state_[i] = kMerged;
    const LocalManifold& m = contacts[i].manifold;
    for (int k = 0; k < m.count; ++k) points_.push_back(Along(merged.normal, m.points[static_cast<std::size_t>(k)]));
  }
  Reduce(points_, merged.normal, &merged);
  DropTwins(&merged);
  return merged;
}

void TriangleMerger::Merge(std::vector<TriangleManifold>& contacts, std::vector<LocalManifold>* out) {
  const auto in_front = [](const TriangleManifold& c) { return c.contact == TriangleContact::kFront; };
  if (std::any_of(contacts.begin(), contacts.end(), in_front)) std::erase_if(contacts, std::not_fn(in_front));
  state_.assign(contacts.size(), kWaiting);
  merged_.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (state_[i] == kWaiting) merged_.push_back(MergeWith(i, contacts));
  }
  KeepDeepest(&merged_);
  for (std::size_t i = 0; i < merged_.size(); ++i) {
    LocalManifold& manifold = merged_[i];
    const auto taken = [&](const LocalManifold& other) { return other.key == manifold.key; };
    const auto end = merged_.begin() + static_cast<std::ptrdiff_t>(i);
    while (std::any_of(merged_.begin(), end, taken)) manifold.key += 0x1000000;
    out->push_back(manifold);
  }
}

}  // namespace tessera::physics
