#include "core/physics/solve/block_cholesky.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tessera::physics {
namespace {

// Replaces the lower triangle of a symmetric matrix by its factor, with the inverses of the pivots on the diagonal.
bool FactorBlock(Matrix6& m) {
  for (std::size_t j = 0; j < 6; ++j) {
    double pivot = m[j][j];
    for (std::size_t k = 0; k < j; ++k) pivot -= m[j][k] * m[j][k];
    if (!(pivot > 0)) return false;
    const double inverse = 1 / std::sqrt(pivot);
    m[j][j] = inverse;
    for (std::size_t i = j + 1; i < 6; ++i) {
      double sum = m[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= m[i][k] * m[j][k];
      m[i][j] = sum * inverse;
    }
  }
  return true;
}

// block * inverse(transpose(lower)).
void DivideByFactor(const Matrix6& lower, Matrix6& block) {
  for (Vector6& row : block) {
    for (std::size_t j = 0; j < 6; ++j) {
      double sum = row[j];
      for (std::size_t k = 0; k < j; ++k) sum -= row[k] * lower[j][k];
      row[j] = sum * lower[j][j];
    }
  }
}

// to -= a transpose(b).
void SubtractProduct(const Matrix6& a, const Matrix6& b, Matrix6& to) {
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      double sum = 0;
      for (std::size_t k = 0; k < 6; ++k) sum += a[i][k] * b[j][k];
      to[i][j] -= sum;
    }
  }
}

}  // namespace

void BlockCholesky::Analyze(std::size_t bodies, std::span<const std::pair<std::uint32_t, std::uint32_t>> edges) {
  place_.assign(bodies, 0);
  slot_.assign(bodies * bodies, -1);
  std::vector<std::vector<bool>> linked(bodies, std::vector<bool>(bodies, false));
  for (const auto& [a, b] : edges) linked[a][b] = linked[b][a] = true;
  std::vector<std::uint32_t> order;
  std::vector<std::vector<std::uint32_t>> columns;  // bodies that are linked to the eliminated one, by place
  std::vector<bool> done(bodies, false);
  for (std::size_t place = 0; place < bodies; ++place) {
    std::size_t best = bodies;
    std::ptrdiff_t least = 0;
    for (std::size_t i = 0; i < bodies; ++i) {
      if (done[i]) continue;
      const std::ptrdiff_t degree = std::count(linked[i].begin(), linked[i].end(), true);
      if (best == bodies || degree < least) {
        best = i;
        least = degree;
      }
    }
    done[best] = true;
    place_[best] = static_cast<std::uint32_t>(place);
    std::vector<std::uint32_t>& column = columns.emplace_back();
    for (std::uint32_t i = 0; i < bodies; ++i) {
      if (linked[best][i]) column.push_back(i);
    }
    for (const std::uint32_t i : column) {
      linked[i][best] = false;
      for (const std::uint32_t j : column) linked[i][j] = linked[i][j] || i != j;
    }
  }
  first_.assign(1, 0);
  rows_.clear();
  for (std::size_t place = 0; place < bodies; ++place) {
    std::vector<std::uint32_t>& column = columns[place];
    for (std::uint32_t& body : column) body = place_[body];
    std::sort(column.begin(), column.end());
    for (const std::uint32_t row : column) {
      slot_[row * bodies + place] = static_cast<std::int32_t>(rows_.size());
      rows_.push_back(row);
    }
    first_.push_back(static_cast<std::uint32_t>(rows_.size()));
  }
  diagonal_.resize(bodies);
  blocks_.resize(rows_.size());
}

void BlockCholesky::Clear() {
  Matrix6 unit{};
  for (std::size_t i = 0; i < 6; ++i) unit[i][i] = 1;
  std::fill(diagonal_.begin(), diagonal_.end(), unit);
  std::fill(blocks_.begin(), blocks_.end(), Matrix6{});
}

void BlockCholesky::Add(std::uint32_t a, std::uint32_t b, const Matrix6& block) {
  const std::uint32_t row = place_[a], column = place_[b];
  assert(row == column || slot_[std::max(row, column) * bodies() + std::min(row, column)] >= 0);
  Matrix6& to = row == column ? diagonal_[row] : BlockAt(std::max(row, column), std::min(row, column));
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) to[i][j] += row >= column ? block[i][j] : block[j][i];
  }
}

void BlockCholesky::Eliminate(std::size_t column) {
  const std::span<const std::uint32_t> rows = RowsOf(column);
  Matrix6* const blocks = blocks_.data() + first_[column];
  for (std::size_t i = 0; i < rows.size(); ++i) {
    DivideByFactor(diagonal_[column], blocks[i]);
    SubtractProduct(blocks[i], blocks[i], diagonal_[rows[i]]);
    for (std::size_t j = 0; j < i; ++j) SubtractProduct(blocks[i], blocks[j], BlockAt(rows[i], rows[j]));
  }
}

bool BlockCholesky::Factor() {
  for (std::size_t column = 0; column < bodies(); ++column) {
    if (!FactorBlock(diagonal_[column])) return false;
    Eliminate(column);
  }
  return true;
}

void BlockCholesky::Solve(std::span<Vector6> right_side) const {
  std::vector<Vector6> x(bodies());
  for (std::size_t i = 0; i < bodies(); ++i) x[place_[i]] = right_side[i];
  for (std::size_t column = 0; column < bodies(); ++column) {
    const Matrix6& lower = diagonal_[column];
    Vector6& y = x[column];
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t k = 0; k < i; ++k) y[i] -= lower[i][k] * y[k];
      y[i] *= lower[i][i];
    }
    for (std::uint32_t at = first_[column]; at < first_[column + 1]; ++at) {
      Vector6& below = x[rows_[at]];
      for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t k = 0; k < 6; ++k) below[i] -= blocks_[at][i][k] * y[k];
      }
    }
  }
  for (std::size_t column = bodies(); column-- > 0;) {
    const Matrix6& lower = diagonal_[column];
    Vector6& y = x[column];
    for (std::uint32_t at = first_[column]; at < first_[column + 1]; ++at) {
      const Vector6& below = x[rows_[at]];
      for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t k = 0; k < 6; ++k) y[k] -= blocks_[at][i][k] * below[i];
      }
    }
    for (std::size_t i = 6; i-- > 0;) {
      for (std::size_t k = i + 1; k < 6; ++k) y[i] -= lower[k][i] * y[k];
      y[i] *= lower[i][i];
    }
  }
  for (std::size_t i = 0; i < bodies(); ++i) right_side[i] = x[place_[i]];
}

}  // namespace tessera::physics
