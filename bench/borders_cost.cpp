// The cost of borders: CPU time of regions against that of one world, each run by itself, in turns; handovers; growth.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "bench/borders_stage.h"
#include "bench/statistics.h"
#include "scenes/measured/stacks.h"

namespace tessera::bench {
namespace {

constexpr double kCell_m = 24;  // side of each cell
constexpr int kTurn = 25;       // ticks that a region runs before the next one's turn

// CPU time of each region of an instance, run again one at a time, s.
std::vector<double> AloneSeconds(std::vector<std::unique_ptr<LoneRegion>>& regions, int ticks) {
  std::vector<double> seconds(regions.size());
  for (int done = 0; done < ticks; done += kTurn) {
    for (std::size_t i = 0; i < regions.size(); ++i) seconds[i] += regions[i]->Seconds(std::min(kTurn, ticks - done));
  }
  return seconds;
}

void CutPyramid(BorderStage& stage) {
  const int ticks = stage.Few(500, 120);
  const int rounds = stage.Few(3, 1);
  const Scene scene = scenes::Pyramid(15);
  std::vector<Manner> manners{Regions(1), Regions(2), Regions(4)};
  std::vector<std::unique_ptr<BorderInstance>> instances;
  std::vector<CutScene> cuts;
  for (const Manner& manner : manners) {
    cuts.push_back(CutBy(scene, manner.regions, 40));
    instances.push_back(Start(cuts.back(), manner, true));
    instances.back()->Ticks(ticks);
  }
  std::vector<std::vector<double>> largest(3), total(3);
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::unique_ptr<LoneRegion>> all;
    for (std::size_t i = 0; i < manners.size(); ++i) {
      for (std::uint32_t id = 1; id <= manners[i].regions; ++id) {
        all.push_back(std::make_unique<LoneRegion>(cuts[i].scene, cuts[i].map,
                                                   BorderSettings{manners[i].settings, false}, RegionId(id),
                                                   instances[i]->received()));
      }
    }
    const std::vector<double> seconds = AloneSeconds(all, ticks);
    std::size_t at = 0;
    for (std::size_t i = 0; i < manners.size(); ++i) {
      const auto begin = seconds.begin() + static_cast<std::ptrdiff_t>(at);
      const auto end = begin + static_cast<std::ptrdiff_t>(manners[i].regions);
      largest[i].push_back(*std::max_element(begin, end));
      total[i].push_back(std::accumulate(begin, end, 0.0));
      at += manners[i].regions;
    }
  }
  const double one = Median(total[0]);
  stage.Note("pyramid cost", "regions=1", "cpu_per_tick", one / ticks, "s");
  for (const std::size_t i : {std::size_t{1}, std::size_t{2}}) {
    const std::string& name = manners[i].name;
    stage.Note("pyramid cost", name, "cpu_per_tick", Median(total[i]) / ticks, "s");
    stage.Note("pyramid cost", name, "largest_region_cpu_ratio", Median(largest[i]) / one);
    stage.Note("pyramid cost", name, "total_cpu_ratio", Median(total[i]) / one);
    stage.Note("pyramid cost", name, "ghosts_per_body", instances[i]->ghosts_per_body());
    stage.Note("pyramid cost", name, "bytes_per_tick", static_cast<double>(instances[i]->frame_bytes()) / ticks,
               "bytes");
  }
}

// 4, 16 and 64 regions, each with the same to do; in turns, each held against the 4 of its own turn.
void Growth(BorderStage& stage) {
  const int ticks = stage.Few(240, 60);
  const int rounds = stage.Few(5, 1);
  struct Size {
    Manner manner;
    CutScene cut;
    std::unique_ptr<BorderInstance> instance;
    std::vector<double> mean_s, largest_s, growth;  // by round
  };
  std::vector<Size> sizes;
  for (const int side : stage.quick() ? std::vector<int>{2, 4} : std::vector<int>{2, 4, 8}) {
    const auto scene = std::make_shared<const Scene>(scenes::EqualCells(side, kCell_m));
    const auto count = static_cast<std::uint32_t>(side * side);
    BorderStage::Progress(fmt::format("growth, {} regions", count));
    Size& size = sizes.emplace_back(Size{Regions(count), {scene, scenes::GridOf(*scene, count)}, {}, {}, {}, {}});
    size.instance = Start(size.cut, size.manner, true);
    size.instance->Ticks(ticks);
  }
  for (int round = 0; round < rounds; ++round) {
    for (Size& size : sizes) {
      std::vector<double> each;
      for (std::uint32_t id = 1; id <= size.manner.regions; ++id) {
        LoneRegion alone(size.cut.scene, size.cut.map, {size.manner.settings, false}, RegionId(id),
                         size.instance->received());
        each.push_back(alone.Seconds(ticks) / ticks);
      }
      size.mean_s.push_back(std::accumulate(each.begin(), each.end(), 0.0) / static_cast<double>(each.size()));
      size.largest_s.push_back(*std::max_element(each.begin(), each.end()));
      size.growth.push_back(size.mean_s.back() / sizes.front().mean_s.back());
    }
  }
  for (Size& size : sizes) {
    const std::string& name = size.manner.name;
    stage.Note("growth", name, "cpu_per_region", Median(size.mean_s), "s");
    stage.Note("growth", name, "cpu_of_largest", Median(size.largest_s), "s");
    stage.Note("growth", name, "cpu_per_region_growth", Median(size.growth));
    stage.Note("growth", name, "cpu_per_region_growth_least",
               *std::min_element(size.growth.begin(), size.growth.end()));
    stage.Note("growth", name, "cpu_per_region_growth_most", *std::max_element(size.growth.begin(), size.growth.end()));
    stage.Note("growth", name, "bytes_per_region_tick",
               static_cast<double>(size.instance->frame_bytes()) / ticks / size.manner.regions, "bytes");
    stage.Note("growth", name, "handovers", static_cast<double>(size.instance->handovers()));
  }
}

// From when a body is first beyond the hysteresis to the step that its new owner makes.
void HandoverDelay(BorderStage& stage) {
  const auto scene = std::make_shared<const Scene>(scenes::EqualCells(2, kCell_m));
  const Manner manner = Regions(4);
  const auto instance = Start({scene, scenes::GridOf(*scene, 4)}, manner);
  instance->Ticks(stage.Few(1800, 300));
  const double tick_s = 1.0 / scene->tick_rate_hz;
  stage.Note("handover", manner.name, "handovers", static_cast<double>(instance->handover_ticks().size()));
  stage.Note("handover", manner.name, "handover_delay_p50", Quantile(instance->handover_ticks(), 0.5) * tick_s, "s");
  stage.Note("handover", manner.name, "handover_delay_p99", Quantile(instance->handover_ticks(), 0.99) * tick_s, "s");
  stage.Note("handover", manner.name, "ghosts_per_body", instance->ghosts_per_body());
}

}  // namespace

std::vector<BorderCheck> BorderCostChecks() {
  return {{"pyramid cost", CutPyramid}, {"growth", Growth}, {"handover", HandoverDelay}};
}

}  // namespace tessera::bench
