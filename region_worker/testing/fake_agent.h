// For tests: an agent that serves the worker link on a Unix socket, gives the orders that it has, with certificates for
// the keys that workers report, keeps every report and inventory, and gives leases unless a test forbids it.
//
// Thread rule: any thread.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "net/signing_key.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

class FakeAgent {
 public:
  // `known` false: every worker is refused as unknown.
  FakeAgent(const std::string& socket_path, const net::SigningKey& instance_key, bool known = true);
  ~FakeAgent();  // gone, as if killed
  FakeAgent(const FakeAgent&) = delete;
  FakeAgent& operator=(const FakeAgent&) = delete;

  // The whole order of `order.region()`, sent at once if that worker is attached and first thing when it attaches.
  void Give(const v1::WorkerOrder& order);
  // Waits for a report of `region` that fulfils `wanted`, old ones included, oldest first.
  std::optional<v1::WorkerReport> WaitFor(std::uint32_t region,
                                          const std::function<bool(const v1::WorkerReport&)>& wanted);
  // Waits for an inventory of `region` for the failover of `version`.
  std::optional<v1::Inventory> WaitForInventory(std::uint32_t region, std::uint64_t version);
  void GiveLeases(bool give);
  std::vector<v1::WorkerReport> ReportsOf(std::uint32_t region) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::worker
