// The suite failover: what the death of processes costs a world of four regions on two hosts of this machine, and what
// it costs to change who runs it. The whole suite takes about 50 minutes, of which the faults of the control plane take
// half; `--only` selects, and `--csv` keeps what is known after each run.
//
//   fault=worker   kill -9 of a worker, of each region in turn
//   fault=pair     kill -9 of both workers of a host, whose agent lives
//   fault=host     kill -9 of an agent and all its workers
//   fault=freeze   an agent and its workers stand still (SIGSTOP) until others have taken their place, then go on
//   fault=agent    kill -9 of an agent alone; another one takes its place
//   fault=link     a host's network is cut until others have taken its regions' place, then mended: hosts are network
//                  namespaces
//   fault=control  kill -9 of the control plane; it comes back after a while. Late ticks are counted over as long with
//                  it twice before, so that what it costs stands beside what nothing costs
//   scale          from two regions to four and back
//   hot-spot       four of five bodies run into one corner
//   restore        a checkpoint is started by another cluster
//   standby        what the standby's copy costs
//
// A fault strikes one world again and again. Each time all regions must run, each with a standby that follows it on
// another host, and nothing be under way; then it strikes, others carry on, what was killed is started anew, and two
// further censuses must be complete. A run of which any of that is not so within two minutes has failed, and is counted
// as that.
//
// Players are processes of their own (player_seat.h). Before each strike their frames and the regions' ticks are
// counted for two seconds: on a stage where more than one in twenty is late nothing is struck, and the run counts as
// runs_stage_too_slow and as nothing else (stage_pace.h).
//
// gap_ms is what a player sees: from the last state of the dead regions' bodies by their old owners to the first by the
// new ones, so it holds a snapshot's interval. gap_without_a_step_ms is the same gap as the regions see it.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunFailover(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
