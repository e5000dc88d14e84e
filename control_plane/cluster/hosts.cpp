#include "control_plane/cluster/hosts.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <chrono>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "control_plane/cluster/host_rights.h"
#include "control_plane/cluster/names.h"
#include "control_plane/cluster/world_releases.h"
#include "control_plane/host_serial.h"
#include "control_plane/one_line.h"
#include "control_plane/release.h"
#include "control_plane/report_limits.h"
#include "core/world/limits.h"
#include "host/socket_address.h"

namespace tessera::control {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMaxVersionBytes = 128;
constexpr std::uint32_t kDefaultMaxRegions = 64;
constexpr std::int32_t kExitPortInUse = 98;  // EADDRINUSE, of a worker that never ran: as agent/limits.h has it
constexpr std::chrono::nanoseconds kDefaultTokenTtl = 24h, kLeastTokenTtl = 1min, kMostTokenTtl = 24h * 30;

absl::StatusOr<std::chrono::nanoseconds> TokenTtl(const v1::AddHostRequest& request) {
  if (!request.has_join_token_ttl()) return kDefaultTokenTtl;
  const google::protobuf::Duration& ttl = request.join_token_ttl();
  // Whole seconds are compared first: what is far beyond would not fit into nanoseconds.
  if (ttl.seconds() >= 0 && ttl.seconds() <= std::chrono::floor<std::chrono::seconds>(kMostTokenTtl).count()) {
    const auto span = std::chrono::seconds(ttl.seconds()) + std::chrono::nanoseconds(ttl.nanos());
    if (span >= kLeastTokenTtl && span <= kMostTokenTtl) return span;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("join_token_ttl: must be 1 minute to 30 days, got ", ttl.seconds(), " s"));
}

// Sizes come first: whoever says hello has proved nothing yet, and nothing of his is read through before.
absl::Status CheckSizes(const v1::AgentHello& hello) {
  struct Field {
    const char* name;
    const std::string& text;
    std::size_t most;
  };
  for (const Field& field :
       {Field{"join_token", hello.join_token(), kMaxSecretBytes}, Field{"host_id", hello.host_id(), kMaxNameBytes},
        Field{"host_secret", hello.host_secret(), kMaxSecretBytes},
        Field{"advertise_address", hello.advertise_address(), kMaxAddressBytes},
        Field{"metrics_address", hello.metrics_address(), kMaxAddressBytes},
        Field{"version", hello.version(), kMaxVersionBytes}, Field{"boot_id", hello.boot_id(), kMaxVersionBytes},
        Field{"certificate_request", hello.certificate_request(), kMaxCertificateRequestBytes}}) {
    if (field.text.size() <= field.most) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("hello.", field.name, ": has ", field.text.size(), " bytes, at most ", field.most));
  }
  return absl::OkStatus();
}

bool AtLoopback(const HostEntry& host) { return host::IsLoopback(host.record.advertise_address()); }

std::string LoopbackNote(const HostEntry& host) {
  return absl::StrCat("advertises ", host.record.advertise_address(),
                      ", where no other machine reaches it, so its regions get no links to those of other hosts: give "
                      "its agent --advertise-address");
}

}  // namespace

absl::Status CheckHello(const v1::AgentHello& hello) {
  if (absl::Status status = CheckSizes(hello); !status.ok()) return status;
  if (absl::Status status = CheckModules("hello", hello.game_modules()); !status.ok()) return status;
  if (absl::Status status = CheckReleases(hello.releases()); !status.ok()) return status;
  const std::string& address = hello.advertise_address();
  const auto has_only = [](const std::string& text, const char* more) {
    return std::all_of(text.begin(), text.end(), [more](char c) {
      return absl::ascii_isalnum(static_cast<unsigned char>(c)) || absl::StrContains(more, c);
    });
  };
  if (hello.join_token().empty() == hello.host_id().empty()) {
    return absl::InvalidArgumentError("hello: needs either join_token, or host_id and host_secret");
  }
  if (address.empty() || !has_only(address, ".-")) {
    return absl::InvalidArgumentError(absl::StrCat("hello.advertise_address: \"", OneLine(address, kMaxNameBytes),
                                                   "\" is not an IPv4 address or a host name"));
  }
  if (!has_only(hello.metrics_address(), ".-:")) {
    return absl::InvalidArgumentError(absl::StrCat("hello.metrics_address: \"",
                                                   OneLine(hello.metrics_address(), kMaxNameBytes),
                                                   "\" is neither an IP address nor a host name"));
  }
  if (hello.metrics_port() > kMaxPort) {
    return absl::InvalidArgumentError(absl::StrCat("hello.metrics_port: ", hello.metrics_port(), " is not a port"));
  }
  return absl::OkStatus();
}

