// BorderStage: shared by the checks of the suite `borders`. It cuts a scene, runs it and compares it with one world.
//
// Thread rule: one thread at a time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bench/borders_instance.h"
#include "bench/report.h"
#include "scenes/measured/across.h"

namespace tessera::bench {

// A scene and the map that cuts it.
struct CutScene {
  std::shared_ptr<const Scene> scene;
  PartitionMap map;
};
// By the grid, with cells of `cell_m`.
CutScene CutBy(Scene scene, std::uint32_t regions, double cell_m);

// How an instance is run, and how its column is called.
struct Manner {
  std::string name;  // "regions=2", "regions=2 depth=1 ..."
  std::uint32_t regions = 1;
  region::RegionSettings settings;
  bool pinned = false;  // no body changes hands
};

class BorderStage {
 public:
  BorderStage(bool quick, Report& report) : quick_(quick), report_(report) {}
  bool quick() const { return quick_; }
  int Few(int full, int few) const { return quick_ ? few : full; }
  void Note(const std::string& scene, const std::string& config, const std::string& metric, double value,
            const std::string& unit = "1");
  // To stderr, so that a long run is seen to go on.
  static void Progress(const std::string& what);

 private:
  bool quick_;
  Report& report_;
};

// With the committed settings.
Manner Regions(std::uint32_t regions, bool pinned = false);
std::unique_ptr<BorderInstance> Start(const CutScene& cut, const Manner& manner, bool keep_frames = false);

struct BorderCheck {
  std::string name;  // as `--only` takes it
  void (*run)(BorderStage&);
};

std::vector<BorderCheck> PairChecks();
std::vector<BorderCheck> MomentumChecks();
std::vector<BorderCheck> OutcomeChecks();
std::vector<BorderCheck> BorderCostChecks();
std::vector<BorderCheck> PredictorChecks();

}  // namespace tessera::bench
