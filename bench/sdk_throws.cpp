// A player throws balls over a network of 100 ms there and back: how far the server's body is from the one that was
// shown for it, when it takes its place.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bench/sdk.h"
#include "bench/statistics.h"
#include "client_sdk/throw_stage.h"

namespace tessera::bench {

void MeasureThrows(bool quick, Report& report) {
  const auto measure = [&](double loss, std::chrono::milliseconds jitter, const std::string& config) {
    client::ThrowStage stage({.loss = loss, .delay = std::chrono::milliseconds(50), .jitter = jitter});
    const auto need = [&stage](bool fine) {
      if (!fine) throw std::runtime_error(stage.error);
    };
    need(stage.Begin());
    const int throws = quick ? 30 : 500;
    for (int i = 0; i < throws; ++i) {
      if (const auto thrown = stage.ThrowNumber(i); !thrown.ok()) {
        throw std::runtime_error(std::string(thrown.status().message()));
      }
      need(stage.Run(0.4));
    }
    need(stage.Run(1));
    report.Add("throws", "tessera", config, "spawn_jump_m", Quantile(stage.jumps(), 0.99), "m");
    report.Add("throws", "tessera", config, "spawn_jump_median_m", Median(stage.jumps()), "m");
    report.Add("throws", "tessera", config, "spawn_jump_worst_m",
               stage.jumps().empty() ? std::nan("") : std::ranges::max(stage.jumps()), "m");
    report.Add("throws", "tessera", config, "spawns_not_taken",
               static_cast<double>(throws) - static_cast<double>(stage.taken()), "1");
    report.Add("throws", "tessera", config, "spawn_frames_missing", static_cast<double>(stage.missing()), "1");
    report.Add("throws", "tessera", config, "spawn_frames_doubled", static_cast<double>(stage.doubled()), "1");
  };
  measure(0, std::chrono::milliseconds(0), "round_trip_ms=100");
  measure(0.01, std::chrono::milliseconds(10), "round_trip_ms=100 loss=1% jitter_ms=10");
}

}  // namespace tessera::bench
