// The agent and its control plane.
#include "agent/agent.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "host/files.h"
#include "telemetry/logging.h"
#include "trust/certificate.h"

namespace tessera::agent {

using telemetry::LogValue;

v1::AgentHello Agent::Hello() const {
  v1::AgentHello hello;
  if (identity_) {
    hello.set_host_id(identity_->host_id());
    hello.set_host_secret(identity_->host_secret());
    hello.set_newest_life(identity_->newest_life());
  } else {
    hello.set_join_token(options_.join_token);
  }
  if (!requested_key_.empty()) {
    if (auto request = trust::MakeRequest(requested_key_); request.ok()) hello.set_certificate_request(*request);
  }
  hello.set_advertise_address(options_.advertise_address);
  hello.set_metrics_port(metrics_server_->port());
  hello.set_metrics_address(MetricsAddressOfHost(options_.metrics_host));
  hello.mutable_resources()->set_cores(std::max(std::thread::hardware_concurrency(), 1U));
  hello.mutable_resources()->set_memory_bytes(static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                                              static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)));
  hello.mutable_resources()->set_region_capacity(options_.capacity);
  hello.set_version(TESSERA_VERSION);
  for (std::string& release : programs_.releases()) hello.add_releases(std::move(release));
  hello.set_boot_id(boot_id_);
  *hello.mutable_game_modules() = game_modules_;
  hello.set_revocations_number(revocations_.number());
  hello.set_takes_player_changes(true);
  for (v1::WorkerReport& report : supervisor_.Reports()) *hello.add_workers() = std::move(report);
  return hello;
}

void Agent::OnModules(const v1::GameModuleList& list) {
  game_modules_ = list;
  v1::AgentMessage message;
  *message.mutable_game_modules() = list;
  if (session_) session_->Send(std::move(message));
}

v1::AgentHeartbeat Agent::Heartbeat() {
  v1::AgentHeartbeat heartbeat;
  heartbeat.set_desired_revision(supervisor_.desired_revision());
  const auto time = std::chrono::system_clock::now().time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  heartbeat.mutable_time()->set_seconds(seconds.count());
  heartbeat.mutable_time()->set_nanos(static_cast<int>(std::chrono::nanoseconds(time - seconds).count()));
  for (v1::WorkerReport& report : supervisor_.Reports()) *heartbeat.add_workers() = std::move(report);
  metrics_.Heartbeat();
  if (workers_aside_) TellWorkersAside();  // until somebody has looked at it, and removed it
  KeepRevocations();
  return heartbeat;
}

void Agent::OnAdmitted(const v1::Admitted& admitted) {
  const bool renews = identity_ && !requested_key_.empty();
  const absl::Status kept = KeepIdentity(admitted);
  if (!kept.ok() && !renews) {
    spdlog::error("cannot keep what the control plane gave: {}", std::string(kept.message()));
    return Finish(1);
  }
  if (renews) NoteRenewal(admitted, kept);
  requested_key_.clear();
  // With the certificate that just came: a new host's calls without it are not let in.
  if (kept.ok() && !admitted.certificate().empty()) return session_->Redial();
  TellCertificate();
  metrics_.SetConnected(true);
  notify_.Ready();
  WriteReadyFile();
  contents_.Connected(session_->link(), *identity_);
  states_.Connected(session_->link(), *identity_);
  for (const v1::WorkerExited& exited : supervisor_.Exits()) SendExited(exited);
  for (const auto& [key, inventory] : inventories_) {
    v1::AgentMessage message;
    *message.mutable_inventory() = inventory;
    session_->Send(std::move(message));
  }
  if (admitted.report_revocations() && revocations_.number() > 0) {
    v1::AgentMessage message;
    *message.mutable_revocations() = revocations_.newest();
    session_->Send(std::move(message));
  }
  if (admitted.report_orders()) {
    v1::AgentMessage message;
    *message.mutable_held_orders() = supervisor_.HeldOrders();
    session_->Send(std::move(message));
  }
  Settle();
}

absl::Status Agent::KeepIdentity(const v1::Admitted& admitted) {
  HostIdentity identity;
  if (identity_) identity = *identity_;
  identity.set_host_id(admitted.host_id());
  identity.set_host_name(admitted.host_name());
  if (!admitted.host_secret().empty()) identity.set_host_secret(admitted.host_secret());
  if (identity.revocations_key().empty()) identity.set_revocations_key(admitted.revocations_key());
  if (!admitted.certificate().empty()) {
    identity.set_certificate(admitted.certificate());
    identity.set_authority(admitted.authority());
    identity.set_key(requested_key_);
    identity.set_certificate_time(UnixSeconds());
  }
  if (identity.host_id().empty() || identity.host_secret().empty()) {
    return absl::InvalidArgumentError("admitted: host_id or host_secret is empty");
  }
  const bool same = identity_ && identity_->SerializeAsString() == identity.SerializeAsString();
  const absl::Status saved = same ? absl::OkStatus() : state_->SaveIdentity(identity);
  if (identity_ && !same) NoteSaved(StateFile::kIdentity, saved);
  // Without them the next agent would be nobody, or show a certificate that has been replaced. All else is remembered.
  if (!saved.ok() && (!identity_ || !admitted.certificate().empty())) return saved;
  const bool first_key = !identity_ || identity_->revocations_key() != identity.revocations_key();
  identity_ = std::move(identity);
  if (first_key) BeginRevocations();
  if (!admitted.revocations_key().empty() && identity_->revocations_key() != admitted.revocations_key()) {
    spdlog::error(
        "the control plane signs revocations with another key than {} has: its lists are refused, and workers "
        "get no leases once there is one; to begin anew, remove the host and add it again",
        state_->IdentityPath());
  }
  return absl::OkStatus();
}

