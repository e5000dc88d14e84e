// Scene `character` of the suite `games`: how often what a client shows of its own character has to be corrected.
#pragma once

#include "bench/report.h"

namespace tessera::bench {

void MeasureCharacter(bool quick, Report& report);

}  // namespace tessera::bench
