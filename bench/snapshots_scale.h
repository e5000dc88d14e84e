// How many clients one core shows a world to: the scene `scale` of the suite snapshots.
//
//   clients_per_core    at 30 Hz, each with about 1000 bodies of interest around a place of its own that moves, a tenth
//                       are moving, 2 % of datagrams lost either way, answers 33 to 133 ms late: sealing, ENet and
//                       the system's sending and receiving included
//   *_us                the parts of it, CPU time a client and snapshot
//
// Clients are real ones behind real sockets of this machine; one in twenty reads and checks what it gets, the others
// acknowledge it. Only the region's side is timed.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunScale(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
