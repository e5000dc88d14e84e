// BlockCholesky: L transpose(L) of a sparse symmetric positive definite matrix of 6 x 6 blocks, one row of blocks for
// each body and one block for each two bodies that touch.
//
// Bodies are eliminated in the order of least degree (Tinney and Walker's second scheme), so a stack or a tree of
// bodies fills in nothing. Order, blocks and sums depend on the numbers of the bodies alone.
//
//   BlockCholesky matrix;
//   matrix.Analyze(2, edges);      // {{0, 1}}; once for many matrices of the same bodies
//   matrix.Clear();                // the unit matrix
//   matrix.Add(0, 0, block), matrix.Add(0, 1, block), matrix.Add(1, 1, block);
//   if (matrix.Factor()) matrix.Solve(right_side);
//
// Thread rule: one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace tessera::physics {

using Vector6 = std::array<double, 6>;
using Matrix6 = std::array<Vector6, 6>;  // by row

class BlockCholesky {
 public:
  // The matrix may have blocks of such pairs, and of each body by itself.
  void Analyze(std::size_t bodies, std::span<const std::pair<std::uint32_t, std::uint32_t>> edges);

  void Clear();
  // Adds to the block in row `a` and column `b`, and the transpose to the one in row `b` and column `a`. The pair was
  // among the edges, or a = b.
  void Add(std::uint32_t a, std::uint32_t b, const Matrix6& block);
  // Whether all pivots were positive; otherwise `Solve` may not follow.
  bool Factor();
  // Replaces the right side by the solution.
  void Solve(std::span<Vector6> right_side) const;

  std::size_t bodies() const { return place_.size(); }
  std::size_t blocks() const { return blocks_.size(); }  // below the diagonal, fill included

 private:
  // The blocks of a column are those of `rows_` and `blocks_` from its first to that of the next.
  std::span<const std::uint32_t> RowsOf(std::size_t column) const {
    return std::span(rows_).subspan(first_[column], first_[column + 1] - first_[column]);
  }
  Matrix6& BlockAt(std::uint32_t row, std::uint32_t column) {
    return blocks_[static_cast<std::size_t>(slot_[row * bodies() + column])];
  }
  void Eliminate(std::size_t column);

  std::vector<std::uint32_t> place_;  // by body: its place in the order of elimination
  std::vector<std::uint32_t> first_;  // by place
  std::vector<std::uint32_t> rows_;   // places, ascending within a column
  std::vector<std::int32_t> slot_;    // by row and column: the block's place, or -1
  std::vector<Matrix6> diagonal_;     // by place; factored: lower triangle, with inverses on its diagonal
  std::vector<Matrix6> blocks_;
};

}  // namespace tessera::physics
