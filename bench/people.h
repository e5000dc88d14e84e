// The suite people: what it costs to show a world to people. Real clusters and gateways on this machine; what is
// compared is measured in turns within one run. About 20 minutes; `--only` selects, and `--csv` keeps what is known
// after each scene.
//
//   ready     a gateway starts beside a running world: from its address to the first frame over the socket
//   viewers   CPU and bytes of one viewer and of further ones, against an SDK client of the same world
//   slow      50 viewers that read at a tenth of the rate: the gateway's memory, and the delay of another viewer
//   gap       kill -9 of a worker: how much later its bodies move again for a viewer than for an SDK client
//   swarm     players of one process against as many processes of `tessera client`
//   page      what a browser loads of a gateway; then frames and script of the page against a bare page
//
// An SDK client here is one that watches the world, is polled 60 times a second and read 30 times, as the one inside a
// gateway is. CPU time is all that a process or a thread used, by its own clock.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunPeople(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
