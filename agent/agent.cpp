#include "agent/agent.h"

#include <spdlog/spdlog.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <set>
#include <system_error>
#include <thread>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "telemetry/logging.h"

namespace tessera::agent {

namespace {

using telemetry::LogValue;

// What systemd told this program alone.
constexpr std::array kServiceVariables = {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID",
                                          "LISTEN_FDS",    "LISTEN_PID",    "LISTEN_FDNAMES"};

}  // namespace

// --- From the start to the first event
// ---------------------------------------------------------------------------------

absl::StatusOr<std::unique_ptr<Agent>> Agent::Create(const Options& options) {
  if (access(options.region_binary.c_str(), X_OK) != 0) {
    return absl::NotFoundError(
        absl::StrCat("worker program ", options.region_binary, ": ", std::strerror(errno), "; give --region-binary"));
  }
  auto state = StateDir::Open(options.state_dir);
  if (!state.ok()) return state.status();
  std::unique_ptr<Agent> agent(new Agent(options, *std::move(state)));
  if (absl::Status status = agent->Prepare(); !status.ok()) return status;
  return agent;
}

Agent::Agent(const Options& options, std::unique_ptr<StateDir> state)
    : options_(options),
      loop_(std::make_shared<EventLoop>()),
      state_(std::move(state)),
      boot_id_(BootId()),
      notify_(loop_),
      supervisor_(options_.ports, [this](std::uint16_t first) { return PortsFree(options_.bind_address, first); }),
      scenes_(loop_, *state_,
              {.on_ready =
                   [this](const std::string& hash, const std::string& path) {
                     supervisor_.SceneReady(hash, path);
                     Settle();
                   },
               .on_failed =
                   [this](const std::string& hash, const std::string& reason) {
                     supervisor_.SceneFailed(hash, reason);
                     Settle();
                   }}) {}

Agent::~Agent() {
  session_.reset();
  socket_.reset();
  if (signals_ >= 0) close(signals_);
}

absl::Status Agent::Prepare() {
  auto identity = state_->LoadIdentity();
  if (!identity.ok()) return identity.status();
  identity_ = *std::move(identity);
  if (absl::Status status = identity_ ? absl::OkStatus() : FindJoinToken(); !status.ok()) return status;
  if (!options_.ready_file.empty()) {
    std::error_code ignored;
    std::filesystem::remove(options_.ready_file, ignored);  // an earlier agent's must not be believed
  }
  auto server = telemetry::MetricsServer::Start(options_.metrics_host, options_.metrics_port, metrics_.registry());
  if (!server.ok()) return server.status();
  metrics_server_ = *std::move(server);
  if (absl::Status status = Restore(); !status.ok()) return status;

  WorkerSocket::Callbacks callbacks;
  callbacks.on_report = [this, loop = loop_](ConnectionId connection, v1::WorkerReport report) {
    loop->Post([this, connection, report = std::move(report)] { OnWorkerReport(connection, report); });
  };
  callbacks.on_closed = [this, loop = loop_](ConnectionId connection) {
    loop->Post([this, connection] { OnWorkerClosed(connection); });
  };
  auto socket = WorkerSocket::Serve(state_->SocketPath(), std::move(callbacks));
  if (!socket.ok()) return socket.status();
  socket_ = *std::move(socket);
  WatchSignals();
  return absl::OkStatus();
}

absl::Status Agent::FindJoinToken() {
  const std::string why = absl::StrCat("this host has not been admitted yet (no ", state_->IdentityPath(), "): ");
  auto token = ReadJoinToken(options_);
  if (!token.ok()) return absl::InvalidArgumentError(absl::StrCat(why, token.status().message()));
  if (token->empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(why, "give --join-token-file, --join-token or TESSERA_JOIN_TOKEN, from `tessera host add NAME`"));
  }
  options_.join_token = *std::move(token);
  return absl::OkStatus();
}

