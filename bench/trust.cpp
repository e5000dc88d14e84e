#include "bench/trust.h"

#include <exception>
#include <iostream>
#include <string>

#include "bench/trust_scenes.h"

namespace tessera::bench {
namespace {

constexpr TrustSize kTrustFull{.calls = 2000,
                               .import_mb = 512,
                               .lease_requests = 200'000,
                               .join_threads = 16,
                               .joins_each = 300,
                               .starts = 20,
                               .creations = 20,
                               .rounds = 6,
                               .span_s = 10,
                               .bodies = 400,
                               .regions = 16,
                               .evictions = 5,
                               .churn_joins = 100'000,
                               .churn_worlds = 10'000,
                               .churn_readings = 10,
                               .full_players = 10'000};
constexpr TrustSize kTrustQuick{.calls = 300,
                                .import_mb = 512,
                                .lease_requests = 100'000,
                                .join_threads = 8,
                                .joins_each = 50,
                                .starts = 3,
                                .creations = 3,
                                .rounds = 2,
                                .span_s = 4,
                                .bodies = 200,
                                .regions = 8,
                                .evictions = 1,
                                .churn_joins = 3000,
                                .churn_worlds = 300,
                                .churn_readings = 2,
                                .full_players = 500};

struct TrustScene {
  const char* name;
  absl::Status (*run)(const TrustSize&, Report&);
};

constexpr TrustScene kTrustScenes[] = {{"attacks", RunAttacks},    {"start", RunStart},     {"create", RunCreate},
                                       {"ticks", RunFloodedTicks}, {"evict", RunEvictions}, {"full", RunFull},
                                       {"churn", RunChurn}};

absl::Status TryScene(const TrustScene& scene, const TrustSize& size, Report& report) {
  try {
    return scene.run(size, report);
  } catch (const std::exception& error) {  // a program could not be started
    return absl::InternalError(error.what());
  }
}

}  // namespace

absl::Status RunTrust(const SuiteOptions& options, Report& report) {
  const TrustSize& size = options.quick ? kTrustQuick : kTrustFull;
  absl::Status worst = absl::OkStatus();
  for (const TrustScene& scene : kTrustScenes) {
    if (std::string(scene.name).find(options.only) == std::string::npos) continue;
    // A scene that fails is reported, and leaves the others their turn.
    const absl::Status status = TryScene(scene, size, report);
    if (!status.ok()) {
      std::cerr << "trust: " << scene.name << ": " << status.message() << "\n";
      worst = status;
    }
    if (absl::Status saved = report.Save(); !saved.ok()) return saved;
  }
  return worst;
}

}  // namespace tessera::bench
