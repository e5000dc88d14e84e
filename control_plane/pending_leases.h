// NewestOfWorkers: requests for leases of a host's workers, or renewals on their way to it, that wait: the newest of
// each worker, in the order in which the workers first asked.
//
// A host that asks and does not read has at most kMaxNamedWorkers of them: the oldest goes first, since the worker that
// it was for stands still meanwhile either way.
//
// Thread rule: none of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "tessera/v1/agent_link.pb.h"

namespace tessera::control {

// `Message` has the identity of a worker: v1::LeaseRequest or v1::LeaseRenewal.
template <class Message>
class NewestOfWorkers {
 public:
  void Put(Message message);
  // The one that waits for longest; nothing: there is none.
  std::optional<Message> Take();
  bool empty() const { return queue_.empty(); }
  std::size_t size() const { return queue_.size(); }

 private:
  using Worker = std::tuple<std::string, std::uint32_t, std::uint64_t>;  // instance, region, incarnation
  static Worker WorkerOf(const Message& message);

  std::list<Message> queue_;
  std::map<Worker, typename std::list<Message>::iterator> places_;
};

extern template class NewestOfWorkers<v1::LeaseRenewal>;
extern template class NewestOfWorkers<v1::LeaseRequest>;
using PendingLeases = NewestOfWorkers<v1::LeaseRenewal>;
using PendingLeaseRequests = NewestOfWorkers<v1::LeaseRequest>;

}  // namespace tessera::control
