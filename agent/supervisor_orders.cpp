// Orders of a supervisor: how they are kept, and what of them goes on to workers.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "agent/supervisor.h"
#include "core/world/player_changes.h"

namespace tessera::agent {
namespace {

// Costs no copy of a player.
v1::WorkerOrder WithoutPlayers(v1::WorkerOrder& order) {
  google::protobuf::RepeatedPtrField<v1::Player> players;
  players.Swap(order.mutable_players());
  v1::WorkerOrder copy = order;
  players.Swap(order.mutable_players());
  return copy;
}

// All but the players, as bytes that differ where that does.
std::string HeadOf(v1::WorkerOrder order) {
  order.clear_revision();
  order.clear_players_since();
  order.clear_players_forgotten();
  return order.SerializeAsString();
}

}  // namespace

std::string NotablePart(const std::optional<v1::WorkerOrder>& order) {
  if (!order) return "";
  return absl::StrCat(order->operation(), " ", order->run(), order->stop(), " ", order->map().version(), " ",
                      order->failover().version(), order->has_resolution());
}

// False: it is the order that is there. Where the players alone differ the disk has it a little later, for a world that
// fills would be written as often as somebody joins.
bool Supervisor::TakeOrder(const WorkerKey& key, Worker& worker, const v1::WorkerOrder& order, TimePoint now) {
  if (order.players_since() == 0) {
    if (worker.order && worker.order->SerializeAsString() == order.SerializeAsString()) return false;
    worker.order = order;
    worker.unsent.reset();
    Keep(key, worker);
    return true;
  }
  if (order.revision() == worker.order->revision()) return false;
  v1::WorkerOrder next = order;
  const std::string before = HeadOf(WithoutPlayers(*worker.order)), after = HeadOf(WithoutPlayers(next));
  if (worker.unsent) {
    v1::WorkerOrder changes = order;
    CompletePlayers(*std::move(worker.unsent), changes);
    worker.unsent = std::move(changes);
  }
  CompletePlayers(*std::move(worker.order), next);
  worker.order = std::move(next);
  if (before != after) {
    Keep(key, worker);
  } else if (!worker.keep_at) {
    worker.keep_at = now + kKeepPlayersInterval;
  }
  return true;
}

void Supervisor::Keep(const WorkerKey& key, Worker& worker) {
  worker.keep_at.reset();
  if (worker.order && worker.record.identity().pid() != 0) actions_.push_back(KeepOrder{key, *worker.order});
}

void Supervisor::ForgetSent(Worker& worker) {
  worker.sent.clear();
  worker.unsent.reset();
}

void Supervisor::PushOrder(const WorkerKey& key, Worker& worker) {
  const bool stop = worker.stopping != Stopping::kNo;
  if (!worker.attached || (!worker.order && !stop)) return;
  v1::WorkerOrder order;
  if (worker.order) {
    order = WithoutPlayers(*worker.order);
  } else {
    order.set_instance_id(key.instance_id);
    order.set_region(key.region);
    order.set_incarnation(key.incarnation);
  }
  const bool whole = SetPaths(key, worker, order);
  WriteRevoked(revoked_, order);
  if (!whole && !stop) return;
  if (stop && !order.stop()) {  // our own decision: it must fence every order before it
    order.set_revision(std::max(order.revision(), worker.report.order_revision()) + 1);
    order.set_stop(true);
    order.set_goes_on(!stopping_all_);
  }
  // Players do not differ without the revision.
  std::string bytes = order.SerializeAsString();
  if (bytes == worker.sent) return;
  worker.sent = std::move(bytes);
  AddPlayers(worker, order);
  std::string part = NotablePart(order);
  const bool notable = std::exchange(worker.notable, part) != part;
  actions_.push_back(SendOrder{key, std::move(order), notable});
}

// Those that changed since the last order to this worker, or all.
void Supervisor::AddPlayers(Worker& worker, v1::WorkerOrder& order) {
  if (worker.takes_changes && worker.unsent) {
    order.mutable_players()->Swap(worker.unsent->mutable_players());
    order.mutable_players_forgotten()->Swap(worker.unsent->mutable_players_forgotten());
    order.set_players_since(worker.unsent->players_since());
  } else if (worker.order) {
    *order.mutable_players() = worker.order->players();
  }
  worker.unsent.emplace().set_revision(order.revision());
  worker.unsent->set_players_since(order.revision());
}

}  // namespace tessera::agent
