// The scene `acceptor` of the suite snapshots: the cost of a flood to a port, the bytes that it answers to unproven
// peers, and the cost of sealing.
//
//   join_under_flood_ms   time from Connect to connected of a client while 20 000 blind datagrams a second come from
//                         256 other addresses: ENet's CONNECT (config connects) or Hellos (hellos); `quiet` beside them
//   reply_amplification   bytes sent to those addresses over bytes received from them
//   forged_accepted       how many datagrams were taken of those that nobody sealed for the receiver: rubbish,
//   truncated,
//                         with flipped bits, replayed; in memory, and some through real sockets
//   seal_ns, open_ns      CPU time of one datagram of 1200 bytes, mean
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

// Errors: INTERNAL if something forged was accepted, a client could not join or a port could not be had.
absl::Status RunAcceptor(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
