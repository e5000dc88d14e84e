// How long a client's command takes: ticks from its arrival at the region to the snapshot that shows its effect.
//
// Thread rule: one thread.
#pragma once

#include "bench/report.h"

namespace tessera::bench {

// `count` commands, in a region with a standby that has the log of a tick one tick later.
void MeasureCommands(int count, Report& report);

}  // namespace tessera::bench