absl::Status Agent::Restore() {
  auto file = state_->LoadWorkers();
  if (!file.ok()) return file.status();
  for (const v1::WorkerExited& exited : file->exits()) supervisor_.AdoptExit(exited);
  for (const WorkerRecord& record : file->workers()) RestoreWorker(record, file->boot_id() == boot_id_);
  Settle();
  return absl::OkStatus();
}

void Agent::RestoreWorker(const WorkerRecord& record, bool same_boot) {
  const WorkerKey key = KeyOf(record.identity());
  absl::StatusOr<Process> process = absl::NotFoundError("the host was started anew");
  if (same_boot) process = Process::Adopt(static_cast<pid_t>(record.identity().pid()), record.start_time());
  if (!process.ok()) {
    const std::string reason = same_boot ? "ended while no agent ran; its exit status is unknown"
                                         : "ended with the host, which was started anew";
    supervisor_.AdoptGone(record, reason, LastLines(record.log_path(), kLastLines));
    return;
  }
  spdlog::info("worker adopted worker={} pid={}", LogValue(key.ToString()), process->pid());
  supervisor_.Adopt(record);
  Watch(key, *std::move(process), record.log_path());
}

void Agent::WatchSignals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&set, signal);
  signals_ = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  loop_->Watch(signals_, [this] { OnSignal(); });
}

int Agent::Run() {
  ControlSession::Callbacks callbacks;
  callbacks.hello = [this] { return Hello(); };
  callbacks.heartbeat = [this] { return Heartbeat(); };
  callbacks.on_admitted = [this](const v1::Admitted& admitted) { OnAdmitted(admitted); };
  callbacks.on_desired = [this](const v1::DesiredSet& set) { OnDesired(set); };
  callbacks.on_refused = [this](const absl::Status& status) { OnRefused(status); };
  callbacks.on_away = [this] {
    scenes_.Away();
    metrics_.SetConnected(false);
    Settle();
  };
  session_ = std::make_unique<ControlSession>(loop_, options_.control, std::move(callbacks));
  spdlog::info("agent started version={} control={} socket={} metrics={} workers={}", TESSERA_VERSION,
               LogValue(options_.control), LogValue(state_->SocketPath()), metrics_server_->address(),
               supervisor_.size());
  if (identity_) notify_.Ready();  // admitted in an earlier life: the workers are cared for from here on
  session_->Start();
  Settle();
  loop_->Run();
  return exit_code_;
}

// --- The control plane
// -------------------------------------------------------------------------------------------------

v1::AgentHello Agent::Hello() const {
  v1::AgentHello hello;
  if (identity_) {
    hello.set_host_id(identity_->host_id());
    hello.set_host_secret(identity_->host_secret());
  } else {
    hello.set_join_token(options_.join_token);
  }
  hello.set_advertise_address(options_.advertise_address);
  hello.set_metrics_port(metrics_server_->port());
  hello.mutable_resources()->set_cores(std::max(std::thread::hardware_concurrency(), 1U));
  hello.mutable_resources()->set_memory_bytes(static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                                              static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)));
  hello.mutable_resources()->set_region_capacity(options_.capacity);
  hello.set_version(TESSERA_VERSION);
  hello.set_boot_id(boot_id_);
  for (v1::WorkerReport& report : supervisor_.Reports()) *hello.add_workers() = std::move(report);
  return hello;
}

v1::AgentHeartbeat Agent::Heartbeat() {
  v1::AgentHeartbeat heartbeat;
  heartbeat.set_desired_revision(supervisor_.desired_revision());
  for (v1::WorkerReport& report : supervisor_.Reports()) *heartbeat.add_workers() = std::move(report);
  metrics_.Heartbeat();
  return heartbeat;
}

void Agent::OnAdmitted(const v1::Admitted& admitted) {
  if (absl::Status status = KeepIdentity(admitted); !status.ok()) {
    spdlog::error("cannot keep what the control plane gave: {}", std::string(status.message()));
    return Finish(1);
  }
  metrics_.SetConnected(true);
  notify_.Ready();
  WriteReadyFile();
  scenes_.Connected(session_->link(), *identity_);
  for (const v1::WorkerExited& exited : supervisor_.Exits()) TellExited(exited);
  Settle();
}

