#include "control_plane/cluster/reconciler.h"

#include <cstdint>
#include <string>
#include <utility>

#include "control_plane/game_deaths.h"

namespace tessera::control {

void Reconciler::Reconcile(Now now, const InstanceNumbers& touched) {
  for (const std::uint64_t number : touched) Reconcile(now, state_.instance(number));
}

void Reconciler::Reconcile(Now now, InstanceEntry& instance) {
  while (const std::optional<records::Instance> next = NextRecord(now, instance)) {
    if (absl::Status status = Enter(now, instance, *next); !status.ok()) {
      LogTrouble(state_, instance, "instance cannot go on for now", status);
      instance.unstored = std::string(status.message());
      return parts_.instances.NoteHealth(instance, now);
    }
  }
  instance.unstored.clear();
  parts_.instances.NoteHealth(instance, now);
}

absl::Status Reconciler::Enter(Now now, InstanceEntry& instance, const records::Instance& next) {
  const v1::InstanceState previous = instance.record.state();
  if (absl::Status status = state_.StoreInstance(instance, next); !status.ok()) return status;
  instance.trouble.clear();
  parts_.instances.Entered(instance, previous, now);
  return absl::OkStatus();
}

std::optional<records::Instance> Reconciler::NextRecord(Now now, InstanceEntry& instance) {
  const v1::InstanceState state = instance.record.state();
  if (state == v1::INSTANCE_STATE_PLACING) return parts_.instances.NextPlaced(instance, now);
  if (state == v1::INSTANCE_STATE_RUNNING) {
    if (auto next = FailedByGame(instance.record, now)) {
      parts_.checkpoints.Restarted(instance);  // no checkpoint brings it back by itself
      return next;
    }
    if (auto next = Failovers::NextProtected(instance)) return next;
    if (auto next = NextFailoverOrChange(now, instance)) return next;
    if (auto next = parts_.players.NextVanished(instance, now)) return next;
  }
  return parts_.instances.NextInLife(instance, parts_.players.Waiting(instance), now);
}

std::optional<records::Instance> Reconciler::NextFailoverOrChange(Now now, InstanceEntry& instance) {
  if (!parts_.checkpoints.RestoreWanted(instance).empty()) return std::nullopt;
  FailoverStep step = parts_.failovers.Next(instance, parts_.changes.CutsOf(instance), now);
  if (step.dropped_plan || !step.given_up.empty()) parts_.changes.RetryLater(instance.number, now);
  if (!step.given_up.empty()) return parts_.checkpoints.GiveUp(instance, step.given_up, now);
  if (step.next) return std::move(step.next);
  if (step.told) {  // a later call stores it: the world need not stand for that
    if (!instance.told) state_.MarkOrders(instance);
    instance.told = std::move(step.told);
  }
  if (instance.record.has_failover()) return std::nullopt;
  if (const auto region = parts_.changes.HeldUpBy(instance, now)) {
    step = parts_.failovers.CarryOn(instance, *region, parts_.changes.CutsOf(instance), now);
    if (step.next) {
      parts_.changes.NoteCarriedOn(instance, *region, now);
      return std::move(step.next);
    }
  }
  return parts_.changes.Next(instance, now);
}

}  // namespace tessera::control
