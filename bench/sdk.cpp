#include "bench/sdk.h"

namespace tessera::bench {

absl::Status RunSdk(const SuiteOptions& options, Report& report) {
  const auto wanted = [&](const std::string& scene) { return scene.find(options.only) != std::string::npos; };
  if (wanted("ship")) {
    if (absl::Status status = MeasureShip(options.quick, report); !status.ok()) return status;
  }
  if (wanted("first_polls")) MeasureFirstPolls(options.quick, report);
  if (wanted("late_polls")) MeasureLatePolls(options.quick, report);
  if (wanted("frame")) {
    if (absl::Status status = MeasureFrame(options.quick, report); !status.ok()) return status;
  }
  if (wanted("throws")) MeasureThrows(options.quick, report);
  return absl::OkStatus();
}

}  // namespace tessera::bench
