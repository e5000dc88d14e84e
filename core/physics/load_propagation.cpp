#include "core/physics/load_propagation.h"

#include <algorithm>
#include <numeric>

#include "core/physics/active_contact.h"
#include "core/physics/tuning.h"

namespace tessera::physics {

// Puts the supports of one body side by side, in the order of their pairs, and the bodies from the top down.
void LoadPropagation::Group(std::span<const Support> supports, std::span<const BodyWeight> weights) {
  uppers_.clear();
  first_.assign(weights.size() + 2, 0);
  for (const Support& support : supports) {
    if (first_[support.upper + 2]++ == 0) uppers_.emplace_back(weights[support.upper].height_m, support.upper);
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  grouped_.resize(supports.size());
  for (const Support& support : supports) grouped_[first_[support.upper + 1]++] = support;
  std::sort(uppers_.begin(), uppers_.end(), [weights](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : weights[a.second].id < weights[b.second].id;
  });
}

std::span<const PropagatedLoad> LoadPropagation::Run(std::span<const Support> supports, std::span<BodyWeight> weights) {
  loads_.clear();
  if (supports.empty()) return {};
  Group(supports, weights);
  for (const auto& [height_m, upper] : uppers_) {
    const BodyWeight& weight = weights[upper];
    const std::uint32_t first = first_[upper], last = first_[upper + 1];
    const double equal_share = weight.supported_kg / (last - first);
    const double column = last - first == 1 && !weight.externally_supported ? kColumnLoad : 1;
    float largest = 0;
    for (std::uint32_t i = first; i < last; ++i) {
      const Support& support = grouped_[i];
      const bool firm = support.lower == kAsleep;
      const double share = support.known_kg < 0 ? equal_share : support.known_kg;
      const double lighter =
          firm ? weight.connected_kg : std::min(weights[support.lower].connected_kg, weight.connected_kg);
      largest = std::max(largest, static_cast<float>(column * support.scale * share / lighter));
      if (!firm) weights[support.lower].supported_kg += share;
    }
    loads_.push_back({upper, largest});
  }
  return loads_;
}

}  // namespace tessera::physics
