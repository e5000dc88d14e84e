#include "control_plane/cluster/worker_reports.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/change.h"
#include "control_plane/control_settings.h"
#include "control_plane/id_ranges.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "control_plane/report_limits.h"
#include "net/credential.h"

namespace tessera::control {
namespace {

bool ValidPorts(const v1::RegionAddress& address) {
  const auto port = [](std::uint32_t value) { return value >= 1 && value <= kMaxPort; };
  return port(address.game_port()) && port(address.link_port()) && address.metrics_port() <= kMaxPort;
}

bool SamePlayers(const v1::WorkerReport& a, const v1::WorkerReport& b) {
  return std::equal(a.connected_players().begin(), a.connected_players().end(), b.connected_players().begin(),
                    b.connected_players().end());
}

bool SamePorts(const v1::RegionAddress& a, const v1::RegionAddress& b) {
  return a.host() == b.host() && a.game_port() == b.game_port() && a.link_port() == b.link_port() &&
         a.metrics_port() == b.metrics_port();
}

// "worker exited with code 3: cannot bind; last log: a | b": one line, from what an agent reported.
std::string DescribeExit(const v1::WorkerExited& exited, const v1::WorkerReport& last_report) {
  std::string text = "worker ";
  if (!exited.started()) {
    text += exited.reason().empty() ? "could not be started" : "could not be started: " + exited.reason();
  } else if (!exited.died_in_game().empty()) {
    return OneLine(absl::StrCat("worker died in game module ", exited.died_in_game()), kMaxReasonBytes);
  } else if (!exited.reason().empty()) {
    text += exited.reason();
  } else if (exited.signal() != 0) {
    absl::StrAppend(&text, "was killed by signal ", exited.signal());
  } else {
    absl::StrAppend(&text, "exited with code ", exited.exit_code());
  }
  // An agent that heard it too has put it into its reason.
  if (const std::string& failure = last_report.failure(); text.find(failure) == std::string::npos) {
    absl::StrAppend(&text, ": ", failure);
  }
  const auto& lines = exited.last_log_lines();
  if (!lines.empty()) {
    const auto kept = std::min<std::ptrdiff_t>(lines.size(), kReasonLogLines);
    absl::StrAppend(&text, "; last log: ", absl::StrJoin(lines.end() - kept, lines.end(), " | "));
  }
  return OneLine(text, kMaxReasonBytes);
}

// The bodies that a worker says to have removed; none if they do not ascend.
IdRanges RemovedBy(const v1::WorkerReport& report) {
  IdRanges ranges;
  if (report.removed_first_size() != report.removed_last_size()) return ranges;
  std::uint64_t last = 0;
  for (int i = 0; i < report.removed_first_size(); ++i) {
    if (report.removed_first(i) <= last || report.removed_last(i) < report.removed_first(i)) return {};
    last = report.removed_last(i);
    ranges.Add()->set_first(report.removed_first(i));
    ranges.rbegin()->set_last(last);
  }
  return ranges;
}

void NoteTick(InstanceEntry& instance, std::uint64_t tick, bool kept) {
  if (tick <= instance.newest_tick) return;
  instance.newest_tick = tick;
  instance.newest_tick_is_kept = kept;
}

}  // namespace

std::optional<WorkerReports::Taken> WorkerReports::Take(const HostEntry& host, const v1::WorkerReport& report,
                                                        InstanceNumbers& touched, Now now) {
  const auto [instance, worker] = FindWorker(state_, host, report.identity());
  if (instance == nullptr || worker->gone) return std::nullopt;
  if (const absl::Status fine = CheckReport(report); !fine.ok()) {
    // Not to be believed that it ends, either; its agent is ordered to end it, as it is in no desired set any more.
    worker->evicted = true;
    state_.Log(absl::StrCat("worker refused instance=", instance->record.id(), " region=", worker->region,
                            " host=", host.record.name(), ": ", fine.message()),
               Severity::kError);
    state_.SetGone(*instance, *worker, absl::StrCat("worker refused: ", fine.message()));
    touched.insert(instance->number);
    return std::nullopt;
  }
  v1::WorkerReport before = std::exchange(worker->report, report);
  const bool was_bound = before.phase() >= v1::WORKER_PHASE_BOUND && before.address().game_port() != 0;
  worker->reported = true;
  worker->reported_at = now.steady;
  worker->missed = 0;
  NoteTick(*instance, report.tick(), false);
  state_.NoteRevision(report.order_revision());
  StoreTakenOut(*instance, report);
  Certify(*instance, *worker, was_bound, host);
  v1::RegionAddress& address = *worker->report.mutable_address();
  if (!ValidPorts(address)) address.Clear();
  address.set_region(worker->region);
  address.set_incarnation(report.identity().incarnation());
  address.set_host(host.record.advertise_address());
  if (worker->bound() != was_bound || (was_bound && !SamePorts(before.address(), address))) {
    state_.MarkOrders(*instance);
    touched.insert(instance->number);
  }
  const bool changing = !AtRest(instance->record), same_players = SamePlayers(before, report);
  if (!same_players) ++instance->connections;
  if (changing || before.phase() != report.phase() || !same_players) touched.insert(instance->number);
  state_.MarkChanged(*instance);
  return Taken{instance, std::move(before)};
}

// A process that ended before it listened is started again, as the same life of the region, with another key.
void WorkerReports::Certify(const InstanceEntry& instance, WorkerEntry& worker, bool was_bound, const HostEntry& host) {
  const auto key = net::VerificationKeyFrom(worker.report.public_key(), "public_key");
  if (!key.ok() || worker.report.public_key() == worker.certified) return;
  if (was_bound && !worker.certified.empty()) return;
  const std::vector<std::uint8_t> certificate =
      net::Sign(net::WorkerCertificate{.instance_id = instance.record.id(),
                                       .region = RegionId(worker.region),
                                       .incarnation = Incarnation(worker.incarnation),
                                       .key = *key},
                instance.key);
  worker.certificate.assign(certificate.begin(), certificate.end());
  worker.certified = worker.report.public_key();
  if (HostEntry* its_host = state_.FindHost(host.record.id())) state_.MarkDesired(*its_host);
}

// A failover does not look for bodies that became non-finite, or that the game removed. One whose worker dies before it
// reported them counts as lost, unless its standby has it that the game removed them.
void WorkerReports::StoreTakenOut(InstanceEntry& instance, const v1::WorkerReport& report) {
  if (report.nonfinite_ids().empty() && report.removed_first().empty()) return;
  records::Instance next = instance.record;
  bool any = false;
  for (const std::uint64_t id : report.nonfinite_ids()) any |= TakeOut(BodyId(id), *next.mutable_bodies());
  any |= TakeOut(RemovedBy(report), *next.mutable_bodies());
  if (!any) return;
  if (absl::Status status = state_.StoreInstance(instance, next); !status.ok()) {
    LogTrouble(state_, instance, "bodies taken out cannot be stored for now", status);
  }
}

void WorkerReports::NoticeAbsent(HostEntry& host, const ReportList& reports,
                                 std::optional<std::uint64_t> acted_revision, InstanceNumbers& touched) {
  std::set<std::tuple<std::string, std::uint32_t, std::uint64_t>> named;
  for (const v1::WorkerReport& report : reports) {
    named.emplace(report.identity().instance_id(), report.identity().region(), report.identity().incarnation());
  }
  for (const auto& [number, index] : std::set(host.workers)) {
    InstanceEntry& instance = state_.instance(number);
    WorkerEntry& worker = instance.workers[index];
    const v1::InstanceState state = instance.record.state();
    if (named.contains({instance.record.id(), worker.region, worker.incarnation})) continue;
    if (WantsWorkers(state)) {
      // None is missed by an agent that does not know of it yet. One that says hello may have been told before.
      if (!acted_revision && worker.asked_in != kUnasked) worker.asked_in = 0;
      if (acted_revision.value_or(0) < worker.asked_in) continue;
      const bool ran = worker.reported || instance.record.run() || state != v1::INSTANCE_STATE_STARTING;
      if (!ran || ++worker.missed < kMissedBeforeVanished) continue;
      state_.SetGone(instance, worker, "worker ended unseen: the agent of its host does not name it any more");
      touched.insert(number);
    } else if (worker.ended_in != 0 && acted_revision >= worker.ended_in) {
      state_.SetGone(instance, worker, "");
      touched.insert(number);
    }
  }
  if (host.desired_changed) state_.MarkDesired(host);  // it may have been held back
}

bool WorkerReports::TakeExit(const HostEntry& host, const v1::WorkerExited& exited, InstanceNumbers& touched) {
  const auto [instance, worker] = FindWorker(state_, host, exited.identity());
  if (instance == nullptr) return false;
  NoteTick(*instance, exited.newest_tick(), true);
  if (worker->gone) return true;
  const bool wanted = WantsWorkers(instance->record.state());
  const std::string what = wanted ? DescribeExit(exited, worker->report) : "";
  state_.Log(absl::StrCat("worker ended instance=", instance->record.id(), " region=", worker->region,
                          " host=", host.record.name(), wanted ? ": " : " as asked", what),
             wanted ? Severity::kWarning : Severity::kInfo);
  state_.SetGone(*instance, *worker, what);
  touched.insert(instance->number);
  return true;
}

void WorkerReports::NoticeLost(const HostEntry& host, InstanceNumbers& touched) {
  for (const auto& [number, index] : std::set(host.workers)) {
    InstanceEntry& instance = state_.instance(number);
    touched.insert(number);
    const v1::InstanceState state = instance.record.state();
    if (state == v1::INSTANCE_STATE_STOPPING || state == v1::INSTANCE_STATE_FAILED)
      state_.SetGone(instance, instance.workers[index], "");
  }
}

}  // namespace tessera::control
