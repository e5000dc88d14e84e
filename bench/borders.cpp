#include "bench/borders.h"

#include <fmt/format.h>

#include <chrono>
#include <iostream>
#include <stdexcept>

#include "bench/borders_stage.h"

namespace tessera::bench {
namespace {

constexpr double kPinned_m = 1e9;  // hysteresis that no body leaves

}  // namespace

CutScene CutBy(Scene scene, std::uint32_t regions, double cell_m) {
  scenes::Cut(scene, regions, cell_m);
  const PartitionMap map = scenes::GridOf(scene, regions);
  return {std::make_shared<const Scene>(std::move(scene)), map};
}

Manner Regions(std::uint32_t regions, bool pinned) {
  Manner manner{fmt::format("regions={}", regions), regions, {}, pinned};
  if (pinned) manner.settings.hysteresis_m = kPinned_m;
  return manner;
}

std::unique_ptr<BorderInstance> Start(const CutScene& cut, const Manner& manner, bool keep_frames) {
  return std::make_unique<BorderInstance>(cut.scene, cut.map, BorderSettings{manner.settings, keep_frames});
}

void BorderStage::Note(const std::string& scene, const std::string& config, const std::string& metric, double value,
                       const std::string& unit) {
  report_.Add(scene, "tessera", config, metric, value, unit);
}

void BorderStage::Progress(const std::string& what) { std::cerr << fmt::format("borders: {}\n", what) << std::flush; }

absl::Status RunBorders(const SuiteOptions& options, Report& report) {
  BorderStage stage(options.quick, report);
  bool any = false;
  const auto begun = std::chrono::steady_clock::now();
  for (const auto& checks : {PairChecks(), MomentumChecks(), OutcomeChecks(), BorderCostChecks(), PredictorChecks()}) {
    for (const BorderCheck& check : checks) {
      if (check.name.find(options.only) == std::string::npos) continue;
      const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begun;
      BorderStage::Progress(fmt::format("{}, after {:.0f} s", check.name, passed.count()));
      check.run(stage);
      any = true;
      // A whole run takes long: what it has is kept should it be broken off.
      if (absl::Status saved = report.Save(); !saved.ok()) return saved;
    }
  }
  if (!any) return absl::InvalidArgumentError(fmt::format("no scene of borders is called '{}'", options.only));
  return absl::OkStatus();
}

}  // namespace tessera::bench
