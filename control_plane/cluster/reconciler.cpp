#include "control_plane/cluster/reconciler.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "control_plane/game_deaths.h"
#include "control_plane/life.h"

namespace tessera::control {

void Reconciler::Reconcile(Now now, const InstanceNumbers& touched) {
  for (const std::uint64_t number : touched) Reconcile(now, state_.instance(number));
}

void Reconciler::Reconcile(Now now, InstanceEntry& instance) {
  while (const std::optional<Step> step = NextStep(now, instance)) {
    if (absl::Status status = Enter(now, instance, *step); !status.ok()) {
      LogTrouble(state_, instance, "instance cannot go on for now", status);
      instance.unstored = std::string(status.message());
      return parts_.instances.NoteHealth(instance, now);
    }
  }
  instance.unstored.clear();
  parts_.instances.NoteHealth(instance, now);
}

absl::Status Reconciler::Enter(Now now, InstanceEntry& instance, const records::Instance& next) {
  return Enter(now, instance, Step(next));
}

absl::Status Reconciler::Enter(Now now, InstanceEntry& instance, const Step& step) {
  const v1::InstanceState previous = instance.record.state();
  const Players& players = step.players ? *step.players : instance.players;
  if (absl::Status status = state_.StoreWithPlayers(instance, step.record, players); !status.ok()) return status;
  instance.trouble.clear();
  parts_.instances.Entered(instance, previous, now);
  return absl::OkStatus();
}

std::optional<Reconciler::Step> Reconciler::NextStep(Now now, InstanceEntry& instance) {
  const v1::InstanceState state = instance.record.state();
  if (state != v1::INSTANCE_STATE_RUNNING || !instance.restore_wanted.empty()) instance.awaits.clear();
  if (state == v1::INSTANCE_STATE_PLACING) return parts_.instances.NextPlaced(instance, now);
  if (state == v1::INSTANCE_STATE_RUNNING) {
    if (auto next = FailedByGame(instance.record, now)) {
      parts_.checkpoints.Restarted(instance);  // no checkpoint brings it back by itself
      return next;
    }
    if (auto next = Failovers::NextProtected(instance)) return next;
    if (auto next = NextFailoverOrChange(now, instance)) return next;
    if (auto players = parts_.players.NextVanished(instance, now)) return Step(instance.record, std::move(players));
  }
  if (WantsWorkers(state) && !instance.restore_wanted.empty()) return std::nullopt;
  auto next = parts_.instances.NextInLife(instance, parts_.players.Waiting(instance), now);
  // One that had begun before and only begins again has not failed for that a host of it is not there now.
  const bool begins_again = state == v1::INSTANCE_STATE_STARTING && instance.record.has_restores();
  if (!next || next->state() != v1::INSTANCE_STATE_FAILED || !begins_again) return next;
  const bool died = std::any_of(instance.workers.begin(), instance.workers.end(),
                                [](const WorkerEntry& worker) { return worker.gone && !worker.ending.empty(); });
  using Cause = InstanceCheckpoints::Cause;
  return parts_.checkpoints.GiveUp(instance, died ? Cause::kDied : Cause::kNotToBeHad, next->reason(), now);
}

std::optional<Reconciler::Step> Reconciler::NextFailoverOrChange(Now now, InstanceEntry& instance) {
  if (!instance.restore_wanted.empty()) return std::nullopt;
  FailoverStep step = parts_.failovers.Next(instance, parts_.changes.CutsOf(instance), now);
  instance.awaits = std::move(step.awaits);
  if (step.dropped_plan || !step.given_up.empty()) parts_.changes.RetryLater(instance.number, now);
  if (!step.given_up.empty()) {
    return parts_.checkpoints.GiveUp(instance, InstanceCheckpoints::Cause::kDied, step.given_up, now);
  }
  if (step.next) return Step(*std::move(step.next), std::move(step.players));
  if (step.told) {  // a later call stores it: the world need not stand for that
    if (!instance.told) state_.MarkOrders(instance);
    instance.told = {*std::move(step.told), step.players.value_or(instance.players)};
  }
  if (instance.record.has_failover()) return std::nullopt;
  if (const auto region = parts_.changes.HeldUpBy(instance, now)) {
    step = parts_.failovers.CarryOn(instance, *region, parts_.changes.CutsOf(instance), now);
    if (step.next) {
      parts_.changes.NoteCarriedOn(instance, *region, now);
      return Step(*std::move(step.next), std::move(step.players));
    }
  }
  return parts_.changes.Next(instance, now);
}

}  // namespace tessera::control
