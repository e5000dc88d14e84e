#include "core/physics/islands.h"

#include <algorithm>
#include <limits>

namespace tessera::physics {
namespace {
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
}

void Islands::Reset(std::size_t bodies) {
  parent_.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i) parent_[i] = static_cast<std::uint32_t>(i);
}

std::uint32_t Islands::Root(std::uint32_t node) {
  while (parent_[node] != node) {
    parent_[node] = parent_[parent_[node]];
    node = parent_[node];
  }
  return node;
}

void Islands::Unite(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t x = Root(a), y = Root(b);
  parent_[std::max(x, y)] = std::min(x, y);
}

// A root has the lowest number of its island, so it comes first.
void Islands::Number() {
  island_.assign(parent_.size(), kNone);
  islands_.clear();
  for (std::uint32_t i = 0; i < parent_.size(); ++i) {
    const std::uint32_t root = Root(i);
    if (root == i) {
      island_[i] = static_cast<std::uint32_t>(islands_.size());
      islands_.emplace_back();
    } else {
      island_[i] = island_[root];
    }
  }
}

}  // namespace tessera::physics
