// What of a pile is shown to a neighbour beyond what reaches it: so many contacts deep, and all of it if it is small.
#include <algorithm>
#include <numeric>

#include "core/region/step.h"

namespace tessera::region {

// Layer by layer.
void RegionStep::ShowDeeper() {
  std::vector<std::size_t> found;
  for (std::uint32_t layer = 0; layer < config.settings.ghost_depth; ++layer) {
    for (std::size_t n = 0; n < neighbors.size(); ++n) {
      found.clear();
      for (const auto& [a, b] : touching_) {
        const std::ptrdiff_t i = bodies.IndexOf(a), j = bodies.IndexOf(b);
        if (i < 0 || j < 0) continue;
        const auto one = static_cast<std::size_t>(i), other = static_cast<std::size_t>(j);
        if (reach.Shows(one, n) != reach.Shows(other, n)) found.push_back(reach.Shows(one, n) ? other : one);
      }
      for (const std::size_t index : found) reach.Show(index, n);
    }
  }
}

// What touches hangs together, be it through bodies of others; so do the bodies of an assembly. A region that has
// little of it shows it all to whom it shows any: then all solve the same, and come to the same.
void RegionStep::ShowWhole() {
  const std::size_t own = bodies.owned().size();
  if (config.settings.whole_up_to < 2 || touching_.empty() || !reach.ShowsAnything()) return;
  std::vector<std::size_t> parent(own + bodies.ghosts().size());  // as by Bodies::PlaceOf
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t node) {
    while (parent[node] != node) node = parent[node] = parent[parent[node]];
    return node;
  };
  const auto unite = [&](std::size_t a, std::size_t b) {
    const std::size_t one = root(a), other = root(b);
    parent[std::max(one, other)] = std::min(one, other);
  };
  for (const auto& [a, b] : touching_) {
    const std::ptrdiff_t i = bodies.PlaceOf(a), j = bodies.PlaceOf(b);
    if (i >= 0 && j >= 0) unite(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
  }
  if (!config.scene->joints.empty()) {
    for (std::size_t i = 0; i < own; ++i) {
      const std::ptrdiff_t anchor = bodies.IndexOf(catalog.AssemblyOf(bodies.owned()[i].def->id).front());
      if (anchor >= 0) unite(i, static_cast<std::size_t>(anchor));
    }
  }
  // Own ones of each, in order; the lowest of what hangs together is its root, and an own one if it has any.
  std::vector<std::size_t> count(own, 0);
  for (std::size_t i = 0; i < own; ++i) ++count[root(i)];
  std::vector<std::vector<std::size_t>> parts(own);
  for (std::size_t i = 0; i < own; ++i) {
    const std::size_t of = root(i);
    if (count[of] > 1 && count[of] <= config.settings.whole_up_to) parts[of].push_back(i);
  }
  for (const std::vector<std::size_t>& part : parts) {
    if (!part.empty()) reach.Unite(part);
  }
}

}  // namespace tessera::region