Hosts::Hosts(ClusterState& state, const ControlSettings& settings, RandomBytes random)
    : state_(state), settings_(settings), random_(std::move(random)) {}

// --- For operators.

absl::StatusOr<v1::AddHostResponse> Hosts::Add(const v1::AddHostRequest& request, Now now) {
  if (absl::Status status = CheckName(request.name()); !status.ok()) return status;
  for (const auto& [number, host] : state_.hosts()) {
    if (host.record.name() == request.name()) {
      return absl::AlreadyExistsError(
          absl::StrCat("name: ", host.record.id(), " is named ", request.name(), " already"));
    }
  }
  const auto ttl = TokenTtl(request);
  if (!ttl.ok()) return ttl.status();
  if (request.max_regions() > kMaxRegions) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_regions: must be 1 to ", kMaxRegions, ", got ", request.max_regions()));
  }
  records::Host record;
  record.set_name(request.name());
  record.set_max_regions(request.max_regions());
  *record.mutable_create_time() = ToTimestamp(now.unix_time);
  v1::AddHostResponse response;
  if (request.validate_only()) {
    HostEntry draft;
    draft.record = record;
    *response.mutable_host() = ViewOf(draft);
    return response;
  }
  response.set_join_token(MakeJoinToken(random_));
  record.set_join_token_hash(HashSecret(response.join_token()));
  *record.mutable_join_token_expire_time() = ToTimestamp(now.unix_time + *ttl);
  *response.mutable_join_token_expire_time() = record.join_token_expire_time();
  const auto added = state_.AddHost(std::move(record));
  if (!added.ok()) return added.status();
  *response.mutable_host() = ViewOf(**added);
  return response;
}

absl::StatusOr<v1::DrainHostResponse> Hosts::Drain(const v1::DrainHostRequest& request) {
  const HostEntry* found = FindHostByName(state_, request.name());
  if (found == nullptr) return NoHost(request.name());
  HostEntry& host = *state_.FindHost(found->record.id());
  records::Host next = host.record;
  next.set_draining(!request.undo());
  if (!request.validate_only() && next.draining() != host.record.draining()) {
    if (absl::Status status = state_.StoreHost(host, next); !status.ok()) return status;
  }
  v1::DrainHostResponse response;
  *response.mutable_host() = ViewOf(host);
  return response;
}

absl::StatusOr<HostEntry*> Hosts::FindRemovable(const v1::RemoveHostRequest& request) {
  const HostEntry* host = FindHostByName(state_, request.name());
  if (host == nullptr) return NoHost(request.name());
  if (!host->workers.empty() && !request.force()) {
    return absl::FailedPreconditionError(absl::StrCat(
        "name: ", host->workers.size(), host->workers.size() == 1 ? " region runs" : " regions run", " on host ",
        host->record.name(), ", first ", state_.instances().at(host->workers.begin()->first).record.id(),
        "; drain it first, or evict it by force"));
  }
  return state_.FindHost(host->record.id());
}

absl::Status Hosts::Remove(HostEntry& host, InstanceNumbers& touched) {
  const auto removed = absl::PermissionDeniedError(absl::StrCat(host.record.id(), " was removed"));
  const std::string name = host.record.name();
  const auto workers = host.workers;
  if (absl::Status status = state_.RemoveHost(host, removed); !status.ok()) return status;
  if (!workers.empty()) state_.Log(absl::StrCat("host evicted host=", name, " regions=", workers.size()));
  for (const auto& [number, index] : workers) {
    InstanceEntry& instance = state_.instance(number);
    instance.workers[index].evicted = true;
    state_.SetGone(instance, instance.workers[index], absl::StrCat("host ", name, " was evicted"));
    touched.insert(number);
  }
  return absl::OkStatus();
}

