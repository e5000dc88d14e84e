// The suite failover: what the death of processes costs a world of four regions on two hosts of this machine.
//
// Each run starts a cluster and a world with players, waits until every region's heir has its log, strikes, and plays
// on until all is well again and two further censuses were complete. Columns: the fault.
//
//   fault=worker   kill -9 of a worker, of each region in turn
//   fault=host     kill -9 of an agent and all its workers
//   fault=agent    kill -9 of an agent alone; another one takes its place
//   fault=control  kill -9 of the control plane; it comes back after a while
//   fault=freeze   an agent and its workers stand still (SIGSTOP) until others have taken their place, then go on: a
//                  host that was cut off
//
// gap_ms is what a player sees: from the last state of the dead regions' bodies by their old owners to the first by the
// new ones, so it holds a snapshot's interval.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunFailover(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
