// StabilityStage: what the checks of the suite `stability` run on and report to. Inside bench only.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "bench/report.h"
#include "bench/trial.h"

namespace tessera::bench {

class StabilityStage {
 public:
  StabilityStage(EngineKind engine, bool quick, Report& report) : engine_(engine), quick_(quick), report_(report) {}

  EngineKind engine() const { return engine_; }
  bool quick() const { return quick_; }
  // Less of what is only repetition where stock or a quick look is enough.
  int Repeats(int full, int few) const { return quick_ || engine_ != EngineKind::kTessera ? few : full; }

  absl::StatusOr<Run> Start(const Scene& scene, double hz = 60, Vec3d origin = {}) const;
  void Note(const std::string& scene, const std::string& config, const std::string& metric, double value,
            const std::string& unit = "1");
  void Cost(const std::string& scene, const std::string& config, double cpu_us_per_tick) {
    Note(scene, config, "cpu_us_per_tick", cpu_us_per_tick, "us");
  }

 private:
  EngineKind engine_;
  bool quick_;
  Report& report_;
};

struct Check {
  std::string name;  // as `--only` takes it
  absl::Status (*run)(StabilityStage&);
  bool stock = false;  // by stock Bullet too
};

std::vector<Check> StackChecks();
std::vector<Check> StructureChecks();
std::vector<Check> JointChecks();
std::vector<Check> ShotChecks();
std::vector<Check> ContactChecks();
std::vector<Check> BoundaryChecks();

// --- What several checks look at. Of dynamic bodies; infinite where a state is not finite.

double FastestOf(const Run& run, const Scene& scene);  // m/s
struct Displacement {
  double sideways_m = 0, down_m = 0, any_m = 0;  // the largest of each, from where they were built
};
Displacement DisplacementOf(const Run& run, const Scene& scene);

}  // namespace tessera::bench
