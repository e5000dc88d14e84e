// The scene `door` of the suite snapshots: what a port gives strangers, what it takes from them, and what sealing
// costs.
//
//   join_under_flood_ms   a client's way in, from Connect to connected, while 20 000 blind datagrams a second come from
//                         256 other addresses: ENet's CONNECT (config connects) or Hellos (hellos); `quiet` beside them
//   reply_amplification   bytes sent to those strangers over bytes received of them
//   forged_accepted       of datagrams that nobody sealed for the receiver: rubbish, truncated, with flipped bits,
//   replayed;
//                         in memory, and some through real sockets
//   seal_ns, open_ns      CPU time of one datagram of 1200 bytes, mean
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

// Errors: INTERNAL if something forged was accepted, a client could not join or a port could not be had.
absl::Status RunDoor(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
