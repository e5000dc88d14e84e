// JointForest: the locked rows of connected joints, solved at once.
//
// Joints that connect bodies into chains and trees make a system without cycles, which elimination from the leaves to
// the root solves exactly in time linear in their number (Featherstone 1983; Baraff, "Linear-Time Dynamics using
// Lagrange Multipliers", 1996). Joint by joint, a chain of 32 links that carries 1000 times the mass of one would take
// thousands of sweeps. A joint that closes a cycle, to the world or otherwise, is left to be solved by itself; so is
// one that has no neighbour.
//
//   K_p = 1 + sum over children c of J_p^T W J_p,   W = (J_c K_c^-1 J_c^T)^-1
//
// is the inertia of body p with all that hangs below it, in mass-normalised coordinates; the rows ask for c + J dv = 0.
// All of it is computed in doubles: masses of 1 and 1000 in one chain leave floats with few true digits.
//
// Which joints are in a tree, and the order in which they are worked off, depend on the island alone.
// Thread rule: one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/solve/joint_block.h"

namespace tessera::physics {

class JointForest {
 public:
  // Finds the trees, and marks the blocks that are in one. `order` has the blocks by ascending id of their joints;
  // `nobody` is the body that stands for the world.
  void Grow(std::span<JointBlock> blocks, std::span<const std::uint32_t> order, std::uint32_t nobody);
  // Factors the system, after rows were made; the factors hold until the rows change again.
  void Factor(std::span<const JointBlock> blocks);
  // Finds the impulses along the locked rows by which all of them together lose the velocities in `wanted`; writes them
  // to `found`.
  void Solve(std::span<JointBlock> blocks);
  // Gives `found` to the bodies, as impulses or as shifts of their places.
  void Push(std::span<JointBlock> blocks, SolvedState* states) const;
  void Place(std::span<const JointBlock> blocks, SolvedState* states, const SolvedMass* masses) const;

  bool empty() const { return edges_.empty(); }

 private:
  using Vector = std::array<double, kLockedRows>;
  using Rows = std::array<Vector, kLockedRows>;

  struct Edge {
    std::uint32_t block = 0, child = 0, parent = 0;  // child and parent are places in `nodes_`
    bool child_is_b = false;
    int rows = 0;
    Rows below{};    // L_c^-1 J_c^T, where K_c = L_c L_c^T; by row of the joint
    Rows lower{};    // L_s of S = J_c K_c^-1 J_c^T, with an inverted diagonal
    Rows above{};    // L_s^-1 J_p
    Vector asked{};  // L_s^-1 times the velocities that the rows are to lose
  };
  struct Node {
    bool world = false;
    bool root = true;  // It is no joint's child.
    bool leaf = true;  // Nothing hangs on it, so K is 1.
    Rows lower{};      // K, then L with an inverted diagonal
    Vector pull{}, change{};
  };

  void Link(std::span<JointBlock> blocks, std::span<const std::uint32_t> order, std::uint32_t nobody);
  std::uint32_t Root(std::uint32_t body);
  std::uint32_t NodeOf(std::uint32_t body, std::uint32_t nobody);
  void Walk(std::span<const JointBlock> blocks, std::uint32_t nobody);
  void Weigh(Edge& edge, const JointBlock& block);
  static void Decompose(Node& node);

  std::vector<Edge> edges_;  // parents before children
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> roots_;            // parents in a disjoint set forest, by body
  std::vector<std::uint32_t> links_;            // blocks in a tree, in order
  std::vector<std::uint32_t> degrees_;          // number of joints in a tree, by body
  std::vector<std::uint32_t> starts_, beside_;  // by body, where its blocks begin in `beside_`; and those blocks
  std::vector<std::uint32_t> node_of_;          // place in `nodes_`, by body
  std::vector<std::uint32_t> queue_;
  std::vector<bool> taken_;  // by block
};

}  // namespace tessera::physics
