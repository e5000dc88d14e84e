#include "control_plane/cluster/desired_sets.h"

#include <algorithm>

#include "control_plane/life.h"

namespace tessera::control {
namespace {

// While a worker is missing that has run before, its agent must not be ordered to start "what is missing": that would
// give its incarnation to a second one. A few heartbeats show whether it is dead.
bool HeldBack(const ClusterState& state, const HostEntry& host) {
  return std::any_of(host.workers.begin(), host.workers.end(), [&state](const auto& placed) {
    const InstanceEntry& instance = state.instances().at(placed.first);
    return WantsWorkers(instance.record.state()) && instance.workers[placed.second].missed > 0;
  });
}

}  // namespace

std::optional<v1::DesiredSet> DesiredSets::Take(StreamId stream) {
  HostEntry* host = state_.HostOf(stream);
  if (host == nullptr || !host->desired_changed || state_.recovering() || HeldBack(state_, *host)) return std::nullopt;
  host->desired_changed = false;
  v1::DesiredSet desired;
  desired.set_revision(state_.NextRevision());
  if (!revocations_.KeptBy(*host)) *desired.mutable_revocations() = revocations_.newest();
  for (const auto& [number, index] : host->workers) {
    InstanceEntry& instance = state_.instance(number);
    WorkerEntry& worker = instance.workers[index];
    const v1::InstanceState state = instance.record.state();
    if (state == v1::INSTANCE_STATE_PENDING || state == v1::INSTANCE_STATE_PLACING) continue;
    if (!WantsWorkers(state) && worker.ended_in == 0) worker.ended_in = desired.revision();
    // A worker that has never been heard of is not asked to end in order, lest it be started for that.
    if (instance.withdrawn || (!WantsWorkers(state) && !worker.reported)) continue;
    v1::WorkerOrder order = MakeOrder(instance, index, requests_of_(instance));
    order.set_revision(worker.order.revision());
    const Players& players = PlayersOf(instance);
    const Players::Changes changes = players.ChangesSince(worker.players);
    const std::uint64_t before = worker.order.revision();
    if (before == 0 || !changes.empty() || order.SerializeAsString() != worker.order.SerializeAsString()) {
      order.set_revision(state_.NextRevision());
    }
    v1::WorkerOrder& given = *desired.add_workers();
    given = order;
    // A set that went out on this stream comes, or the stream ends.
    if (host->takes_player_changes && before != 0 && worker.given_on == stream) {
      AddPlayerChanges(changes, before, given);
    } else {
      AddPlayers(players, given);
    }
    worker.order = std::move(order);
    worker.players = players;
    worker.given_on = stream;
    if (worker.asked_in == kUnasked) worker.asked_in = desired.revision();
  }
  // Whatever is not in the set is ended.
  for (const v1::WorkerOrder& unknown : host->record.unknown_workers()) *desired.add_workers() = unknown;
  return desired;
}

}  // namespace tessera::control
