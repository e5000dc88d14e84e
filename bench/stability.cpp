#include "bench/stability.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "bench/stability_stage.h"

namespace tessera::bench {

absl::StatusOr<Run> StabilityStage::Start(const Scene& scene, double hz, Vec3d origin) const {
  Trial trial{.engine = engine_, .config = {}, .hz = hz};
  trial.config.origin = origin;
  return Run::Start(trial, scene);
}

void StabilityStage::Note(const std::string& scene, const std::string& config, const std::string& metric, double value,
                          const std::string& unit) {
  report_.Add(scene, std::string(EngineName(engine_)), config, metric, value, unit);
}

double FastestOf(const Run& run, const Scene& scene) {
  double fastest = 0;
  for (const BodyDef& body : scene.bodies) {
    if (body.motion == Motion::kStatic) continue;
    const BodyState state = run.StateOf(body.id);
    if (!IsFinite(state)) return std::numeric_limits<double>::infinity();
    fastest = std::max(fastest, Length(Vec3d(state.linear_velocity)));
  }
  return fastest;
}

Displacement DisplacementOf(const Run& run, const Scene& scene) {
  Displacement most;
  for (const BodyDef& body : scene.bodies) {
    if (body.motion == Motion::kStatic) continue;
    const BodyState state = run.StateOf(body.id);
    const Vec3d moved = state.position - body.initial.position;
    if (!IsFinite(state)) most.sideways_m = most.down_m = most.any_m = std::numeric_limits<double>::infinity();
    most.sideways_m = std::max(most.sideways_m, std::hypot(moved.x, moved.z));
    most.down_m = std::max(most.down_m, -moved.y);
    most.any_m = std::max(most.any_m, Length(moved));
  }
  return most;
}

absl::Status RunStability(const SuiteOptions& options, Report& report) {
  for (const auto& checks :
       {StackChecks(), StructureChecks(), JointChecks(), ShotChecks(), ContactChecks(), BoundaryChecks()}) {
    for (const Check& check : checks) {
      if (check.name.find(options.only) == std::string::npos) continue;
      for (const EngineKind engine : {EngineKind::kTessera, EngineKind::kBullet}) {
        if (engine == EngineKind::kBullet && !check.stock) continue;
        std::fprintf(stderr, "stability: %s in %s\n", check.name.c_str(), std::string(EngineName(engine)).c_str());
        StabilityStage stage(engine, options.quick, report);
        if (absl::Status status = check.run(stage); !status.ok()) return status;
      }
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
