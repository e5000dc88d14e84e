#include "control_plane/pending_leases.h"

#include <utility>

#include "control_plane/control_settings.h"

namespace tessera::control {

template <class Message>
typename NewestOfWorkers<Message>::Worker NewestOfWorkers<Message>::WorkerOf(const Message& message) {
  const v1::WorkerIdentity& identity = message.identity();
  return {identity.instance_id(), identity.region(), identity.incarnation()};
}

template <class Message>
void NewestOfWorkers<Message>::Put(Message message) {
  const Worker worker = WorkerOf(message);
  if (const auto found = places_.find(worker); found != places_.end()) {
    found->second->Swap(&message);
    return;
  }
  if (queue_.size() >= kMaxNamedWorkers) (void)Take();
  places_.emplace(worker, queue_.insert(queue_.end(), std::move(message)));
}

template <class Message>
std::optional<Message> NewestOfWorkers<Message>::Take() {
  if (queue_.empty()) return std::nullopt;
  Message first = std::move(queue_.front());
  queue_.pop_front();
  places_.erase(WorkerOf(first));
  return first;
}

template class NewestOfWorkers<v1::LeaseRenewal>;
template class NewestOfWorkers<v1::LeaseRequest>;

}  // namespace tessera::control
