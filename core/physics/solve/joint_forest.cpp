#include "core/physics/solve/joint_forest.h"

#include <algorithm>
#include <cmath>

#include "core/physics/solve/solved_access.h"
#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

constexpr std::uint32_t kNoNode = 0xffffffff;

using Vector = std::array<double, kLockedRows>;
using Rows = std::array<Vector, kLockedRows>;

Vector RowOf(const JointRow& row, bool of_b) {
  const Vec3f& v = of_b ? row.linear_b : row.linear_a;
  const Vec3f& w = of_b ? row.angular_b : row.angular_a;
  return {v.x, v.y, v.z, w.x, w.y, w.z};
}

double Dot(const Vector& a, const Vector& b) {
  return ((a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])) + (a[4] * b[4] + a[5] * b[5]);
}
void AddScaled(Vector& to, double s, const Vector& v) {
  for (std::size_t k = 0; k < kLockedRows; ++k) to[k] += s * v[k];
}

// Replaces the lower half of `m`, n by n, by L with m = L L^T, and inverts the diagonal of L.
void Cholesky(Rows& m, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = m[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= m[i][k] * m[j][k];
      m[i][j] = i == j ? 1 / std::sqrt(sum) : sum * m[j][j];
    }
  }
}
// Forward solves L x = v, and Backward L^T x = v, in place.
void Forward(const Rows& lower, std::size_t n, Vector& v) {
  for (std::size_t i = 0; i < n; ++i) {
    double sum = v[i];
    for (std::size_t k = 0; k < i; ++k) sum -= lower[i][k] * v[k];
    v[i] = sum * lower[i][i];
  }
}
void Backward(const Rows& lower, std::size_t n, Vector& v) {
  for (std::size_t i = n; i-- > 0;) {
    double sum = v[i];
    for (std::size_t k = i + 1; k < n; ++k) sum -= lower[k][i] * v[k];
    v[i] = sum * lower[i][i];
  }
}

}  // namespace

std::uint32_t JointForest::Root(std::uint32_t body) {
  while (roots_[body] != body) {
    roots_[body] = roots_[roots_[body]];
    body = roots_[body];
  }
  return body;
}

// Lists the joints that close no cycle and are not alone.
void JointForest::Link(std::span<JointBlock> blocks, std::span<const std::uint32_t> order, std::uint32_t nobody) {
  roots_.resize(nobody + 1);
  for (std::uint32_t i = 0; i <= nobody; ++i) roots_[i] = i;
  degrees_.assign(nobody + 1, 0);
  links_.clear();
  for (const std::uint32_t k : order) {
    JointBlock& block = blocks[k];
    block.in_tree = false;
    if (block.locked == 0) continue;
    const std::uint32_t a = Root(block.a), b = Root(block.b);
    if (a == b) continue;
    roots_[std::max(a, b)] = std::min(a, b);
    ++degrees_[block.a];
    ++degrees_[block.b];
    links_.push_back(k);
  }
  degrees_[nobody] = 0;  // Two joints to the world are not connected by that.
  std::erase_if(links_, [&](std::uint32_t k) { return degrees_[blocks[k].a] < 2 && degrees_[blocks[k].b] < 2; });
  for (const std::uint32_t k : links_) blocks[k].in_tree = true;
}

std::uint32_t JointForest::NodeOf(std::uint32_t body, std::uint32_t nobody) {
  std::uint32_t& node = node_of_[body];
  if (node == kNoNode) {
    node = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({.world = body == nobody});
  }
  return node;
}

// Visits bodies breadth first from those in `queue_`, and makes an edge of each joint on the way.
void JointForest::Walk(std::span<const JointBlock> blocks, std::uint32_t nobody) {
  for (std::size_t next = 0; next < queue_.size(); ++next) {
    const std::uint32_t body = queue_[next];
    for (std::uint32_t i = starts_[body]; i < starts_[body + 1]; ++i) {
      const std::uint32_t k = beside_[i];
      if (taken_[k]) continue;
      taken_[k] = true;
      const JointBlock& block = blocks[k];
      const bool child_is_b = block.a == body;
      const std::uint32_t child = child_is_b ? block.b : block.a;
      const std::uint32_t parent = NodeOf(body, nobody);
      const std::uint32_t below = NodeOf(child, nobody);
      nodes_[below].root = false;
      edges_.push_back({.block = k, .child = below, .parent = parent, .child_is_b = child_is_b});
      queue_.push_back(child);
    }
  }
  queue_.clear();
}

void JointForest::Grow(std::span<JointBlock> blocks, std::span<const std::uint32_t> order, std::uint32_t nobody) {
  edges_.clear();
  nodes_.clear();
  Link(blocks, order, nobody);
  if (links_.empty()) return;
  starts_.assign(nobody + 2, 0);
  for (const std::uint32_t k : links_) {
    ++starts_[blocks[k].a + 1];
    ++starts_[blocks[k].b + 1];
  }
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  beside_.resize(starts_.back());
  degrees_.assign(starts_.begin(), starts_.end() - 1);
  for (const std::uint32_t k : links_) {
    beside_[degrees_[blocks[k].a]++] = k;
    beside_[degrees_[blocks[k].b]++] = k;
  }
  node_of_.assign(nobody + 1, kNoNode);
  taken_.assign(blocks.size(), false);
  queue_.assign(1, nobody);
  Walk(blocks, nobody);
  for (const std::uint32_t k : links_) {
    if (taken_[k]) continue;
    queue_.assign(1, blocks[k].a);
    Walk(blocks, nobody);
  }
}

void JointForest::Decompose(Node& node) {
  if (!node.leaf) Cholesky(node.lower, kLockedRows);
}

