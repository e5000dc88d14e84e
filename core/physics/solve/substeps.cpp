#include "core/physics/solve/substeps.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

// Largest loads that 1, 2, 4 ... 64 substeps carry: 20 (n / 4)^(2/3), five sixths of the loads that they held in tests.
constexpr float kLoads[] = {7.9f, 12.6f, 20, 31.7f, 50.4f, 80, 127};
constexpr int kLevels = 7;

int LevelOfLoad(float load) {
  int level = 0;
  while (level + 1 < kLevels && load > kLoads[level]) ++level;
  return level;
}

int LevelOfMassRatio(float ratio) {
  int level = 0;
  while (level + 1 < kLevels && ratio > static_cast<float>(4 << (2 * level))) ++level;
  return level;
}

int LevelOf(const IslandDemand& demand, float margin) {
  int level = kFewestLevel;
  level = std::max(level, LevelOfLoad(margin * demand.load_ratio));
  if (demand.joints > 0) level = std::max({level, kFewestJointedLevel, LevelOfMassRatio(demand.mass_ratio)});
  if (margin * demand.joint_error_m > kWideGap_m) level = std::max(level, 3);
  if (margin * demand.penetration_m > kDeep_m) level = std::max(level, 2);
  if (margin * demand.impact_m_s > kFast_m_s) level = std::max(level, 2);
  return level;
}

std::int64_t WorkOf(const IslandWork& island) {
  return std::int64_t{island.contacts + kJointWork * island.joints} * island.substeps;
}

}  // namespace

int SubstepsFor(const IslandDemand& demand) {
  const int wanted = LevelOf(demand, 1);
  if (demand.last <= 0) {
    // No loads are known yet, and no impulses to start from: a heavy body may lie on a light one.
    return 1 << std::max({wanted, kFirstLevel, std::min(LevelOfLoad(demand.mass_ratio), 3)});
  }
  const int last = std::bit_width(static_cast<unsigned>(demand.last)) - 1;
  if (wanted > last) return 1 << (last + 1);
  if (wanted < last && LevelOf(demand, kFewerMargin) < last) return 1 << (last - 1);
  return 1 << last;
}

void KeepBudget(std::span<IslandWork> islands, std::int64_t budget) {
  std::int64_t sum = 0;
  for (const IslandWork& island : islands) sum += WorkOf(island);
  if (sum <= budget) return;
  const auto less = [&](std::size_t a, std::size_t b) {
    const std::int64_t work_a = WorkOf(islands[a]), work_b = WorkOf(islands[b]);
    return work_a != work_b ? work_a < work_b : a > b;
  };
  std::vector<std::size_t> heap;
  for (std::size_t i = 0; i < islands.size(); ++i) {
    if (islands[i].substeps > (1 << kFewestLevel)) heap.push_back(i);
  }
  std::make_heap(heap.begin(), heap.end(), less);
  while (sum > budget && !heap.empty()) {
    std::pop_heap(heap.begin(), heap.end(), less);
    IslandWork& greediest = islands[heap.back()];
    sum -= WorkOf(greediest) / 2;
    greediest.substeps /= 2;
    if (greediest.substeps > (1 << kFewestLevel)) {
      std::push_heap(heap.begin(), heap.end(), less);
    } else {
      heap.pop_back();
    }
  }
}

}  // namespace tessera::physics
