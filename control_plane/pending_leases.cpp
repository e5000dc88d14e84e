#include "control_plane/pending_leases.h"

#include <utility>

#include "control_plane/control_settings.h"

namespace tessera::control {

PendingLeases::Worker PendingLeases::WorkerOf(const v1::LeaseRenewal& renewal) {
  const v1::WorkerIdentity& identity = renewal.identity();
  return {identity.instance_id(), identity.region(), identity.incarnation()};
}

void PendingLeases::Put(v1::LeaseRenewal renewal) {
  const Worker worker = WorkerOf(renewal);
  if (const auto found = places_.find(worker); found != places_.end()) {
    found->second->Swap(&renewal);
    return;
  }
  if (queue_.size() >= kMaxNamedWorkers) (void)Take();
  places_.emplace(worker, queue_.insert(queue_.end(), std::move(renewal)));
}

std::optional<v1::LeaseRenewal> PendingLeases::Take() {
  if (queue_.empty()) return std::nullopt;
  v1::LeaseRenewal first = std::move(queue_.front());
  queue_.pop_front();
  places_.erase(WorkerOf(first));
  return first;
}

}  // namespace tessera::control