// --- Revocations

void Agent::BeginRevocations() {
  if (!identity_ || identity_->revocations_key().empty()) return;
  if (absl::Status status = revocations_.Begin(identity_->revocations_key()); !status.ok()) {
    spdlog::warn("kept revocations count for nothing error={}", LogValue(std::string(status.message())));
  }
  supervisor_.SetRevoked(revocations_.lives());
}

// Before the orders that come with it are acted on.
void Agent::TakeRevocations(const v1::SignedRevocations& list) {
  unkept_revocations_ = list;
  KeepRevocations();
}

// Where the disk does not take the list it is tried again with each heartbeat: until then it is not said to be kept.
void Agent::KeepRevocations() {
  if (!unkept_revocations_) return;
  const absl::Status status = revocations_.Take(*unkept_revocations_);
  metrics_.SetStateFailing(StateFile::kRevocations, absl::IsUnavailable(status));
  if (!status.ok()) {
    if (!absl::IsUnavailable(status)) unkept_revocations_.reset();
    const std::string why(status.message());
    if (std::exchange(revocations_trouble_, why) == why) return;
    spdlog::error("revocations not kept number={} error={}", revocations_.number(), LogValue(why));
    return;
  }
  unkept_revocations_.reset();
  revocations_trouble_.clear();
  spdlog::info("revocations kept number={}", revocations_.number());
  supervisor_.SetRevoked(revocations_.lives());
  v1::AgentMessage message;
  message.set_kept_revocations(revocations_.number());
  session_->Send(std::move(message));
}

// Before the orders of that life are acted on. A disk that takes nothing keeps no order from being carried out: this
// agent remembers the life as long as it runs, and only the next one might let in what is over.
void Agent::KeepLife(std::uint64_t life) {
  identity_->set_newest_life(life);
  SaveIdentity();
}

void Agent::OnDesired(const v1::DesiredSet& set) {
  if (set.has_revocations()) TakeRevocations(set.revocations());
  const std::vector<OrderOutcome> outcomes = supervisor_.Desired(set, Clock::now());
  Settle();
  const bool notable = std::ranges::any_of(outcomes, &OrderOutcome::changed);
  spdlog::log(notable ? spdlog::level::info : spdlog::level::debug, "desired set from=control revision={} workers={}",
              set.revision(), set.workers_size());
  for (const OrderOutcome& outcome : outcomes) {
    spdlog::log(outcome.changed ? spdlog::level::info : spdlog::level::debug,
                "order from=control worker={} revision={} outcome={} op={}", LogValue(outcome.key.ToString()),
                outcome.revision, LogValue(outcome.what), LogValue(outcome.operation));
  }
  if (supervisor_.TakeNeedsWhole()) session_->Redial();
}

void Agent::OnLease(const v1::LeaseRenewal& renewal) {
  const auto found = connections_.find(KeyOf(renewal.identity()));
  if (found != connections_.end()) socket_->SendLease(found->second, renewal);
}

void Agent::OnRefused(const absl::Status& status) {
  spdlog::error("control plane {} refused this host: {}{}", options_.control, std::string(status.message()),
                identity_ ? absl::StrCat(" (identity from ", state_->IdentityPath(),
                                         "; to join anew, remove it and give a join token)")
                          : "");
  exit_code_ = 1;
  if (absl::IsPermissionDenied(status) && !supervisor_.Empty()) {
    // The host was removed, so others carry its regions on: at once, and without a word to their players.
    EndWorkers();
    return EndWorkers();
  }
  if (options_.stop_workers && !supervisor_.Empty()) return EndWorkers();
  Finish(1);
}

void Agent::OnAway() {
  contents_.Away();
  states_.Away();
  metrics_.SetConnected(false);
  Settle();
}

void Agent::SendExited(const v1::WorkerExited& exited) {
  v1::AgentMessage message;
  *message.mutable_exited() = exited;
  session_->Send(std::move(message));
}

void Agent::WriteReadyFile() {
  if (options_.ready_file.empty() || std::exchange(ready_written_, true)) return;
  ReadyFile ready;
  ready.set_host_id(identity_->host_id());
  ready.set_metrics(metrics_server_->address());
  ready.set_pid(getpid());
  absl::StatusOr<std::string> json = ToJson(ready);
  absl::Status status = json.ok()
                            ? host::WriteFile(options_.ready_file, *json + "\n", host::Durability::kSurvivesProcess)
                            : json.status();
  if (!status.ok()) spdlog::error("--ready-file {}", std::string(status.message()));
}

}  // namespace tessera::agent
