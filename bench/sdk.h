// The suite `sdk`: what a game ships, what the client library costs it, and whether any poll costs more than others,
// and how well what a player throws becomes the server's.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunSdk(const SuiteOptions& options, Report& report);

// The parts, in files of their own. `ship`: the folder that a game ships, and the memory of a program that loads it.
absl::Status MeasureShip(bool quick, Report& report);
void MeasureFirstPolls(bool quick, Report& report);
void MeasureLatePolls(bool quick, Report& report);
void MeasureThrows(bool quick, Report& report);
// `frame_instructions` of a frame with 2000 moving bodies, and `frame_instructions_ratio` against another version's,
// both counted by valgrind. Errors: no valgrind, or a program that does not run under it.
absl::Status MeasureFrame(bool quick, Report& report);

// The other version's tessera-frame. Without it there is no ratio.
inline constexpr char kOtherFrameEnvironment[] = "TESSERA_FRAME_OTHER";

}  // namespace tessera::bench
