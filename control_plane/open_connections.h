// OpenConnections: how many connections of a door are open, in all and by the address that dialled.
//
//   if (const Refusal refusal = open.Take(fd, now); refusal != Refusal::kNone) close(fd);
//
// gRPC closes the descriptors that it was given without saying so. So a connection counts as long as its descriptor's
// number leads to the same socket, for which the kernel is asked: all of one address when it has as many as it may, and
// all of the door when that is full, and once in a while. No second descriptor is kept, and none counts twice.
//
// Thread rule: one thread.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <unordered_map>

namespace tessera::control {

// Connections of one door at once. 64 is room for the hosts, gateways and backends behind one address; each connection
// costs some 50 KB of memory and a descriptor while it is open, and the unit allows 65536 of these.
struct ConnectionLimits {
  std::size_t from_address = 64;  // one IPv4 address, or one IPv6 /64
  std::size_t in_all = 4096;
};

class OpenConnections {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Refusal { kNone, kAddress, kDoor };

  explicit OpenConnections(ConnectionLimits limits) : limits_(limits) {}

  // Counts a connection that was just accepted, unless there are too many.
  Refusal Take(int fd, Clock::time_point now);
  // Forgets those that were closed, and says how many are open.
  std::size_t Sweep();

 private:
  struct Connection {
    std::string address;
    dev_t device;
    ino_t inode;
  };
  static bool IsOpen(int fd, const Connection& connection);
  void SweepAddress(const std::string& address);
  void Forget(int fd);

  const ConnectionLimits limits_;
  std::unordered_map<int, Connection> connections_;  // by descriptor
  std::map<std::string, std::set<int>> by_address_;  // their descriptors
  Clock::time_point full_sweep_{};
};

}  // namespace tessera::control
