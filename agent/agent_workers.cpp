// The agent and its workers: their processes, their connections, and what the supervisor has decided about them.
#include "agent/agent.h"

#include <spdlog/spdlog.h>

#include <array>
#include <csignal>
#include <set>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "host/socket_address.h"
#include "telemetry/logging.h"

namespace tessera::agent {

namespace {

using telemetry::LogValue;

// systemd addresses these variables to this program alone.
constexpr std::array kServiceVariables = {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID",
                                          "LISTEN_FDS",    "LISTEN_PID",    "LISTEN_FDNAMES"};

std::string GroupOf(const WorkerKey& key) {
  return absl::StrCat("worker-", key.instance_id, "-", key.region, "-", key.incarnation);
}

}  // namespace

void Agent::OnWorkerMessage(ConnectionId connection, pid_t peer, const v1::WorkerMessage& message) {
  if (message.has_report()) OnWorkerReport(connection, peer, message.report());
  const auto known = attached_.find(connection);
  if (known != attached_.end()) PassOn(known->second, message);
}

// Passes on messages that only the control plane reads. The identity is filled in here: a worker is not believed about
// it.
void Agent::PassOn(const WorkerKey& key, const v1::WorkerMessage& message) {
  v1::AgentMessage up;
  if (message.has_lease()) {
    *up.mutable_lease() = message.lease();
    *up.mutable_lease()->mutable_identity() = IdentityOf(key);
    if (session_) session_->Send(up);
  }
  if (message.has_inventory()) {
    v1::InventoryReport& inventory = inventories_[key];
    inventory = message.inventory();
    *inventory.mutable_identity() = IdentityOf(key);
    *up.mutable_inventory() = inventory;
    if (session_) session_->Send(up);
  }
}

void Agent::OnWorkerReport(ConnectionId connection, pid_t peer, const v1::WorkerReport& report) {
  if (const auto known = attached_.find(connection); known != attached_.end()) {
    supervisor_.Reported(known->second, report);
    return Settle();
  }
  const absl::StatusOr<WorkerKey> key = supervisor_.Attached(report, peer);
  if (!key.ok()) {
    NoteRefused(report.identity(), key.status());
    return socket_->Close(connection, key.status());
  }
  if (const auto old = connections_.find(*key); old != connections_.end()) {
    attached_.erase(old->second);
    socket_->Close(old->second, absl::AbortedError("attached anew"));
  }
  connections_[*key] = connection;
  attached_[connection] = *key;
  spdlog::info("worker attached worker={} pid={}", LogValue(key->ToString()), report.identity().pid());
  NoteFoundAttached(*key);
  Settle();
}

// Whoever claims to be a worker that runs here is told from who claims to be one of long ago: a flood of the one kind
// leaves the other's lines in the log.
void Agent::NoteRefused(const v1::WorkerIdentity& says, const absl::Status& why) {
  const auto found = processes_.find(KeyOf(says));
  const bool runs_here = found != processes_.end() && found->second.process.pid() == says.pid();
  const auto left_out = (runs_here ? impostors_ : unknown_workers_).Take(telemetry::LogThrottle::Clock::now());
  if (left_out) {
    spdlog::warn("worker refused reason={} more={}", LogValue(std::string(why.message())), *left_out);
  }
}

void Agent::OnWorkerClosed(ConnectionId connection) {
  const auto found = attached_.find(connection);
  if (found == attached_.end()) return;
  const WorkerKey key = found->second;
  attached_.erase(found);
  connections_.erase(key);
  supervisor_.Detached(key);
  spdlog::debug("worker detached worker={}", LogValue(key.ToString()));
  Settle();
}

void Agent::OnWorkerFlood(pid_t peer) {
  metrics_.CutOff();
  if (const auto left_out = floods_.Take(telemetry::LogThrottle::Clock::now())) {
    spdlog::error("worker cut off pid={} reason=\"it says more than a worker may\" more={}", peer, *left_out);
  }
}

void Agent::Watch(const WorkerKey& key, host::Process process, const std::string& log_path) {
  const int pidfd = process.pidfd();
  processes_.insert_or_assign(key, RunningProcess{std::move(process), log_path});
  loop_->Watch(pidfd, [this, key] { OnProcessEnd(key); });
}

void Agent::OnProcessEnd(const WorkerKey& key) {
  const auto found = processes_.find(key);
  const host::ExitStatus status = found->second.process.Reap();
  std::vector<std::string> lines = host::LastLines(found->second.log_path, kLastLines);
  loop_->Unwatch(found->second.process.pidfd());
  processes_.erase(found);
  // All messages of its connection, such as why it failed, were posted before; a connection that is left is history.
  if (const auto connection = connections_.find(key); connection != connections_.end()) {
    attached_.erase(connection->second);
    connections_.erase(connection);
  }
  inventories_.erase(key);
  NoteFoundAttached(key);  // or never will be
  states_.Forget(key, state_->StatesPath());
  state_->ForgetOrder(IdentityOf(key));
  unkept_orders_.erase(key);
  if (cgroups_) cgroups_->Remove(GroupOf(key));
  supervisor_.Ended(key, status, std::move(lines));
  Settle();
  std::set<std::string> in_use;
  for (const auto& [other, running] : processes_) in_use.insert(running.log_path);
  state_->PruneLogs(in_use);
}

std::vector<std::string> Agent::WorkerArguments(const SpawnWorker& action) const {
  const auto port = [&](int offset) { return std::to_string(action.first_port + offset); };
  // Seen by everybody on this machine, so nothing secret: keys come with the order, over the socket.
  std::vector<std::string> arguments{
      programs_.ProgramOf(action.release),
      "--agent-socket",
      state_->SocketPath(),
      "--instance",
      action.key.instance_id,
      "--region",
      std::to_string(action.key.region),
      "--incarnation",
      std::to_string(action.key.incarnation),
      "--bind-address",
      options_.bind_address,
      "--advertise-address",
      options_.advertise_address,
      "--game-port",
      port(0),
      "--link-port",
      port(1),
      "--metrics-listen",
      host::ToString(host::SocketAddress{options_.metrics_host, static_cast<std::uint16_t>(action.first_port + 2)}),
  };
  if (action.max_players != 0 && action.max_players != kUsualPlayers) {
    arguments.insert(arguments.end(), {"--max-players", std::to_string(action.max_players)});
  }
  if (!options_.metrics_token_file.empty()) {
    arguments.insert(arguments.end(), {"--metrics-token-file", options_.metrics_token_file});
  }
  const telemetry::MetricsTlsFiles& tls = options_.metrics_tls;
  for (const auto& [option, file] :
       {std::pair("--metrics-tls-cert", tls.certificate), std::pair("--metrics-tls-key", tls.key),
        std::pair("--metrics-tls-client-ca", tls.client_authority)}) {
    if (!file.empty()) arguments.insert(arguments.end(), {option, file});
  }
  const std::vector<std::string> sandbox = SandboxArguments(action.key);
  arguments.insert(arguments.end(), sandbox.begin(), sandbox.end());
  arguments.insert(arguments.end(), {"--log-file", state_->LogPath(IdentityOf(action.key))});
  return arguments;
}

// It reads scenes and games of the host's worlds, and has a folder of its own for its states; logs are appended to.
std::vector<std::string> Agent::SandboxArguments(const WorkerKey& key) const {
  if (!options_.worker_sandbox) return {};
  std::vector<std::string> arguments{"--sandbox",   "on",
                                     "--memory-mb", std::to_string(options_.worker_memory_mb),
                                     "--writable",  StateFolderOf(state_->StatesPath(), key)};
  for (const std::string& folder : {state_->ScenesPath(), state_->GamesPath(), options_.game_modules}) {
    if (!folder.empty()) arguments.insert(arguments.end(), {"--readable", folder});
  }
  return arguments;
}

// Where there are none, the limits of the sandbox and of the unit hold.
void Agent::OpenCgroups() {
  if (!options_.worker_cgroups) return;
  auto opened = host::DelegatedCgroup::Open();
  if (!opened.ok()) {
    spdlog::warn("workers have no control groups missing={}", LogValue(std::string(opened.status().message())));
    return;
  }
  cgroups_ = *std::move(opened);
}

// Empty: it stays in the agent's.
std::string Agent::MakeCgroup(const WorkerKey& key) {
  if (!cgroups_) return "";
  auto made =
      cgroups_->Make(GroupOf(key), {.memory_bytes = options_.worker_memory_mb << 20, .tasks = options_.worker_tasks});
  if (made.ok()) return *std::move(made);
  spdlog::warn("worker has no control group worker={} reason={}", LogValue(key.ToString()),
               LogValue(std::string(made.status().message())));
  return "";
}

// --- What the supervisor wants ---

void Agent::Settle() {
  for (std::vector<Action> actions = supervisor_.TakeActions(); !actions.empty(); actions = supervisor_.TakeActions()) {
    for (const Action& action : actions) {
      std::visit([this](const auto& what) { Do(what); }, action);
    }
  }
  Save();
  metrics_.SetWorkers(processes_.size());
  const bool connected = session_ && session_->link();
  notify_.Status(absl::StrCat(processes_.size(), processes_.size() == 1 ? " worker" : " workers", "; control plane ",
                              connected ? "connected" : "away"));
  if (deadline_) loop_->Cancel(*deadline_);
  deadline_.reset();
  if (const auto next = supervisor_.NextDeadline()) {
    deadline_ = loop_->RunAt(*next, [this] {
      deadline_.reset();
      supervisor_.Tick(Clock::now());
      Settle();
    });
  }
  if (ending_workers_ && supervisor_.Empty()) Finish(exit_code_);
}

void Agent::Do(const SpawnWorker& action) {
  if (programs_.ProgramOf(action.release).empty()) {
    return supervisor_.SpawnFailed(action.key, absl::StrCat("this host has no worker program of release ",
                                                            action.release, " in ", options_.release_programs));
  }
  std::vector<std::string> argv = WorkerArguments(action);
  const std::string log_path = argv.back();
  if (absl::Status status = host::MakePrivateFolder(StateFolderOf(state_->StatesPath(), action.key)); !status.ok()) {
    return supervisor_.SpawnFailed(action.key, std::string(status.message()));
  }
  absl::StatusOr<host::Process> process =
      host::Process::Spawn({.argv = std::move(argv),
                            .log_path = log_path,
                            .parent_death_signal = options_.die_with_parent ? SIGKILL : 0,
                            .without_environment = {kServiceVariables.begin(), kServiceVariables.end()},
                            .cgroup = MakeCgroup(action.key)});
  if (!process.ok()) return supervisor_.SpawnFailed(action.key, std::string(process.status().message()));
  spdlog::info("worker started worker={} pid={} ports={}-{}", LogValue(action.key.ToString()), process->pid(),
               action.first_port, action.first_port + kPortsPerWorker - 1);
  metrics_.Started();
  supervisor_.Spawned(action.key, process->pid(), process->start_time(), log_path, Clock::now());
  Watch(action.key, *std::move(process), log_path);
  Save();  // now: a worker that is not in the file when this program dies would be refused by the next
}

void Agent::Do(const SignalWorker& action) {
  const auto found = processes_.find(action.key);
  if (found == processes_.end()) return;
  spdlog::warn("worker signalled worker={} pid={} signal={}", LogValue(action.key.ToString()),
               found->second.process.pid(), action.signal);
  found->second.process.Signal(action.signal);
}

void Agent::Do(const SendOrder& action) {
  const auto found = connections_.find(action.key);
  if (found == connections_.end()) return;
  spdlog::log(action.notable ? spdlog::level::info : spdlog::level::debug,
              "order sent worker={} revision={} run={} stop={} peers={} players={} op={}",
              LogValue(action.key.ToString()), action.order.revision(), action.order.run(), action.order.stop(),
              action.order.peers_size(), action.order.players_size(), LogValue(action.order.operation()));
  if (!action.order.has_failover() || action.order.has_resolution()) inventories_.erase(action.key);
  socket_->Send(found->second, action.order);
}

void Agent::Do(const KeepOrder& action) { SaveOrder(action.key, action.order); }

void Agent::Do(const FetchContent& action) { contents_.Want(action.content); }

void Agent::Do(const FetchState& action) { states_.Want(action); }

void Agent::Do(const UploadState& action) { states_.Upload(action); }

void Agent::Do(const ForwardReport& action) {
  v1::AgentMessage message;
  *message.mutable_report() = action.report;
  if (session_) session_->Send(std::move(message));
}

void Agent::Do(const ReportExit& action) {
  const v1::WorkerExited& exited = action.exited;
  const auto level = action.result == ExitResult::kClean ? spdlog::level::info : spdlog::level::err;
  spdlog::log(level, "worker ended worker={} pid={} started={} reason={} last_line={}",
              LogValue(KeyOf(exited.identity()).ToString()), exited.identity().pid(), exited.started(),
              LogValue(exited.reason()),
              LogValue(exited.last_log_lines().empty() ? "" : *exited.last_log_lines().rbegin()));
  if (exited.identity().pid() != 0) metrics_.Exited(action.result);
  if (session_) SendExited(exited);
}

}  // namespace tessera::agent