absl::Status Agent::KeepIdentity(const v1::Admitted& admitted) {
  HostIdentity identity;
  if (identity_) identity = *identity_;
  identity.set_host_id(admitted.host_id());
  identity.set_host_name(admitted.host_name());
  if (!admitted.host_secret().empty()) identity.set_host_secret(admitted.host_secret());
  if (identity.host_id().empty() || identity.host_secret().empty()) {
    return absl::InvalidArgumentError("admitted: host_id or host_secret is empty");
  }
  const bool same = identity_ && identity_->SerializeAsString() == identity.SerializeAsString();
  identity_ = std::move(identity);
  return same ? absl::OkStatus() : state_->SaveIdentity(*identity_);
}

void Agent::OnDesired(const v1::DesiredSet& set) {
  const std::vector<OrderOutcome> outcomes = supervisor_.Desired(set, Clock::now());
  Settle();
  spdlog::info("desired set from=control revision={} workers={}", set.revision(), set.workers_size());
  for (const OrderOutcome& outcome : outcomes) {
    spdlog::log(outcome.changed ? spdlog::level::info : spdlog::level::debug,
                "order from=control worker={} revision={} outcome={}", LogValue(outcome.key.ToString()),
                outcome.revision, LogValue(outcome.what));
  }
}

void Agent::OnRefused(const absl::Status& status) {
  spdlog::error("control plane {} refused this host: {}{}", options_.control, std::string(status.message()),
                identity_ ? absl::StrCat(" (identity from ", state_->IdentityPath(),
                                         "; to join anew, remove it and give a join token)")
                          : "");
  exit_code_ = 1;
  if (options_.stop_workers && !supervisor_.Empty()) return EndWorkers();
  Finish(1);
}

void Agent::TellExited(const v1::WorkerExited& exited) {
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
  absl::Status status = json.ok() ? WriteFile(options_.ready_file, *json + "\n", false) : json.status();
  if (!status.ok()) spdlog::error("--ready-file {}", std::string(status.message()));
}

// --- Workers
// -----------------------------------------------------------------------------------------------------------

void Agent::OnWorkerReport(ConnectionId connection, const v1::WorkerReport& report) {
  if (const auto known = attached_.find(connection); known != attached_.end()) {
    supervisor_.Reported(known->second, report);
    return Settle();
  }
  const absl::StatusOr<WorkerKey> key = supervisor_.Attached(report);
  if (!key.ok()) {
    spdlog::warn("worker refused reason={}", LogValue(std::string(key.status().message())));
    return socket_->Close(connection, key.status());
  }
  if (const auto old = connections_.find(*key); old != connections_.end()) {
    attached_.erase(old->second);
    socket_->Close(old->second, absl::AbortedError("attached anew"));
  }
  connections_[*key] = connection;
  attached_[connection] = *key;
  spdlog::info("worker attached worker={} pid={}", LogValue(key->ToString()), report.identity().pid());
  Settle();
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

void Agent::Watch(const WorkerKey& key, Process process, const std::string& log_path) {
  const int pidfd = process.pidfd();
  processes_.insert_or_assign(key, Running{std::move(process), log_path});
  loop_->Watch(pidfd, [this, key] { OnProcessEnd(key); });
}

void Agent::OnProcessEnd(const WorkerKey& key) {
  const auto found = processes_.find(key);
  const ExitStatus status = found->second.process.Reap();
  std::vector<std::string> lines = LastLines(found->second.log_path, kLastLines);
  loop_->Unwatch(found->second.process.pidfd());
  processes_.erase(found);
  // What it said over its connection, such as why it failed, was posted before; a connection that is left is history.
  if (const auto connection = connections_.find(key); connection != connections_.end()) {
    attached_.erase(connection->second);
    connections_.erase(connection);
  }
  supervisor_.Ended(key, status, std::move(lines));
  Settle();
  std::set<std::string> in_use;
  for (const auto& [other, running] : processes_) in_use.insert(running.log_path);
  state_->PruneLogs(in_use);
}

std::vector<std::string> Agent::WorkerArguments(const SpawnWorker& action) const {
  const auto port = [&](int offset) { return std::to_string(action.first_port + offset); };
  v1::WorkerIdentity identity;
  identity.set_instance_id(action.key.instance_id);
  identity.set_region(action.key.region);
  identity.set_incarnation(action.key.incarnation);
  // Seen by everybody on this machine, so nothing secret: keys come with the order, over the socket.
  return {options_.region_binary,
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
          "--metrics-port",
          port(2),
          "--log-file",
          state_->LogPath(identity)};
}

// --- What the supervisor wants
// -----------------------------------------------------------------------------------------

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
  std::vector<std::string> argv = WorkerArguments(action);
  const std::string log_path = argv.back();
  absl::StatusOr<Process> process =
      Process::Spawn({.argv = std::move(argv),
                      .log_path = log_path,
                      .die_with_parent = options_.stop_workers,
                      .without_environment = {kServiceVariables.begin(), kServiceVariables.end()}});
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
  spdlog::info("order sent worker={} revision={} run={} stop={} peers={} players={}", LogValue(action.key.ToString()),
               action.order.revision(), action.order.run(), action.order.stop(), action.order.peers_size(),
               action.order.players_size());
  socket_->Send(found->second, action.order);
}

