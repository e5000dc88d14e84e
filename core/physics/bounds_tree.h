// BoundsTree: a dynamic tree of the bounds of bodies, for what overlaps what.
//
// A node holds the bounds of both its children in one cache line, so a walk tests two children at a time and never
// looks at a body that it does not find. Leaves are put in and taken out one by one; after some changes for each leaf
// that the tree has, it is built anew from the top, in balance. So its shape follows from the order of changes alone,
// and it is never far from a good one.
//
//   BoundsTree tree;
//   const BoundsTree::Leaf leaf = tree.Insert(bounds, body);
//   tree.Overlapping(bounds, [](BoundsTree::Leaf leaf, const Bounds& of_leaf) { ... });
//   tree.Update(leaf, moved);
//
// Thread rule: any number of threads may call const functions at once, while none changes the tree.
#pragma once

#include <absl/container/inlined_vector.h>
#include <emmintrin.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/bounds.h"

namespace tessera::physics {

class RigidBody;

class BoundsTree {
 public:
  using Leaf = std::uint32_t;  // names a body in the tree, and may be used again once that is removed

  // Bounds must be finite.
  Leaf Insert(const Bounds& bounds, RigidBody& body);
  void Remove(Leaf leaf);
  void Update(Leaf leaf, const Bounds& bounds);

  RigidBody& BodyOf(Leaf leaf) const { return *leaves_[leaf].body; }
  Bounds BoundsOf(Leaf leaf) const { return Boxed(BoxAt(leaves_[leaf].place)); }
  std::size_t size() const { return size_; }

  // Calls `visit(leaf, bounds of the leaf)` for all that overlap these bounds, in no order.
  template <class Visit>
  void Overlapping(const Bounds& bounds, Visit visit) const;
  // Visits the leaves that `crosses(bounds)` holds for, as it must for all bounds around those, until a visit returns
  // false; in no order. False: a visit did.
  template <class Crosses, class Visit>
  bool Walk(Crosses crosses, Visit visit) const;

  // All nodes hold what is below them, and all names lead to their places. For assertions; linear.
  bool Validate() const;

 private:
  static constexpr std::uint32_t kRoot = 0;
  static constexpr std::uint32_t kLeafBit = 0x80000000, kNone = 0xffffffff;

  // The least x, y, z and the negatives of the greatest: two boxes overlap where six sums are at most 0, and what
  // holds both is the lesser of each of the six.
  struct Box {
    float f[6];
  };
  // A place is the number of a node times two, plus the side.
  struct alignas(64) Node {
    Box box[2];
    std::uint32_t link[2];  // node below; leaf, with kLeafBit; kNone, which only the root has
    std::uint32_t above;    // place that holds this node
  };
  struct LeafAt {
    RigidBody* body = nullptr;  // null: free
    std::uint32_t place = 0;
  };
  struct Item {
    Box box;
    std::uint32_t leaf;
  };

  static Box BoxOf(const Bounds& bounds);
  static Bounds Boxed(const Box& box) { return {{box.f[0], box.f[1], box.f[2]}, {-box.f[3], -box.f[4], -box.f[5]}}; }
  static Box Union(const Box& a, const Box& b);
  static bool Same(const Box& a, const Box& b);
  static float Distance(const Box& a, const Box& b);

  const Box& BoxAt(std::uint32_t place) const { return nodes_[place / 2].box[place % 2]; }
  void Put(std::uint32_t place, const Box& box, std::uint32_t link);
  void Clear(std::uint32_t place);
  std::uint32_t TakeNode();
  void Place(std::uint32_t leaf, const Box& box);
  void Unlink(std::uint32_t leaf);
  void Tighten(std::uint32_t node);
  void CountChanges(std::size_t changes);
  void Rebuild();
  void Build(std::uint32_t node, std::span<Item> items);
  static std::size_t Divide(std::span<Item> items);
  bool ValidateNode(std::uint32_t node, std::size_t* leaves) const;

  std::vector<Node> nodes_ = {EmptyRoot()};
  std::vector<LeafAt> leaves_;
  std::vector<std::uint32_t> free_nodes_, free_leaves_;
  std::size_t size_ = 0;
  std::size_t built_ = 0;    // leaves that the tree was built of last
  std::size_t changes_ = 0;  // since then
  std::vector<Item> items_;

  static Node EmptyRoot();
};

template <class Visit>
void BoundsTree::Overlapping(const Bounds& bounds, Visit visit) const {
  const Vec3f low = bounds.min, high = bounds.max;
  // The twelve numbers of a node's two boxes, against those of these bounds.
  const __m128 first = _mm_setr_ps(high.x, high.y, high.z, -low.x);
  const __m128 second = _mm_setr_ps(-low.y, -low.z, high.x, high.y);
  const __m128 third = _mm_setr_ps(high.z, -low.x, -low.y, -low.z);
  constexpr int kAll = 0x3f;
  absl::InlinedVector<std::uint32_t, 64> open = {kRoot};
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    const float* f = node.box[0].f;
    const int within = _mm_movemask_ps(_mm_cmple_ps(_mm_load_ps(f), first)) |
                       _mm_movemask_ps(_mm_cmple_ps(_mm_load_ps(f + 4), second)) << 4 |
                       _mm_movemask_ps(_mm_cmple_ps(_mm_load_ps(f + 8), third)) << 8;
    for (const int side : {0, 1}) {
      if ((within >> (6 * side) & kAll) != kAll) continue;
      const std::uint32_t link = node.link[side];
      if ((link & kLeafBit) != 0) {
        visit(link & ~kLeafBit, Boxed(node.box[side]));
      } else {
        __builtin_prefetch(&nodes_[link]);
        open.push_back(link);
      }
    }
  }
}

template <class Crosses, class Visit>
bool BoundsTree::Walk(Crosses crosses, Visit visit) const {
  absl::InlinedVector<std::uint32_t, 64> open = {kRoot};
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    for (const int side : {0, 1}) {
      const std::uint32_t link = node.link[side];
      if (link == kNone || !crosses(Boxed(node.box[side]))) continue;
      if ((link & kLeafBit) == 0) {
        open.push_back(link);
      } else if (!visit(link & ~kLeafBit)) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace tessera::physics
