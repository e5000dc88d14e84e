// The other side of RunFloodedTicks: one flood of datagrams, a process of its own.
//
// It stands for another machine: it is scheduled only where the world leaves a processor (SCHED_IDLE), so what ticks
// take longer is what the flood costs the region, not what it costs its sender. What the kernel does to bring a
// datagram to the port is done in the sender's time, on the loopback interface alone; the flood at a port that nobody
// reads shows how much that is.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "host/child_process.h"
#include "host/temporary_folder.h"

namespace tessera::bench {

struct FloodSeat {
  // "hellos" of strangers to `port`, "overheard": hellos by one who has seen a player's, or "player" of the instance.
  std::string kind;
  std::uint16_t port = 0;
  std::string control, instance;
};

// Sends until SIGTERM, and says on its standard output how many datagrams a second went out. Exit status: 0.
int FloodFromSeat(const FloodSeat& seat);

// A flood that goes on until Stop or its end. CommandError where it cannot be started.
class RunningFlood {
 public:
  explicit RunningFlood(const FloodSeat& seat);
  // Datagrams a second; CommandError where it ended by itself.
  double Stop();

 private:
  const host::TemporaryFolder folder_;
  host::ChildProcess process_;
};

}  // namespace tessera::bench
