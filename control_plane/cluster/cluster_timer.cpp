// Time, as Cluster hands it to its parts.
#include <vector>

#include "control_plane/cluster/cluster.h"
#include "control_plane/life.h"

namespace tessera::control {

void Cluster::NoteTime(Now now) {
  if (const Steady pause = hosts_.OwnPause(now); pause.count() > 0) failovers_.Forgive(pause, now);
}

void Cluster::HandleTimer(Now now, const std::function<Now()>& between) {
  NoteTime(now);
  state_->ProbeStore(now);
  InstanceNumbers evicted;
  RemoveRevoked(evicted);  // where the store took the list, and then not this
  if (recovery_.active()) {
    recovery_.NoteHealth(now);
    return StepRecovery(now);
  }
  reconciler_.Reconcile(now, evicted);
  for (HostEntry& host : state_->EachHost()) {
    hosts_.ForgetNoPorts(host, now);
    if (!hosts_.Lost(host, now)) continue;
    InstanceNumbers touched;
    reports_.NoticeLost(host, touched);
    reconciler_.Reconcile(now, touched);
  }
  std::vector<std::uint64_t> numbers;
  for (const auto& [number, instance] : state_->instances()) numbers.push_back(number);
  for (const std::uint64_t number : numbers) {
    if (!state_->instances().contains(number)) continue;  // forgotten in between
    StepInTime(now, state_->instance(number));
    if (between) now = between();
  }
  tickets_.Prune(now);
  visuals_.Sweep(now);
  for (const std::uint64_t number : instances_.ForgetEnded(now)) Forget(number);
}

void Cluster::StepInTime(Now now, InstanceEntry& instance) {
  if (!IsFinal(instance.record.state())) {
    reconciler_.Reconcile(now, instance);
    checkpoints_.RetryRestore(instance, now);
    players_.Prune(instance, now);
    checkpoints_.Step(instance, now);
    game_messages_.Expire(instance, now);
    (void)StoreUpgradeEnd(now, instance, upgrades_.EndAbandoned(instance, now));  // tried again at the next
  }
  instances_.WithdrawLate(instance, now);
}

}  // namespace tessera::control