// Adds to the parent's K what hangs on it through a joint whose child has its K already.
void JointForest::Weigh(Edge& edge, const JointBlock& block) {
  Node &child = nodes_[edge.child], &parent = nodes_[edge.parent];
  edge.rows = block.locked;
  const std::size_t n = At(edge.rows);
  for (std::size_t i = 0; i < n; ++i) {
    edge.below[i] = RowOf(block.rows[i], edge.child_is_b);
    if (!child.leaf) Forward(child.lower, kLockedRows, edge.below[i]);
    for (std::size_t j = 0; j <= i; ++j) edge.lower[i][j] = Dot(edge.below[i], edge.below[j]);
    edge.lower[i][i] += kTreeSoftness;
  }
  Cholesky(edge.lower, n);
  if (parent.world) return;
  for (std::size_t i = 0; i < n; ++i) {
    Vector row = RowOf(block.rows[i], !edge.child_is_b);
    for (std::size_t k = 0; k < i; ++k) AddScaled(row, -edge.lower[i][k], edge.above[k]);
    for (double& v : row) v *= edge.lower[i][i];
    edge.above[i] = row;
  }
  if (parent.leaf) {
    parent.leaf = false;
    for (std::size_t i = 0; i < kLockedRows; ++i) {
      parent.lower[i].fill(0);
      parent.lower[i][i] = 1;
    }
  }
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = 0; i < kLockedRows; ++i) {
      for (std::size_t j = 0; j <= i; ++j) parent.lower[i][j] += edge.above[k][i] * edge.above[k][j];
    }
  }
}

void JointForest::Factor(std::span<const JointBlock> blocks) {
  for (Node& node : nodes_) node.leaf = true;
  for (std::size_t e = edges_.size(); e-- > 0;) {
    Decompose(nodes_[edges_[e].child]);
    Weigh(edges_[e], blocks[edges_[e].block]);
  }
  for (Node& node : nodes_) {
    if (node.root && !node.world) Decompose(node);
  }
}

void JointForest::Solve(std::span<JointBlock> blocks) {
  for (Node& node : nodes_) node.pull.fill(0);
  for (std::size_t e = edges_.size(); e-- > 0;) {
    Edge& edge = edges_[e];
    const JointBlock& block = blocks[edge.block];
    Node &child = nodes_[edge.child], &parent = nodes_[edge.parent];
    if (!child.leaf) Forward(child.lower, kLockedRows, child.pull);
    for (std::size_t i = 0; i < At(edge.rows); ++i) {
      edge.asked[i] = block.wanted[i] + Dot(edge.below[i], child.pull);
    }
    Forward(edge.lower, At(edge.rows), edge.asked);
    if (parent.world) continue;
    for (std::size_t i = 0; i < At(edge.rows); ++i) AddScaled(parent.pull, -edge.asked[i], edge.above[i]);
  }
  for (Node& node : nodes_) {
    if (!node.root) continue;
    node.change.fill(0);
    if (node.world) continue;
    if (!node.leaf) Forward(node.lower, kLockedRows, node.pull);
    node.change = node.pull;
    if (!node.leaf) Backward(node.lower, kLockedRows, node.change);
  }
  for (Edge& edge : edges_) {
    JointBlock& block = blocks[edge.block];
    Node &child = nodes_[edge.child], &parent = nodes_[edge.parent];
    const std::size_t n = At(edge.rows);
    Vector impulse{};
    for (std::size_t i = 0; i < n; ++i) {
      impulse[i] = -edge.asked[i];
      if (!parent.world) impulse[i] -= Dot(edge.above[i], parent.change);
    }
    Backward(edge.lower, n, impulse);
    // The child changes by L_c^-T (pull + below^T impulse).
    child.change = child.pull;
    for (std::size_t i = 0; i < n; ++i) AddScaled(child.change, impulse[i], edge.below[i]);
    if (!child.leaf) Backward(child.lower, kLockedRows, child.change);
    for (std::size_t i = 0; i < n; ++i) block.found[i] = static_cast<float>(impulse[i]);
  }
}

void JointForest::Push(std::span<JointBlock> blocks, SolvedState* states) const {
  for (const Edge& edge : edges_) {
    JointBlock& block = blocks[edge.block];
    SolvedState &a = states[block.a], &b = states[block.b];
    for (std::size_t i = 0; i < At(edge.rows); ++i) {
      JointRow& row = block.rows[i];
      const float change = block.found[i];
      row.impulse += change;
      Add(a.velocity, row.linear_a * change);
      Add(a.spin, row.angular_a * change);
      Add(b.velocity, row.linear_b * change);
      Add(b.spin, row.angular_b * change);
    }
  }
}

void JointForest::Place(std::span<const JointBlock> blocks, SolvedState* states, const SolvedMass* masses) const {
  for (const Edge& edge : edges_) {
    const JointBlock& block = blocks[edge.block];
    Vec3f move_a, turn_a, move_b, turn_b;  // mass-normalised
    for (std::size_t i = 0; i < At(edge.rows); ++i) {
      const JointRow& row = block.rows[i];
      const float change = block.found[i];
      move_a += row.linear_a * change;
      turn_a += row.angular_a * change;
      move_b += row.linear_b * change;
      turn_b += row.angular_b * change;
    }
    const auto place = [&](std::uint32_t body, Vec3f move, Vec3f turn) {
      Add(states[body].moved, move * masses[body].inverse_root_mass);
      Add(states[body].turned, RootInertia(masses[body]) * turn);
    };
    place(block.a, move_a, turn_a);
    place(block.b, move_b, turn_b);
  }
}

}  // namespace tessera::physics
