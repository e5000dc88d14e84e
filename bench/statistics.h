// Order statistics of measurements. Pure functions, any thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace tessera::bench {

// The value below which `share` (0 to 1) of them lie, between neighbours in proportion; NaN of none.
inline double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(place);
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return values[low] + (place - static_cast<double>(low)) * (values[high] - values[low]);
}

inline double Median(std::vector<double> values) { return Quantile(std::move(values), 0.5); }

}  // namespace tessera::bench
