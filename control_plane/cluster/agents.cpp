// Agents: admission, heartbeats, reports, exits, and what they are told to run.
#include <algorithm>
#include <tuple>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/id_ranges.h"
#include "control_plane/orders.h"

namespace tessera::control {
namespace {

constexpr std::size_t kMaxVersionBytes = 128;
constexpr std::uint32_t kMaxPort = 65535;

absl::Status CheckHello(const v1::AgentHello& hello) {
  const std::string& address = hello.advertise_address();
  const bool plain = std::all_of(address.begin(), address.end(), [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '-';
  });
  if (hello.join_token().empty() == hello.host_id().empty()) {
    return absl::InvalidArgumentError("hello: needs either join_token, or host_id and host_secret");
  }
  if (address.empty() || address.size() > kMaxAddressBytes || !plain) {
    return absl::InvalidArgumentError(absl::StrCat("hello.advertise_address: \"", OneLine(address, kMaxNameBytes),
                                                   "\" is not an IPv4 address or a host name"));
  }
  if (hello.metrics_port() > kMaxPort) {
    return absl::InvalidArgumentError(absl::StrCat("hello.metrics_port: ", hello.metrics_port(), " is not a port"));
  }
  if (hello.version().size() > kMaxVersionBytes || hello.boot_id().size() > kMaxVersionBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("hello.version, hello.boot_id: at most ", kMaxVersionBytes, " bytes"));
  }
  return absl::OkStatus();
}

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

}  // namespace

absl::StatusOr<HostEntry*> Cluster::Authenticate(const v1::AgentHello& hello) {
  if (!hello.join_token().empty()) {
    for (auto& [number, host] : hosts_) {
      if (SecretMatches(hello.join_token(), host.record.join_token_hash())) return &host;
    }
    return absl::UnauthenticatedError("hello.join_token: unknown, or used already");
  }
  const std::uint64_t number = NumberOf(hello.host_id(), "host-");
  const auto found = hosts_.find(number);
  if (found == hosts_.end() && number > 0 && number <= counters_.last_host()) {
    return absl::PermissionDeniedError(absl::StrCat("hello.host_id: host-", number, " was removed"));
  }
  if (found == hosts_.end() || !SecretMatches(hello.host_secret(), found->second.record.secret_hash())) {
    return absl::UnauthenticatedError("hello.host_secret: is not that of the host");
  }
  return &found->second;
}

absl::Status Cluster::CheckHostSecret(const std::string& host_id, const std::string& secret) const {
  const auto found = hosts_.find(NumberOf(host_id, "host-"));
  if (found == hosts_.end() || !SecretMatches(secret, found->second.record.secret_hash())) {
    return absl::UnauthenticatedError("host_secret: is not that of the host");
  }
  return absl::OkStatus();
}

absl::StatusOr<Cluster::Admission> Cluster::HandleHello(Moment now, const v1::AgentHello& hello) {
  NoteTime(now);
  if (absl::Status status = CheckHello(hello); !status.ok()) return status;
  const auto authenticated = Authenticate(hello);
  if (!authenticated.ok()) return authenticated.status();
  HostEntry& host = **authenticated;
  Admission admission;
  records::Host next = host.record;
  next.set_advertise_address(hello.advertise_address());
  next.set_metrics_port(hello.metrics_port());
  *next.mutable_resources() = hello.resources();
  next.set_version(hello.version());
  next.set_boot_id(hello.boot_id());
  if (!hello.join_token().empty()) {
    admission.admitted.set_host_secret(MakeHostSecret(random_));
    next.set_secret_hash(HashSecret(admission.admitted.host_secret()));
    next.clear_join_token_hash();
  }
  if (next.SerializeAsString() != host.record.SerializeAsString()) {
    if (absl::Status status = StoreHost(host, next); !status.ok()) return status;
  }
  if (host.session != 0) {
    effects_.closed[host.session] = absl::AbortedError(absl::StrCat("another agent attached as ", host.record.id()));
    sessions_.erase(host.session);
  }
  admission.session = host.session = ++last_session_;
  sessions_[host.session] = host.number;
  host.acted_revision = 0;
  admission.admitted.set_host_id(host.record.id());
  admission.admitted.set_host_name(host.record.name());
  admission.admitted.set_heartbeat_interval_ms(static_cast<std::uint32_t>(settings_.heartbeat_interval.count()));

  Heard(now, host);
  std::set<std::uint64_t> touched;
  TakeReports(now, host, hello.workers(), touched);
  NoticeAbsent(host, hello.workers(), std::nullopt, touched);
  MarkDesired(host);
  Reconcile(now, touched);
  return admission;
}

absl::StatusOr<HostEntry*> Cluster::HostOf(SessionId session) {
  const auto found = sessions_.find(session);
  if (found == sessions_.end()) return absl::AbortedError("this stream was replaced by another one");
  return &hosts_.at(found->second);
}

std::string Cluster::HostName(SessionId session) const {
  const auto found = sessions_.find(session);
  return found == sessions_.end() ? "" : hosts_.at(found->second).record.name();
}

