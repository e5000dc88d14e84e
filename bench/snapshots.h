// Snapshots: what showing a world costs. Scene `cubes901`: one recorded trace of 901 cubes (snapshots_trace.h) through
// the steps of the reference's bit packer and through our codecs: bits a cube, kbit/s, the time to write and to read,
// the error. Every datagram is read back and compared; a difference fails the run. `seeds`: the coders' ratios on other
// traces. `loss`, `join`, `render`: snapshots_net.h; `scale`: snapshots_scale.h; `acceptor`: acceptor.h.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunSnapshots(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
