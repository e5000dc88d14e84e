// HostNetwork: hosts with addresses of their own, on one machine. Each is a network namespace with one interface, on a
// switch in the namespace of this process; its link can be cut and mended while programs run.
//
//   absl::Status own = EnterOwnNetwork();                 // first thing in main: the machine's network stays untouched
//   auto network = HostNetwork::Create(2);
//   LocalCluster cluster({.state_dir = dir, .hosts = 2, .network = network->get()});
//   (*network)->Cut(0);                                   // host 0 hears nobody, and nobody it
//
// Works by iproute2 and nsenter, as root or where users may make namespaces. All of it is gone with this process and
// the programs in it. Thread rule: one thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::local {

// This process, and all that it starts from here on, in a network of its own that has loopback alone. Once, before any
// other thread is made. UNAVAILABLE where the machine does not allow it.
absl::Status EnterOwnNetwork();

class HostNetwork {
 public:
  // UNAVAILABLE where namespaces, bridges or `ip` cannot be had. At most 200 hosts.
  static absl::StatusOr<std::unique_ptr<HostNetwork>> Create(std::uint32_t hosts);
  ~HostNetwork();
  HostNetwork(const HostNetwork&) = delete;
  HostNetwork& operator=(const HostNetwork&) = delete;

  const std::string& switch_address() const { return switch_address_; }  // where hosts reach this process
  std::string address(std::uint32_t host) const;                         // IPv4
  // The words to put before a program's argv to run it there.
  std::vector<std::string> Enter(std::uint32_t host) const;

  // Packets either way vanish.
  absl::Status Cut(std::uint32_t host) const;
  absl::Status Mend(std::uint32_t host) const;
  // Packets from `from` to `to` vanish, without a word to either; the other way is another matter.
  absl::Status Lose(std::uint32_t from, std::uint32_t to) const;
  absl::Status Find(std::uint32_t from, std::uint32_t to) const;
  // The calling thread is in the host's network from here on, also where the host's link is cut.
  absl::Status EnterThread(std::uint32_t host) const;

 private:
  HostNetwork() = default;
  absl::Status Add(std::uint32_t host);

  std::string switch_address_ = "10.77.0.1";
  std::vector<int> namespaces_;  // descriptors
};

}  // namespace tessera::local
