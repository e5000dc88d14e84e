// Snapshots over a network that loses and delays datagrams: scenes of the suite snapshots, in virtual time.
//
//   loss     the 901 cubes at 60 Hz over 0, 1, 5 and 10 % loss, 20 ms one way and up to 50 ms more for each datagram:
//            what it takes, how old what is shown is, errors of decoding
//   render   the plaza at 30 Hz over the same, shown by the SDK's clock and world: render_delay_ms_p95 (the world's
//            tick less the one shown), render_error_m_p99 (of every body in every frame against the truth at that tick)
//   join     a running world of 5000 bodies, a tenth moving, joined over 1 Mbit/s: join_near_ms (all within 25 m),
//            join_complete_ms, others_rate_share (what others are sent meanwhile, of what they were)
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunLoss(const SuiteOptions& options, Report& report);
absl::Status RunRender(const SuiteOptions& options, Report& report);
absl::Status RunJoin(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
