// PendingLeases: renewals of leases that wait to be sent to a host: the newest of each worker, in the order in which
// the workers first asked.
//
// A host that asks and does not read has at most kMaxNamedWorkers of them: the oldest goes first, since the worker that
// it was for stands still meanwhile either way.
//
// Thread rule: none of its own.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "tessera/v1/agent_link.pb.h"

namespace tessera::control {

class PendingLeases {
 public:
  void Put(v1::LeaseRenewal renewal);
  // The one that waits for longest; nothing: there is none.
  std::optional<v1::LeaseRenewal> Take();
  bool empty() const { return queue_.empty(); }
  std::size_t size() const { return queue_.size(); }

 private:
  using Worker = std::tuple<std::string, std::uint32_t, std::uint64_t>;  // instance, region, incarnation
  static Worker WorkerOf(const v1::LeaseRenewal& renewal);

  std::list<v1::LeaseRenewal> queue_;
  std::map<Worker, std::list<v1::LeaseRenewal>::iterator> places_;
};

}  // namespace tessera::control
