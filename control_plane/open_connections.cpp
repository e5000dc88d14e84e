#include "control_plane/open_connections.h"

#include <sys/stat.h>

#include <vector>

#include "control_plane/counted_address.h"

namespace tessera::control {
namespace {

// A full door asks for all of its connections no more often than that, however many knock: 4096 take a millisecond.
constexpr std::chrono::milliseconds kBetweenFullSweeps{50};

}  // namespace

OpenConnections::Refusal OpenConnections::Take(int fd, Clock::time_point now) {
  Forget(fd);  // its number was free
  struct stat found {};
  const std::string address = CountedAddress(fd);
  if (address.empty() || fstat(fd, &found) != 0) return Refusal::kDoor;  // it is gone already
  if (const auto known = by_address_.find(address);
      known != by_address_.end() && known->second.size() >= limits_.from_address) {
    SweepAddress(address);
  }
  if (const auto known = by_address_.find(address);
      known != by_address_.end() && known->second.size() >= limits_.from_address) {
    return Refusal::kAddress;
  }
  if (connections_.size() >= limits_.in_all && now - full_sweep_ >= kBetweenFullSweeps) {
    full_sweep_ = now;
    Sweep();
  }
  if (connections_.size() >= limits_.in_all) return Refusal::kDoor;
  connections_.emplace(fd, Connection{.address = address, .device = found.st_dev, .inode = found.st_ino});
  by_address_[address].insert(fd);
  return Refusal::kNone;
}

std::size_t OpenConnections::Sweep() {
  std::vector<int> closed;
  for (const auto& [fd, connection] : connections_) {
    if (!IsOpen(fd, connection)) closed.push_back(fd);
  }
  for (const int fd : closed) Forget(fd);
  return connections_.size();
}

// Sockets have numbers of their own, which no other has at the same time.
bool OpenConnections::IsOpen(int fd, const Connection& connection) {
  struct stat found {};
  return fstat(fd, &found) == 0 && found.st_dev == connection.device && found.st_ino == connection.inode;
}

void OpenConnections::SweepAddress(const std::string& address) {
  const std::set<int> all = by_address_[address];
  for (const int fd : all) {
    if (!IsOpen(fd, connections_.at(fd))) Forget(fd);
  }
}

void OpenConnections::Forget(int fd) {
  const auto found = connections_.find(fd);
  if (found == connections_.end()) return;
  const auto counted = by_address_.find(found->second.address);
  counted->second.erase(fd);
  if (counted->second.empty()) by_address_.erase(counted);
  connections_.erase(found);
}

}  // namespace tessera::control