// --- For agents.

absl::StatusOr<HostEntry*> Hosts::Authenticate(const v1::AgentHello& hello, Now now) {
  if (!hello.join_token().empty()) {
    const auto admitted = HostOfJoinToken(state_, hello.join_token(), now);
    if (!admitted.ok()) return admitted.status();
    return state_.FindHost((*admitted)->record.id());
  }
  HostEntry* host = state_.FindHost(hello.host_id());
  const std::uint64_t number = NumberOf(hello.host_id(), kHostId);
  if (host == nullptr && state_.WasHost(number)) {
    return absl::PermissionDeniedError(absl::StrCat("hello.host_id: host-", number, " was removed"));
  }
  if (host == nullptr || !SecretMatches(hello.host_secret(), host->record.secret_hash())) {
    return absl::UnauthenticatedError("hello.host_secret: is not that of the host");
  }
  return host;
}

absl::Status Hosts::TakeSerial(const HostEntry& host, const std::string& shown, records::Host& next) {
  // Once more: the door's answer may be older than what another stream of the host has shown.
  if (absl::Status status = CheckHostCertificate(state_, host.record.id(), shown); !status.ok()) return status;
  if (shown == host.record.certificate_serial()) return absl::OkStatus();
  next.set_certificate_serial(shown);
  state_.Log(
      absl::StrCat("host shows its next certificate host=", host.record.name(), " renewals=", RenewalsOf(shown)));
  return absl::OkStatus();
}

absl::StatusOr<Admission> Hosts::Admit(const v1::AgentHello& hello, Now now, const std::string& shown_serial) {
  if (absl::Status status = CheckHello(hello); !status.ok()) return status;
  if (absl::Status status = CheckRelease(hello.version(), settings_.release); !status.ok()) return status;
  const auto authenticated = Authenticate(hello, now);
  if (!authenticated.ok()) return authenticated.status();
  HostEntry& host = **authenticated;
  Admission admission;
  records::Host next = host.record;
  next.set_advertise_address(hello.advertise_address());
  next.set_metrics_port(hello.metrics_port());
  next.set_metrics_address(hello.metrics_address());
  *next.mutable_resources() = hello.resources();
  next.set_version(hello.version());
  next.set_boot_id(hello.boot_id());
  *next.mutable_game_modules() = hello.game_modules();
  *next.mutable_releases() = hello.releases();
  if (!hello.join_token().empty()) {
    admission.admitted.set_host_secret(MakeHostSecret(random_));
    next.set_secret_hash(HashSecret(admission.admitted.host_secret()));
    if (!hello.certificate_request().empty()) {
      admission.serial = MakeSerial(random_);
      next.set_certificate_serial(admission.serial);
    }
  } else if (!shown_serial.empty()) {
    if (absl::Status status = TakeSerial(host, shown_serial, next); !status.ok()) return status;
    if (!hello.certificate_request().empty()) admission.serial = NextHostSerial(shown_serial);
  }
  const bool moved = next.advertise_address() != host.record.advertise_address();
  if (next.SerializeAsString() != host.record.SerializeAsString()) {
    if (absl::Status status = state_.StoreHost(host, next); !status.ok()) return status;
  }
  if (hello.join_token().empty()) NoteSecretCame(host);
  WarnOfLoopback(host, moved);
  admission.stream =
      state_.OpenStream(host, absl::AbortedError(absl::StrCat("another agent attached as ", host.record.id())));
  admission.admitted.set_host_id(host.record.id());
  admission.admitted.set_host_name(host.record.name());
  admission.admitted.set_heartbeat_interval_ms(static_cast<std::uint32_t>(settings_.heartbeat_interval.count()));
  return admission;
}

