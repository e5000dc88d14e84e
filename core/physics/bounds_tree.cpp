#include "core/physics/bounds_tree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace tessera::physics {
namespace {

// A tree is built anew after so many changes a leaf, and no fewer than the least. More, and walks grow longer; fewer,
// and building takes longer than that spares.
constexpr std::size_t kChangesALeaf = 6, kLeastChanges = 64;

}  // namespace

BoundsTree::Box BoundsTree::BoxOf(const Bounds& bounds) {
  return {{bounds.min.x, bounds.min.y, bounds.min.z, -bounds.max.x, -bounds.max.y, -bounds.max.z}};
}

BoundsTree::Box BoundsTree::Union(const Box& a, const Box& b) {
  Box both;
  for (int i = 0; i < 6; ++i) both.f[i] = std::min(a.f[i], b.f[i]);
  return both;
}

bool BoundsTree::Same(const Box& a, const Box& b) { return std::equal(a.f, a.f + 6, b.f); }

// Twice the distance of the middles, summed over the axes.
float BoundsTree::Distance(const Box& a, const Box& b) {
  float sum = 0;
  for (int i = 0; i < 3; ++i) sum += std::abs((a.f[i] - a.f[i + 3]) - (b.f[i] - b.f[i + 3]));
  return sum;
}

BoundsTree::Node BoundsTree::EmptyRoot() {
  constexpr float kNowhere = std::numeric_limits<float>::infinity();
  const Box none{{kNowhere, kNowhere, kNowhere, kNowhere, kNowhere, kNowhere}};
  return {{none, none}, {kNone, kNone}, kNone};
}

void BoundsTree::Put(std::uint32_t place, const Box& box, std::uint32_t link) {
  Node& node = nodes_[place / 2];
  node.box[place % 2] = box;
  node.link[place % 2] = link;
  if ((link & kLeafBit) != 0) {
    leaves_[link & ~kLeafBit].place = place;
  } else {
    nodes_[link].above = place;
  }
}

void BoundsTree::Clear(std::uint32_t place) {
  const Node empty = EmptyRoot();
  nodes_[place / 2].box[place % 2] = empty.box[0];
  nodes_[place / 2].link[place % 2] = kNone;
}

std::uint32_t BoundsTree::TakeNode() {
  if (free_nodes_.empty()) {
    nodes_.emplace_back();
    return static_cast<std::uint32_t>(nodes_.size() - 1);
  }
  const std::uint32_t node = free_nodes_.back();
  free_nodes_.pop_back();
  return node;
}

BoundsTree::Leaf BoundsTree::Insert(const Bounds& bounds, RigidBody& body) {
  if (free_leaves_.empty()) {
    free_leaves_.push_back(static_cast<std::uint32_t>(leaves_.size()));
    leaves_.emplace_back();
  }
  const Leaf leaf = free_leaves_.back();
  free_leaves_.pop_back();
  leaves_[leaf].body = &body;
  ++size_;
  Place(leaf, BoxOf(bounds));
  CountChanges(kChangesALeaf);
  return leaf;
}

void BoundsTree::Remove(Leaf leaf) {
  assert(leaf < leaves_.size() && leaves_[leaf].body != nullptr);
  Unlink(leaf);
  leaves_[leaf] = {};
  free_leaves_.push_back(leaf);
  --size_;
}

void BoundsTree::Update(Leaf leaf, const Bounds& bounds) {
  assert(leaf < leaves_.size() && leaves_[leaf].body != nullptr);
  Unlink(leaf);
  Place(leaf, BoxOf(bounds));
  CountChanges(1);
}

void BoundsTree::CountChanges(std::size_t changes) {
  changes_ += changes;
  if (changes_ >= kChangesALeaf * built_ + kLeastChanges) Rebuild();
}

// Goes down to the leaf whose middle is nearest, side by side, and puts the new one beside it.
void BoundsTree::Place(std::uint32_t leaf, const Box& box) {
  const std::uint32_t link = leaf | kLeafBit;
  for (const std::uint32_t side : {0u, 1u}) {
    if (nodes_[kRoot].link[side] == kNone) return Put(2 * kRoot + side, box, link);
  }
  std::uint32_t at = kRoot;
  while (true) {
    Node& node = nodes_[at];
    const std::uint32_t side = Distance(node.box[0], box) <= Distance(node.box[1], box) ? 0 : 1;
    const std::uint32_t below = node.link[side];
    const Box before = node.box[side], both = Union(before, box);
    node.box[side] = both;
    if ((below & kLeafBit) == 0) {
      at = below;
      continue;
    }
    const std::uint32_t fresh = TakeNode();
    Put(2 * fresh, before, below);
    Put(2 * fresh + 1, box, link);
    return Put(2 * at + side, both, fresh);
  }
}