absl::Status Cluster::HandleAgentMessage(Moment now, SessionId session, const v1::AgentMessage& message) {
  const auto found = HostOf(session);
  if (!found.ok()) return found.status();
  HostEntry& host = **found;
  NoteTime(now);
  Heard(now, host);
  std::set<std::uint64_t> touched;
  switch (message.kind_case()) {
    case v1::AgentMessage::kHeartbeat:
      return HandleHeartbeat(now, host, message.heartbeat());
    case v1::AgentMessage::kReport:
      TakeReport(now, host, message.report(), touched);
      break;
    case v1::AgentMessage::kExited:
      HandleExited(host, message.exited(), touched);
      break;
    case v1::AgentMessage::kInventory:
      if (absl::Status status = TakeInventory(now, host, message.inventory(), touched); !status.ok()) return status;
      break;
    case v1::AgentMessage::kLease:
      RenewLease(now, session, host, message.lease());
      return absl::OkStatus();
    case v1::AgentMessage::kHello:
      return absl::InvalidArgumentError("hello: only as the first message of a stream");
    case v1::AgentMessage::KIND_NOT_SET:
      return absl::InvalidArgumentError("kind: missing, or of a newer protocol");
  }
  Reconcile(now, touched);
  return absl::OkStatus();
}

absl::Status Cluster::HandleHeartbeat(Moment now, HostEntry& host, const v1::AgentHeartbeat& heartbeat) {
  host.last_heartbeat_time = now.unix_time;
  host.acted_revision = heartbeat.desired_revision();
  std::set<std::uint64_t> touched;
  TakeReports(now, host, heartbeat.workers(), touched);
  NoticeAbsent(host, heartbeat.workers(), heartbeat.desired_revision(), touched);
  Reconcile(now, touched);
  return absl::OkStatus();
}

void Cluster::HandleAgentGone(Moment, SessionId session) {
  const auto found = HostOf(session);
  if (!found.ok()) return;
  (*found)->session = 0;
  sessions_.erase(session);
}

// A message came: a host that was lost is back, and what was degraded with it.
void Cluster::Heard(Moment now, HostEntry& host) {
  host.last_heard = now.steady;
  if (!host.lost) return;
  host.lost = false;
  effects_.log.push_back(absl::StrCat("host is back host=", host.record.name()));
  std::set<std::uint64_t> touched;
  for (const auto& [number, index] : host.workers) touched.insert(number);
  Reconcile(now, touched);
}

void Cluster::MarkLost(Moment now, HostEntry& host) {
  host.lost = true;
  effects_.log.push_back(absl::StrCat("host lost host=", host.record.name(), " regions=", host.workers.size()));
  std::set<std::uint64_t> touched;
  for (const auto& [number, index] : std::set(host.workers)) {
    InstanceEntry& instance = instances_.at(number);
    touched.insert(number);
    // Nobody waits for those who were to end: should the host come back, they are not in its desired set.
    const v1::InstanceState state = instance.record.state();
    if (state == v1::INSTANCE_STATE_STOPPING || state == v1::INSTANCE_STATE_FAILED)
      SetGone(instance, instance.workers[index], "");
  }
  Reconcile(now, touched);
}

void Cluster::TakeReports(Moment now, HostEntry& host,
                          const google::protobuf::RepeatedPtrField<v1::WorkerReport>& reports,
                          std::set<std::uint64_t>& touched) {
  for (const v1::WorkerReport& report : reports) TakeReport(now, host, report, touched);
}

std::pair<InstanceEntry*, WorkerEntry*> Cluster::FindWorker(const HostEntry& host, const v1::WorkerIdentity& identity) {
  InstanceEntry* instance = FindInstance(identity.instance_id());
  if (instance == nullptr) return {nullptr, nullptr};
  for (std::size_t i = 0; i < instance->workers.size(); ++i) {
    const records::Placement& placement = instance->record.placements(static_cast<int>(i));
    if (placement.region() == identity.region() && placement.incarnation() == identity.incarnation() &&
        placement.host_id() == host.record.id()) {
      return {instance, &instance->workers[i]};
    }
  }
  return {nullptr, nullptr};
}

void Cluster::TakeReport(Moment now, HostEntry& host, const v1::WorkerReport& report,
                         std::set<std::uint64_t>& touched) {
  const auto [instance, worker] = FindWorker(host, report.identity());
  if (instance == nullptr || worker->gone) return;
  const v1::WorkerReport before = std::exchange(worker->report, report);
  const bool was_bound = before.phase() >= v1::WORKER_PHASE_BOUND && before.address().game_port() != 0;
  worker->reported = true;
  worker->reported_at = now.steady;
  worker->missed = 0;
  Witness(now, *instance, before, report);
  NoteTakenOut(*instance, report);
  TakePropertyAnswers(*instance, report);
  v1::RegionAddress& address = *worker->report.mutable_address();
  if (!ValidPorts(address)) address.Clear();
  address.set_region(worker->region);
  address.set_incarnation(report.identity().incarnation());
  address.set_host(host.record.advertise_address());
  if (worker->bound() != was_bound || (was_bound && !SamePorts(before.address(), address))) {
    MarkOrders(*instance);
    touched.insert(instance->number);
  }
  const bool changing = !AtRest(instance->record);
  if (changing || before.phase() != report.phase() || !SamePlayers(before, report)) touched.insert(instance->number);
  Changed(*instance);
}

