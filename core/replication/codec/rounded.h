// RoundedQuotient: division of integers to the nearest, halves away from zero.
#pragma once

#include <cstdint>

namespace tessera::replication {

// Requires denominator > 0, and a sum of both that fits.
constexpr std::int64_t RoundedQuotient(std::int64_t numerator, std::int64_t denominator) {
  return numerator >= 0 ? (numerator + denominator / 2) / denominator : -((-numerator + denominator / 2) / denominator);
}

}  // namespace tessera::replication