void Agent::Do(const FetchScene& action) { scenes_.Want(action.hash); }

void Agent::Do(const TellReport& action) {
  v1::AgentMessage message;
  *message.mutable_report() = action.report;
  if (session_) session_->Send(std::move(message));
}

void Agent::Do(const TellExit& action) {
  const v1::WorkerExited& exited = action.exited;
  const auto level = action.result == ExitResult::kClean ? spdlog::level::info : spdlog::level::err;
  spdlog::log(level, "worker ended worker={} pid={} started={} reason={} last_line={}",
              LogValue(KeyOf(exited.identity()).ToString()), exited.identity().pid(), exited.started(),
              LogValue(exited.reason()),
              LogValue(exited.last_log_lines().empty() ? "" : *exited.last_log_lines().rbegin()));
  if (exited.identity().pid() != 0) metrics_.Exited(action.result);
  if (session_) TellExited(exited);
}

void Agent::Save() {
  if (!supervisor_.TakeDirty() && !finishing_) return;
  if (absl::Status status = state_->SaveWorkers(supervisor_.State(boot_id_)); !status.ok()) {
    spdlog::error("cannot save: {}", std::string(status.message()));
  }
}

// --- The end
// -----------------------------------------------------------------------------------------------------------

void Agent::OnSignal() {
  signalfd_siginfo info{};
  while (read(signals_, &info, sizeof info) == sizeof info) {
    spdlog::info("signal received name={} from_pid={} workers={}", sigabbrev_np(static_cast<int>(info.ssi_signo)),
                 info.ssi_pid, supervisor_.size());
    notify_.Stopping();
    if (options_.stop_workers) {
      EndWorkers();
    } else {
      Finish(exit_code_);
    }
  }
}

// Again while they end: kills them.
void Agent::EndWorkers() {
  ending_workers_ = true;
  supervisor_.StopAll(Clock::now());
  Settle();
}

void Agent::Finish(int exit_code) {
  exit_code_ = exit_code;
  if (std::exchange(finishing_, true)) return;
  Save();  // with the last report of each worker
  const auto end = [this] {
    spdlog::info("agent ends workers_left_running={}", processes_.size());
    loop_->Stop();
  };
  // Posted: this may be a callback of the session, which goes on after it.
  loop_->Post([this, end] { session_->Close(end); });
}

}  // namespace tessera::agent
