// SimulatedAgentLink: a worker's line to its agent, in place of region_worker's AgentLink: each message goes at once,
// and a new attachment begins with the newest report and the inventory that is not settled.
//
// Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <optional>

#include "tessera/v1/worker_link.pb.h"

namespace tessera::simulation {

class SimulatedAgentLink {
 public:
  std::function<void(const v1::WorkerMessage&)> send;  // empty while no agent is there

  v1::WorkerMessage FirstMessage() const { return newest_; }

  void Report(const v1::WorkerReport& report) {
    v1::WorkerMessage message;
    *newest_.mutable_report() = *message.mutable_report() = report;
    Send(message);
  }
  void SetInventory(const std::optional<v1::InventoryReport>& inventory) {
    newest_.clear_inventory();
    if (!inventory) return;
    v1::WorkerMessage message;
    *newest_.mutable_inventory() = *message.mutable_inventory() = *inventory;
    Send(message);
  }
  void AskLease(const v1::LeaseRequest& request) const {
    v1::WorkerMessage message;
    *message.mutable_lease() = request;
    Send(message);
  }

 private:
  void Send(const v1::WorkerMessage& message) const {
    if (send) send(message);
  }

  v1::WorkerMessage newest_;  // the report, and the inventory until it is settled
};

}  // namespace tessera::simulation