void Hosts::NoteSecretCame(HostEntry& host) {
  if (host.record.join_token_hash().empty()) return;
  records::Host next = host.record;
  next.clear_join_token_hash();
  next.clear_join_token_expire_time();
  state_.StoreHost(host, next).IgnoreError();  // else it is stored with the next message
}

// Also of others, whom nobody warned of while the cluster was on one machine.
void Hosts::WarnOfLoopback(const HostEntry& host, bool moved) {
  if (!ReachesOtherMachines(state_)) return;
  for (const auto& [number, other] : state_.hosts()) {
    if (!AtLoopback(other) || (other.number != host.number && !moved)) continue;
    state_.Log(absl::StrCat("host cannot be reached host=", other.record.name(), ": ", LoopbackNote(other)),
               Severity::kWarning);
  }
}

absl::Status Hosts::NoteModules(HostEntry& host, const v1::GameModuleList& modules) {
  // One that says the same again and again costs no write.
  if (modules.SerializeAsString() == host.record.game_modules().SerializeAsString()) return absl::OkStatus();
  records::Host next = host.record;
  *next.mutable_game_modules() = modules;
  return state_.StoreHost(host, next);
}

// --- Liveness.

Steady Hosts::OwnPause(Now now) {
  const Steady paused = last_call_.count() == 0 ? Steady(0) : now.steady - last_call_;
  last_call_ = now.steady;
  if (paused <= kOwnPause) return Steady(0);
  Forgive(paused, now);
  return paused;
}

Steady Hosts::OwnDeafness(Now now) {
  const Steady deaf = now.steady - any_heard_;
  if (deaf > kOwnPause) Forgive(deaf, now);
  any_heard_ = now.steady;
  return deaf > kOwnPause ? deaf : Steady(0);
}

void Hosts::Forgive(Steady span, Now now) {
  any_heard_ = std::min(now.steady, any_heard_ + span);
  for (HostEntry& host : state_.EachHost()) host.last_heard = std::min(now.steady, host.last_heard + span);
}

void Hosts::NoteHeartbeat(HostEntry& host, const v1::AgentHeartbeat& heartbeat, Now now) {
  host.last_heartbeat_time = now.unix_time;
  if (!heartbeat.has_time()) return;  // an agent of an earlier release
  // Not as nanoseconds: a host may say any time, and those would overflow.
  host.clock_ahead_s = static_cast<double>(heartbeat.time().seconds()) + 1e-9 * heartbeat.time().nanos() -
                       std::chrono::duration<double>(now.unix_time).count();
}

bool Hosts::Heard(HostEntry& host, Now now) {
  host.last_heard = now.steady;
  if (!host.lost) return false;
  host.lost = false;
  state_.Log(absl::StrCat("host is back host=", host.record.name()));
  return true;
}

void Hosts::NoteExit(HostEntry& host, const v1::WorkerExited& exited, Now now) {
  if (exited.started() || exited.signal() != 0 || exited.exit_code() != kExitPortInUse) return;
  if (host.no_ports_until.count() == 0) {
    host.no_ports_since = now.unix_time;
    state_.Log(absl::StrCat("host has no free ports host=", host.record.name(), ": regions go elsewhere for ",
                            std::chrono::duration_cast<std::chrono::minutes>(kNoPortsInterval).count(), " minutes"),
               Severity::kWarning);
  }
  host.no_ports_until = now.steady + kNoPortsInterval;
}

void Hosts::ForgetNoPorts(HostEntry& host, Now now) {
  if (host.no_ports_until.count() == 0 || now.steady < host.no_ports_until) return;
  host.no_ports_until = Steady(0);
  state_.Log(absl::StrCat("host is given regions again host=", host.record.name()));
}

bool Hosts::Lost(HostEntry& host, Now now) {
  const bool admitted = !host.record.secret_hash().empty();
  if (!admitted || host.lost || now.steady - host.last_heard <= settings_.lost_after) return false;
  host.lost = true;
  state_.Log(absl::StrCat("host lost host=", host.record.name(), " regions=", host.workers.size()), Severity::kWarning);
  return true;
}

// --- Reading.

const HostEntry* FindHostByName(const ClusterState& state, const std::string& name_or_id) {
  for (const auto& [number, host] : state.hosts()) {
    if (host.record.name() == name_or_id) return &host;
  }
  return state.FindHost(name_or_id);
}

