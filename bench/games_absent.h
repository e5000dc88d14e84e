// MeasureAbsent: the price that a world without a game pays because games are possible, in instructions against an
// earlier version, counted by valgrind, which needs no counters of the processor.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"

namespace tessera::bench {

// The other version's tessera-bench. Without it nothing is measured.
inline constexpr char kOtherBenchEnvironment[] = "TESSERA_BENCH_OTHER";

// Reports `game_absent_ratio` of a world of four regions whose bodies cross: of all instructions (config "all"), and of
// those outside of World::Step, which have no physics to hide behind (config "outside physics"). Errors: no valgrind,
// or a program that does not run under it.
absl::Status MeasureAbsent(Report& report);

}  // namespace tessera::bench
