// Scene `reload` of the suite `games`: another game takes the place of the one that runs, with eight players.
#pragma once

#include "bench/report.h"

namespace tessera::bench {

void MeasureReload(Report& report);

}  // namespace tessera::bench
