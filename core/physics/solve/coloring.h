// Coloring: which constraints may be solved at the same time.
//
// Each constraint gets the lowest color that neither of its moving bodies has yet, in the order given. So its color
// depends only on constraints that reach it through moving bodies, never on another island. A constraint that finds all
// colors taken is left over, to be solved by itself.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/solve/solver.h"

namespace tessera::physics {

inline constexpr int kColors = 64;
inline constexpr std::uint8_t kLeftOver = kColors;

class Coloring {
 public:
  void Color(const SolveBatch& batch);

  std::span<const std::uint8_t> contacts() const { return contacts_; }
  std::span<const std::uint8_t> joints() const { return joints_; }
  int used() const { return used_; }  // colors in use: 0 to kColors

 private:
  std::uint8_t Take(std::uint32_t a, std::uint32_t b);

  std::vector<std::uint64_t> taken_;  // colors of each body, a bit each
  std::vector<std::uint8_t> contacts_, joints_;
  int used_ = 0;
};

}  // namespace tessera::physics