absl::Status NoHost(const std::string& name) {
  return absl::NotFoundError(absl::StrCat("name: no host ", OneLine(name, kMaxNameBytes)));
}

v1::HostState StateOf(const HostEntry& host) {
  if (host.record.secret_hash().empty()) return v1::HOST_STATE_EXPECTED;
  if (host.lost) return v1::HOST_STATE_LOST;
  return host.record.draining() ? v1::HOST_STATE_DRAINING : v1::HOST_STATE_READY;
}

std::uint32_t MaxRegionsOf(const HostEntry& host) {
  return host.record.max_regions() == 0 ? kDefaultMaxRegions : host.record.max_regions();
}

std::uint32_t CapacityOf(const HostEntry& host) {
  return std::min(host.record.resources().region_capacity(), MaxRegionsOf(host));
}

v1::Host ViewOf(const HostEntry& host) {
  v1::Host view;
  view.set_id(host.record.id());
  view.set_name(host.record.name());
  view.set_state(StateOf(host));
  view.set_advertise_address(host.record.advertise_address());
  if (host.record.has_resources()) *view.mutable_resources() = host.record.resources();
  view.set_regions(static_cast<std::uint32_t>(host.workers.size()));
  view.set_version(host.record.version());
  *view.mutable_create_time() = host.record.create_time();
  if (host.last_heartbeat_time.count() != 0)
    *view.mutable_last_heartbeat_time() = ToTimestamp(host.last_heartbeat_time);
  view.set_metrics_port(host.record.metrics_port());
  view.set_max_regions(MaxRegionsOf(host));
  *view.mutable_game_modules() = host.record.game_modules().modules();
  for (const std::string& release : ReleasesOf(host.record)) view.add_releases(release);
  for (const v1::WorkerOrder& unknown : host.record.unknown_workers()) {
    v1::WorkerIdentity& identity = *view.add_unknown_workers();
    identity.set_instance_id(unknown.instance_id());
    identity.set_region(unknown.region());
    identity.set_incarnation(unknown.incarnation());
  }
  return view;
}

bool ReachesOtherMachines(const ClusterState& state) {
  return std::any_of(state.hosts().begin(), state.hosts().end(), [](const auto& entry) {
    const HostEntry& host = entry.second;
    return !host.record.advertise_address().empty() && !AtLoopback(host);
  });
}

void AddNotes(const HostEntry& host, bool reaches, v1::Host& view) {
  if (reaches && AtLoopback(host)) view.add_notes(LoopbackNote(host));
  if (host.no_ports_until.count() == 0) return;
  google::protobuf::Timestamp since = ToTimestamp(host.no_ports_since);
  since.set_nanos(0);
  view.add_notes(absl::StrCat("has had no free ports for a worker at ",
                              google::protobuf::util::TimeUtil::ToString(since), ", so regions go elsewhere for ",
                              std::chrono::duration_cast<std::chrono::minutes>(kNoPortsInterval).count(),
                              " minutes: widen its agent's --port-range, or free its ports"));
}

absl::Status CheckHostCertificate(const ClusterState& state, const std::string& host_id, const std::string& serial) {
  const HostEntry* host = state.FindHost(host_id);
  if (host != nullptr && CountsAsSerial(serial, host->record.certificate_serial())) return absl::OkStatus();
  if (host == nullptr && state.WasHost(NumberOf(host_id, kHostId))) {
    return absl::PermissionDeniedError(absl::StrCat(host_id, " was removed"));
  }
  return absl::UnauthenticatedError(absl::StrCat("the certificate is not that of ", OneLine(host_id, kMaxNameBytes)));
}

absl::Status CheckHostSecret(const ClusterState& state, const std::string& host_id, const std::string& secret) {
  const HostEntry* host = state.FindHost(host_id);
  if (host == nullptr || !SecretMatches(secret, host->record.secret_hash())) {
    return absl::UnauthenticatedError("host_secret: is not that of the host");
  }
  return absl::OkStatus();
}

}  // namespace tessera::control
