#include "region_worker/core/view_share.h"

#include <algorithm>

namespace tessera::worker {
namespace {

constexpr double kShareOfHolder = 0.5, kShareOfAll = 0.1;

double Overlap(double low, double high, double other_low, double other_high) {
  return std::max(0.0, std::min(high, other_high) - std::max(low, other_low));
}

}  // namespace

double ViewShare(const PartitionMap& map, RegionId self, Vec3d centre, double radius_m) {
  const auto regions = static_cast<double>(map.regions().size());
  if (regions <= 1) return 1;
  const RegionId holder = map.OwnerOf(centre);
  double own = 0, holders = 0, all = 0;
  for (const Cell& cell : map.cells()) {
    const double area = Overlap(cell.area.min_x, cell.area.max_x, centre.x - radius_m, centre.x + radius_m) *
                        Overlap(cell.area.min_z, cell.area.max_z, centre.z - radius_m, centre.z + radius_m);
    all += area;
    if (cell.owner == self) own += area;
    if (cell.owner == holder) holders += area;
  }
  // Far beyond the world's edge no cell has anything of the view.
  const double of_holder = all > 0 ? std::max(kShareOfHolder, (1 - kShareOfAll) * holders / all) : 1 - kShareOfAll;
  if (self == holder) return of_holder;
  const double others = all - holders;
  const double by_area = others > 0 ? (1 - of_holder - kShareOfAll) * own / others : 0;
  return by_area + kShareOfAll / (regions - 1);
}

}  // namespace tessera::worker
