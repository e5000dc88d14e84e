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

}  // namespace tessera::bench