// Takes a leaf out; what lay beside it takes the place of their node.
void BoundsTree::Unlink(std::uint32_t leaf) {
  const std::uint32_t place = leaves_[leaf].place, node = place / 2;
  if (node == kRoot) return Clear(place);
  const std::uint32_t above = nodes_[node].above, beside = 1 - place % 2;
  Put(above, nodes_[node].box[beside], nodes_[node].link[beside]);
  free_nodes_.push_back(node);
  Tighten(above / 2);
}

// Bounds of a node have shrunk, and so may those around it.
void BoundsTree::Tighten(std::uint32_t node) {
  while (node != kRoot) {
    const std::uint32_t above = nodes_[node].above;
    const Box both = Union(nodes_[node].box[0], nodes_[node].box[1]);
    Box& held = nodes_[above / 2].box[above % 2];
    if (Same(held, both)) return;
    held = both;
    node = above / 2;
  }
}

void BoundsTree::Rebuild() {
  changes_ = 0;
  built_ = size_;
  items_.clear();
  for (std::uint32_t leaf = 0; leaf < leaves_.size(); ++leaf) {
    if (leaves_[leaf].body != nullptr) items_.push_back({BoxAt(leaves_[leaf].place), leaf});
  }
  free_nodes_.clear();
  nodes_.assign(1, EmptyRoot());
  if (items_.size() == 1) return Put(2 * kRoot, items_[0].box, items_[0].leaf | kLeafBit);
  if (!items_.empty()) Build(kRoot, items_);
}

// Builds what is below a node from at least two items.
void BoundsTree::Build(std::uint32_t node, std::span<Item> items) {
  const std::size_t first = Divide(items);
  for (const std::uint32_t side : {0u, 1u}) {
    const std::span<Item> part = side == 0 ? items.first(first) : items.subspan(first);
    if (part.size() == 1) {
      Put(2 * node + side, part[0].box, part[0].leaf | kLeafBit);
      continue;
    }
    const std::uint32_t below = TakeNode();
    Build(below, part);
    Put(2 * node + side, Union(nodes_[below].box[0], nodes_[below].box[1]), below);
  }
}

// Sorts items into two parts by which side of their mean their middles lie on, along the axis on which those spread
// most, and gives the size of the first; where one part would have hardly any, at the median.
std::size_t BoundsTree::Divide(std::span<Item> items) {
  const auto middle = [](const Item& item, int axis) { return item.box.f[axis] - item.box.f[axis + 3]; };
  float low[3], high[3], sum[3] = {};
  std::fill_n(low, 3, std::numeric_limits<float>::max());
  std::fill_n(high, 3, std::numeric_limits<float>::lowest());
  for (const Item& item : items) {
    for (int axis = 0; axis < 3; ++axis) {
      const float at = middle(item, axis);
      low[axis] = std::min(low[axis], at);
      high[axis] = std::max(high[axis], at);
      sum[axis] += at;
    }
  }
  int axis = 0;
  for (const int other : {1, 2}) {
    if (high[other] - low[other] > high[axis] - low[axis]) axis = other;
  }
  const float mean = sum[axis] / static_cast<float>(items.size());
  const auto split =
      std::partition(items.begin(), items.end(), [&](const Item& item) { return middle(item, axis) < mean; });
  const auto first = static_cast<std::size_t>(split - items.begin());
  const std::size_t least = items.size() / 8 + 1;
  if (first >= least && items.size() - first >= least) return first;
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [&](const Item& a, const Item& b) { return middle(a, axis) < middle(b, axis); });
  return half;
}

bool BoundsTree::Validate() const {
  std::size_t leaves = 0;
  return ValidateNode(kRoot, &leaves) && leaves == size_;
}

bool BoundsTree::ValidateNode(std::uint32_t node, std::size_t* leaves) const {
  for (const std::uint32_t side : {0u, 1u}) {
    const std::uint32_t place = 2 * node + side, link = nodes_[node].link[side];
    if (link == kNone) {
      if (node != kRoot) return false;
    } else if ((link & kLeafBit) != 0) {
      const LeafAt& leaf = leaves_[link & ~kLeafBit];
      if (leaf.place != place || leaf.body == nullptr) return false;
      ++*leaves;
    } else {
      const Node& below = nodes_[link];
      if (below.above != place || !Same(Union(below.box[0], below.box[1]), BoxAt(place))) return false;
      if (!ValidateNode(link, leaves)) return false;
    }
  }
  return true;
}

}  // namespace tessera::physics
