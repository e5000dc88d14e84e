// The parts of suite `speed` with several threads: tessera with two against itself with one, and tessera against the
// peers of this year, Box3D and Jolt, with one thread each and with two.
//
// Times are by the clock, and only chunks count in which nothing else took a processor (bench/chunk_clock.h). Peers
// come under the rule that Bullet does: a ratio counts only if tessera's outcome in that very run is no worse.
#pragma once

#include "absl/status/status.h"
#include "bench/crowd_run.h"
#include "bench/report.h"

namespace tessera::bench {

absl::Status RunThreads(const CrowdCase& test, int threads, Report& report);
// Peers that were not built have no rows, nor has a peer in a scene that it cannot hold.
absl::Status RunPeers(const CrowdCase& test, Report& report);

}  // namespace tessera::bench
