// Messages of agents, as Cluster hands them to its parts.
#include <optional>
#include <utility>

#include "control_plane/cluster/cluster.h"
#include "control_plane/control_settings.h"
#include "control_plane/game_deaths.h"
#include "control_plane/life.h"
#include "control_plane/report_limits.h"

namespace tessera::control {
namespace {

constexpr std::uint64_t kMostLives = std::uint64_t{1} << 31;  // a revision's upper half

}  // namespace

absl::StatusOr<Admission> Cluster::HandleHello(Now now, const v1::AgentHello& hello, const std::string& shown_serial) {
  NoteTime(now);
  if (absl::Status status = CheckNamedWorkers("hello", hello.workers()); !status.ok()) return status;
  auto admission = hosts_.Admit(hello, now, shown_serial);
  if (!admission.ok()) return admission;
  HostEntry& host = *state_->HostOf(admission->stream);
  host.kept_revocations = hello.revocations_number();
  host.takes_player_changes = hello.takes_player_changes();
  admission->admitted.set_revocations_key(revocations_.public_key());
  admission->admitted.set_report_revocations(revocations_.Lacks(hello.revocations_number()));
  if (hello.newest_life() <= kMostLives) state_->NoteRevision((hello.newest_life() << kLifeShift) | 1);
  for (const v1::WorkerReport& report : hello.workers()) state_->NoteRevision(report.order_revision());
  if (recovery_.active()) {
    hosts_.Heard(host, now);
    for (const v1::WorkerReport& report : hello.workers()) recovery_.NoteReport(report, now);
    admission->admitted.set_report_orders(true);
    return admission;
  }
  NoteHeard(now, host);
  InstanceNumbers touched;
  TakeReports(now, host, hello.workers(), std::nullopt, touched);
  state_->MarkDesired(host);
  reconciler_.Reconcile(now, touched);
  return admission;
}

absl::Status Cluster::HandleAgentMessage(Now now, StreamId stream, const v1::AgentMessage& message) {
  HostEntry* host = state_->HostOf(stream);
  if (host == nullptr) return absl::AbortedError("this stream was replaced by another one");
  if (absl::Status status = CheckMessage(message); !status.ok()) return status;
  NoteTime(now);
  if (TakesRevocations(*host, message, now)) return absl::OkStatus();
  if (recovery_.active()) {
    TakeWhileRecovering(*host, message, now);
    return absl::OkStatus();
  }
  NoteHeard(now, *host);
  hosts_.NoteSecretCame(*host);
  InstanceNumbers touched;
  const InstanceEntry* awaits = nullptr;  // the instance whose failover waited for this
  switch (message.kind_case()) {
    case v1::AgentMessage::kHeartbeat:
      hosts_.NoteHeartbeat(*host, message.heartbeat(), now);
      TakeReports(now, *host, message.heartbeat().workers(), message.heartbeat().desired_revision(), touched);
      break;
    case v1::AgentMessage::kReport:
      TakeReport(now, *host, message.report(), touched);
      break;
    case v1::AgentMessage::kGameModules:
      return hosts_.NoteModules(*host, message.game_modules());
    case v1::AgentMessage::kExited:
      if (IsUnknownWorker(*host, message.exited().identity())) {
        ForgetUnknownWorker(*state_, *host, message.exited().identity());
        break;
      }
      hosts_.NoteExit(*host, message.exited(), now);
      NoteGameDeath(*host, message.exited(), touched);
      if (!reports_.TakeExit(*host, message.exited(), touched)) awaits = failovers_.NoteExit(*host, message.exited());
      break;
    case v1::AgentMessage::kInventory:
      awaits = failovers_.NoteInventory(*host, message.inventory(), now);
      break;
    case v1::AgentMessage::kLease:
      RenewLease(*host, message.lease(), now);
      break;
    case v1::AgentMessage::kKeptRevocations:
    case v1::AgentMessage::kRevocations:
      break;  // taken above
    case v1::AgentMessage::kHeldOrders:
      break;  // asked for by a control plane before this one
    case v1::AgentMessage::kHello:
      return absl::InvalidArgumentError("hello: only as the first message of a stream");
    case v1::AgentMessage::KIND_NOT_SET:
      return absl::InvalidArgumentError("kind: missing, or of a newer protocol");
  }
  if (awaits != nullptr) touched.insert(awaits->number);
  reconciler_.Reconcile(now, touched);
  return absl::OkStatus();
}

void Cluster::TakeWhileRecovering(const HostEntry& host, const v1::AgentMessage& message, Now now) {
  hosts_.Heard(*state_->FindHost(host.record.id()), now);
  switch (message.kind_case()) {
    case v1::AgentMessage::kHeldOrders:
      recovery_.TakeOrders(host, message.held_orders());
      return StepRecovery(now);
    case v1::AgentMessage::kExited:
      recovery_.NoteAlive(message.exited().identity());
      return HoldBack(host.stream, message);
    case v1::AgentMessage::kInventory:
      return HoldBack(host.stream, message);
    case v1::AgentMessage::kLease:
      return failovers_.RenewLease(host, message.lease(), now);
    case v1::AgentMessage::kReport:
      return recovery_.NoteReport(message.report(), now);
    case v1::AgentMessage::kHeartbeat:
      for (const v1::WorkerReport& report : message.heartbeat().workers()) recovery_.NoteReport(report, now);
      return;
    default:
      return;
  }
}

// An agent sends these once on each stream.
void Cluster::HoldBack(StreamId stream, const v1::AgentMessage& message) {
  if (held_back_.size() < kMaxHeldBack) held_back_.emplace_back(stream, message);
}

void Cluster::StepRecovery(Now now) {
  if (!recovery_.Step(now)) return;
  for (InstanceEntry& instance : state_->EachInstance()) Adopt(now, instance);
  SendBannedAway(now);
  for (InstanceEntry& instance : state_->EachInstance()) {
    if (!IsFinal(instance.record.state())) reconciler_.Reconcile(now, instance);
  }
  for (const auto& [stream, message] : std::exchange(held_back_, {})) {
    // Not OK: its agent has attached again since, and has sent it again.
    (void)HandleAgentMessage(now, stream, message);
  }
}

// Before the exit itself is acted on: that may end in a failover or a restore, and both go on from the record.
void Cluster::NoteGameDeath(const HostEntry& host, const v1::WorkerExited& exited, InstanceNumbers& touched) {
  InstanceEntry* instance = state_->FindInstance(exited.identity().instance_id());
  if (instance == nullptr) return;
  const auto next = CountGameDeath(instance->record, instance->newest_tick, host.record, exited);
  if (!next) return;
  if (absl::Status status = state_->StoreInstance(*instance, *next); !status.ok()) {
    return LogTrouble(*state_, *instance, "a death in the game cannot be counted for now", status);
  }
  touched.insert(instance->number);
}

void Cluster::HandleAgentGone(StreamId stream) {
  if (HostEntry* host = state_->HostOf(stream)) state_->ForgetStream(*host);
}

// With a host that was lost, what was degraded comes back.
void Cluster::NoteHeard(Now now, HostEntry& host) {
  if (const Steady deaf = hosts_.OwnDeafness(now); deaf.count() > 0) failovers_.Forgive(deaf, now);
  if (!hosts_.Heard(host, now)) return;
  InstanceNumbers touched;
  for (const auto& [number, index] : host.workers) touched.insert(number);
  reconciler_.Reconcile(now, touched);
}

void Cluster::TakeReport(Now now, const HostEntry& host, const v1::WorkerReport& report, InstanceNumbers& touched) {
  const auto taken = reports_.Take(host, report, touched, now);
  if (!taken) return;
  Failovers::Witness(*taken->instance, taken->before, report, now);
  properties_.TakeAnswers(*taken->instance, report);
  game_logs_.Take(*taken->instance, report, now);
  game_events_.Take(*taken->instance, report, now);
  game_messages_.TakeAnswers(*taken->instance, report);
  players_.TakeEnded(*taken->instance, report, now);
}

void Cluster::TakeReports(Now now, HostEntry& host, const ReportList& reports,
                          std::optional<std::uint64_t> acted_revision, InstanceNumbers& touched) {
  for (const v1::WorkerReport& report : reports) TakeReport(now, host, report, touched);
  reports_.NoticeAbsent(host, reports, acted_revision, touched);
}

}  // namespace tessera::control
