// AgentLink: the worker's line to the agent on its host, over the Unix socket that the agent serves.
//
// Only states pass: the newest order of the agent waits in one slot for the loop, the newest report of the loop waits
// in another for the agent; what was overtaken is not sent. So do inventories and leases in slots of their own. While
// the agent is away the link dials again and again, at most kMaxBackoff apart, and begins each attachment with the
// newest report, so that the next agent knows whom it adopts.
//
//   AgentLink link(flags.agent_socket);
//   link.Report(report);                       // starts the first attachment
//   poll({link.wake_fd(), ...});
//   if (auto order = link.TakeOrder()) ...
//   if (link.refused()) ...                    // the agent does not know this worker: end
//
// Thread rule: the public functions may be called by one thread, the loop; none of them waits but `Close`. Two threads
// of the link's own do the talking, so gRPC never runs in the loop.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

class AgentLink {
 public:
  static constexpr std::chrono::milliseconds kMinBackoff{50}, kMaxBackoff{1000};

  explicit AgentLink(const std::string& socket_path);
  ~AgentLink();
  AgentLink(const AgentLink&) = delete;
  AgentLink& operator=(const AgentLink&) = delete;

  int wake_fd() const;  // readable when there is an order or a refusal; TakeOrder makes it quiet again
  // It names the players that changed since the order taken before it, or, where that was on another stream, all.
  std::optional<v1::WorkerOrder> TakeOrder();
  // Ends the stream that stands; the next one begins with a whole order.
  void Reattach();
  std::optional<v1::LeaseRenewal> TakeLease();
  void Report(const v1::WorkerReport& report);
  // The inventory for a failover; sent again at each attachment until it is cleared by an empty one.
  void SetInventory(const std::optional<v1::InventoryReport>& inventory);
  void AskLease(const v1::LeaseRequest& request);  // dropped when the agent is away
  // NOT_FOUND came back: the agent does not know this worker.
  bool refused() const;
  bool attached() const;
  // Sends what waits, if the agent is there and takes it within `patience`; then ends the threads.
  void Close(std::chrono::milliseconds patience);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::worker
