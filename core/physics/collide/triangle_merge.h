// TriangleMerger: makes one manifold of the contacts with triangles that look the same way.
//
//   TriangleMerger merger;               // keeps its memory from call to call
//   merger.Merge(contacts, &manifolds);  // changes `contacts`
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "core/physics/collide/triangle_pair.h"

namespace tessera::physics {

// Normals closer than this, cosine of about a degree, share a manifold.
inline constexpr float kSameWay = 0.99985f;

// The manifold of a shape with one triangle, or with a flat part of several.
struct TriangleManifold {
  LocalManifold manifold;
  TriangleContact contact = TriangleContact::kNone;
  std::uint32_t key = 0;  // key of the merged manifold; set on the contact that comes first in it
};

// The lowest separation; infinity where there is no point.
float DeepestOf(const LocalManifold& manifold);

class TriangleMerger {
 public:
  // Appends the merged manifolds, each under the normal of its deepest contact and a key that no other has. Where any
  // contact is in front, the others do not count. A pair has at most eight manifolds; of more, the deepest are kept.
  void Merge(std::vector<TriangleManifold>& contacts, std::vector<LocalManifold>* out);

 private:
  LocalManifold MergeWith(std::size_t first, const std::vector<TriangleManifold>& contacts);

  std::vector<std::uint8_t> state_;  // by contact: how far merging has come with it
  std::vector<LocalPoint> points_;
  std::vector<LocalManifold> merged_;
};

}  // namespace tessera::physics