// Bodies that came to be non-finite are not to be found again by a failover. One whose worker dies before it told of
// them counts as lost.
void Cluster::NoteTakenOut(InstanceEntry& instance, const v1::WorkerReport& report) {
  if (report.nonfinite_ids().empty()) return;
  records::Instance next = instance.record;
  bool news = false;
  for (const std::uint64_t id : report.nonfinite_ids()) news |= TakeOut(BodyId(id), *next.mutable_bodies());
  if (!news) return;
  if (absl::Status status = StoreInstance(instance, next); !status.ok()) {
    NoteTrouble(instance, "bodies taken out cannot be stored for now", status);
  }
}

// Workers that ran and are not named any more have died unseen; those that were to end have ended.
void Cluster::NoticeAbsent(HostEntry& host, const google::protobuf::RepeatedPtrField<v1::WorkerReport>& reports,
                           std::optional<std::uint64_t> acted_revision, std::set<std::uint64_t>& touched) {
  std::set<std::tuple<std::string, std::uint32_t, std::uint64_t>> named;
  for (const v1::WorkerReport& report : reports) {
    named.emplace(report.identity().instance_id(), report.identity().region(), report.identity().incarnation());
  }
  for (const auto& [number, index] : std::set(host.workers)) {
    InstanceEntry& instance = instances_.at(number);
    WorkerEntry& worker = instance.workers[index];
    const v1::InstanceState state = instance.record.state();
    if (named.contains(
            {instance.record.id(), worker.region, instance.record.placements(static_cast<int>(index)).incarnation()})) {
      continue;
    }
    if (WantsWorkers(state)) {
      const bool ran = worker.reported || instance.record.run() || state != v1::INSTANCE_STATE_STARTING;
      if (!ran || ++worker.missed < kMissedBeforeVanished) continue;
      SetGone(instance, worker, "worker vanished: its agent no longer names it");
      touched.insert(number);
    } else if (worker.ended_in != 0 && acted_revision >= worker.ended_in) {
      SetGone(instance, worker, "");
      touched.insert(number);
    }
  }
  if (host.desired_changed) MarkDesired(host);  // it may have been held back
}

void Cluster::HandleExited(HostEntry& host, const v1::WorkerExited& exited, std::set<std::uint64_t>& touched) {
  const auto [instance, worker] = FindWorker(host, exited.identity());
  if (instance == nullptr) {
    NoticeDeadExited(exited, touched);
    return;
  }
  if (worker->gone) return;
  const bool wanted = WantsWorkers(instance->record.state());
  const std::string what = wanted ? DescribeExit(exited, worker->report) : "";
  effects_.log.push_back(absl::StrCat("worker ended instance=", instance->record.id(), " region=", worker->region,
                                      " host=", host.record.name(), wanted ? ": " : " as asked", what));
  SetGone(*instance, *worker, what);
  touched.insert(instance->number);
}

void Cluster::MarkDesired(HostEntry& host) {
  host.desired_changed = true;
  if (host.session != 0) effects_.desired.insert(host.session);
}

// While a worker is missing that has run before, its agent must not be told to start "what is missing": that would give
// its incarnation to a second one. A few heartbeats tell whether it is dead.
bool Cluster::Holds(const HostEntry& host) const {
  return std::any_of(host.workers.begin(), host.workers.end(), [this](const auto& placed) {
    const InstanceEntry& instance = instances_.at(placed.first);
    return WantsWorkers(instance.record.state()) && instance.workers[placed.second].missed > 0;
  });
}

std::optional<v1::DesiredSet> Cluster::TakeDesired(Moment, SessionId session) {
  const auto found = HostOf(session);
  if (!found.ok() || !(*found)->desired_changed || Holds(**found)) return std::nullopt;
  HostEntry& host = **found;
  host.desired_changed = false;
  v1::DesiredSet desired;
  desired.set_revision(NextRevision());
  for (const auto& [number, index] : host.workers) {
    InstanceEntry& instance = instances_.at(number);
    WorkerEntry& worker = instance.workers[index];
    const v1::InstanceState state = instance.record.state();
    if (state == v1::INSTANCE_STATE_PENDING || state == v1::INSTANCE_STATE_PLACING) continue;
    if (!WantsWorkers(state) && worker.ended_in == 0) worker.ended_in = desired.revision();
    // A worker that has never been heard of is not asked to end in order, lest it be started for that.
    if (instance.withdrawn || (!WantsWorkers(state) && !worker.reported)) continue;
    v1::WorkerOrder order = MakeOrder(instance, index);
    order.set_revision(worker.order.revision());
    if (worker.order.revision() == 0 || order.SerializeAsString() != worker.order.SerializeAsString()) {
      order.set_revision(NextRevision());
      worker.order = std::move(order);
    }
    *desired.add_workers() = worker.order;
  }
  return desired;
}

}  // namespace tessera::control
