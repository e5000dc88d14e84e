#include "agent/agent.h"

#include <spdlog/spdlog.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "agent/found_workers.h"
#include "host/end_signals.h"
#include "host/files.h"
#include "host/landlock.h"
#include "host/last_lines.h"
#include "host/socket_address.h"
#include "telemetry/logging.h"
#include "telemetry/metrics_token.h"
#include "trust/certificate.h"
#include "trust/control_address.h"

namespace tessera::agent {

namespace {

using telemetry::LogValue;

}  // namespace

// --- From the start to the first event

absl::StatusOr<std::unique_ptr<Agent>> Agent::Create(const AgentOptions& options) {
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

Agent::Agent(const AgentOptions& options, std::unique_ptr<StateDir> state)
    : options_(options),
      loop_(std::make_shared<EventLoop>()),
      state_(std::move(state)),
      boot_id_(host::BootId()),
      programs_({.own_release = TESSERA_VERSION,
                 .own_program = options_.region_binary,
                 .own_program_given = options_.region_binary_given,
                 .folder = options_.release_programs}),
      revocations_(*state_),
      notify_(loop_),
      supervisor_(
          options_.ports,
          [this](std::uint16_t first) { return host::PortsFree(options_.bind_address, options_.metrics_host, first); }),
      contents_(loop_, *state_,
                {.on_ready =
                     [this](const Content& content, const std::string& path) {
                       supervisor_.ContentReady(content, path);
                       Settle();
                     },
                 .on_failed =
                     [this](const Content& content, const std::string& reason) {
                       supervisor_.ContentFailed(content, reason);
                       Settle();
                     }}),
      states_(loop_, {.on_ready =
                          [this](const WorkerKey& key, const std::string& path) {
                            supervisor_.StateReady(key, path);
                            Settle();
                          },
                      .on_failed =
                          [this](const WorkerKey& key, const std::string& reason) {
                            supervisor_.StateFailed(key, reason);
                            Settle();
                          }}) {}

Agent::~Agent() {
  module_watch_.reset();
  session_.reset();
  socket_.reset();
  if (signals_ >= 0) close(signals_);
}

absl::Status Agent::Prepare() {
  auto identity = state_->LoadIdentity();
  if (!identity.ok()) return identity.status();
  identity_ = *std::move(identity);
  BeginRevocations();
  if (absl::Status status = identity_ ? absl::OkStatus() : FindJoinToken(); !status.ok()) return status;
  if (!options_.ready_file.empty()) {
    std::error_code ignored;
    std::filesystem::remove(options_.ready_file, ignored);  // an earlier agent's must not be believed
  }
  auto token = telemetry::ReadMetricsToken(options_.metrics_token_file);
  if (!token.ok()) return token.status();
  const auto tls = telemetry::ReadMetricsTls(options_.metrics_tls);
  if (!tls.ok()) return tls.status();
  auto server = telemetry::MetricsServer::Start(options_.metrics_host, options_.metrics_port, metrics_.registry(),
                                                *std::move(token), *tls);
  if (!server.ok()) return server.status();
  metrics_server_ = *std::move(server);
  disk_metrics_ = std::make_shared<telemetry::DiskMetrics>(options_.state_dir);
  metrics_server_->AddCollectable(disk_metrics_);
  if (absl::Status status = host::MakePrivateFolder(state_->StatesPath()); !status.ok()) return status;
  supervisor_.SetStateFolder(state_->StatesPath());
  WatchModules();
  if (const auto landlock = host::LandlockVersion(); options_.worker_sandbox && !landlock.ok()) {
    spdlog::warn("workers keep the files of this user missing={}", LogValue(std::string(landlock.status().message())));
  }
  OpenCgroups();
  if (absl::Status status = Restore(); !status.ok()) return status;

  WorkerSocket::Callbacks callbacks;
  callbacks.on_message = [this, loop = loop_](ConnectionId connection, pid_t peer, v1::WorkerMessage message) {
    loop->Post([this, connection, peer, message = std::move(message)] { OnWorkerMessage(connection, peer, message); });
  };
  callbacks.on_closed = [this, loop = loop_](ConnectionId connection) {
    loop->Post([this, connection] { OnWorkerClosed(connection); });
  };
  callbacks.on_flood = [this, loop = loop_](pid_t peer) { loop->Post([this, peer] { OnWorkerFlood(peer); }); };
  auto socket = WorkerSocket::Serve(state_->SocketPath(), std::move(callbacks));
  if (!socket.ok()) return socket.status();
  socket_ = *std::move(socket);
  WatchSignals();
  return absl::OkStatus();
}

void Agent::WatchModules() {
  if (options_.game_modules.empty()) return;
  supervisor_.SetModuleFolder(options_.game_modules);
  module_watch_ = std::make_unique<ModuleWatch>(
      GameModulesOptions{.folder = options_.game_modules,
                         .region_binary = options_.region_binary,
                         .scratch = absl::StrCat(state_->StatesPath(), "/game-module.txt")},
      [this, loop = loop_](v1::GameModuleList list) {
        loop->Post([this, list = std::move(list)] { OnModules(list); });
      });
  game_modules_ = module_watch_->first();
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
  auto control = trust::ParseControlAddresses(options_.control, host::PortRule::kFrom1);
  // "tsj_...": where the control plane has an authority, its fingerprint comes after it, and says whom to give it to.
  const std::size_t mark = std::min(options_.join_token.find('.'), options_.join_token.size());
  const std::string fingerprint = options_.join_token.substr(std::min(mark + 1, options_.join_token.size()));
  options_.join_token.resize(mark);
  if (!control.ok() || control->front().is_socket()) return control.status();
  if (!fingerprint.empty()) {
    std::vector<std::string> addresses;
    for (trust::ControlAddress& address : *control) {
      if (address.fingerprint.empty()) address.fingerprint = fingerprint;
      addresses.push_back(address.text());
    }
    options_.control = absl::StrJoin(addresses, ",");
  }
  auto key = trust::MakeKey();
  if (!key.ok()) return key.status();
  requested_key_ = *std::move(key);
  return absl::OkStatus();
}

trust::Credentials Agent::ControlCredentials() const {
  // The token goes into the headers, too: without a proof there nobody's hello is read.
  if (!identity_) return {.authority = {}, .certificate = {}, .key = {}, .bearer_token = options_.join_token};
  return {.authority = identity_->authority(),
          .certificate = identity_->certificate(),
          .key = identity_->key(),
          .bearer_token = {}};
}

absl::Status Agent::Restore() {
  auto loaded = state_->LoadWorkers();
  if (!loaded.ok()) {
    spdlog::error("workers are looked for by their processes reason={} kept_as={}",
                  LogValue(std::string(loaded.status().message())), LogValue(state_->SetWorkersAside()));
  }
  TellWorkersAside();
  const WorkersFile file = loaded.ok() ? *std::move(loaded) : WorkersFile();
  for (const v1::WorkerExited& exited : file.exits()) supervisor_.AdoptExit(exited);
  for (const WorkerRecord& record : file.workers()) RestoreWorker(record, file.boot_id() == boot_id_);
  RestoreUnnamed(file);
  Settle();
  return absl::OkStatus();
}

// Workers that live and are not in the file, which may be damaged, gone, or of a moment before they began. Those that
// are not wanted any more end in order, by the control plane's word.
void Agent::RestoreUnnamed(const WorkersFile& file) {
  std::set<WorkerKey> ended;
  for (const v1::WorkerExited& exited : file.exits()) ended.insert(KeyOf(exited.identity()));
  for (WorkerRecord& record : FindWorkers(state_->SocketPath())) {
    record.set_log_path(state_->LogPath(record.identity()));
    const WorkerKey key = KeyOf(record.identity());
    if (processes_.contains(key) || ended.contains(key)) continue;
    auto process = host::Process::Adopt(static_cast<pid_t>(record.identity().pid()), record.start_time());
    if (!process.ok()) continue;  // it has just ended
    spdlog::warn("worker found by its process worker={} pid={}", LogValue(key.ToString()), process->pid());
    found_.insert(key);
    AdoptProcess(record, *std::move(process));
  }
}

void Agent::RestoreWorker(const WorkerRecord& record, bool same_boot) {
  const WorkerKey key = KeyOf(record.identity());
  absl::StatusOr<host::Process> process = absl::NotFoundError("the host was started anew");
  if (same_boot) process = host::Process::Adopt(static_cast<pid_t>(record.identity().pid()), record.start_time());
  if (!process.ok()) {
    const std::string reason = same_boot ? "ended while no agent ran; its exit status is unknown"
                                         : "ended with the host, which was started anew";
    state_->ForgetOrder(record.identity());
    supervisor_.AdoptGone(record, reason, host::LastLines(record.log_path(), kLastLines));
    return;
  }
  AdoptProcess(record, *std::move(process));
}

void Agent::AdoptProcess(const WorkerRecord& record, host::Process process) {
  const WorkerKey key = KeyOf(record.identity());
  // A worker that an earlier version started has none yet.
  if (absl::Status status = host::MakePrivateFolder(StateFolderOf(state_->StatesPath(), key)); !status.ok()) {
    spdlog::error("worker adopted without a folder for its states reason={}", LogValue(std::string(status.message())));
  }
  spdlog::info("worker adopted worker={} pid={}", LogValue(key.ToString()), process.pid());
  MakeCgroup(key);  // an agent that starts anew takes the limits of all groups away for a moment
  auto order = state_->LoadOrder(record.identity());
  if (!order.ok()) {
    spdlog::error("worker adopted without its last order worker={} reason={}", LogValue(key.ToString()),
                  LogValue(std::string(order.status().message())));
  }
  supervisor_.Adopt(record, order.ok() ? *std::move(order) : std::nullopt);
  Watch(key, std::move(process), record.log_path());
}

void Agent::WatchSignals() {
  const sigset_t set = host::SetOfSignals({SIGTERM, SIGINT, SIGHUP});  // main.cpp blocks them
  signals_ = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  loop_->Watch(signals_, [this] { OnSignal(); });
}

int Agent::Run() {
  ControlSession::Callbacks callbacks;
  callbacks.hello = [this] {
    AskWhereCertificateIsDue();
    return Hello();
  };
  callbacks.credentials = [this] { return ControlCredentials(); };
  callbacks.heartbeat = [this] { return Heartbeat(); };
  callbacks.on_admitted = [this](const v1::Admitted& admitted) { OnAdmitted(admitted); };
  callbacks.on_desired = [this](const v1::DesiredSet& set) { OnDesired(set); };
  callbacks.on_lease = [this](const v1::LeaseRenewal& renewal) { OnLease(renewal); };
  callbacks.on_life = [this](std::uint64_t life) { KeepLife(life); };
  callbacks.on_refused = [this](const absl::Status& status) { OnRefused(status); };
  callbacks.on_away = [this] { OnAway(); };
  session_ = std::make_unique<ControlSession>(loop_, options_.control, identity_ ? identity_->newest_life() : 0,
                                              std::move(callbacks));
  spdlog::info("agent started version={} control={} socket={} metrics={} workers={}", TESSERA_VERSION,
               LogValue(options_.control), LogValue(state_->SocketPath()), metrics_server_->address(),
               supervisor_.size());
  if (identity_) notify_.Ready();  // admitted in an earlier life: the workers are cared for from here on
  if (found_.empty()) {
    StartSession();
  } else {
    loop_->RunAt(Clock::now() + kFoundPatience, [this] { StartSession(); });
  }
  LookAfterCertificate();
  LookAfterContents();
  Settle();
  loop_->Run();
  return exit_code_;
}

void Agent::LookAfterContents() {
  loop_->RunAt(Clock::now() + kContentLook, [this] { LookAfterContents(); });
  contents_.RemoveUnnamed(supervisor_.NamedContents(), Clock::now());
}

void Agent::StartSession() {
  if (std::exchange(session_started_, true) || finishing_) return;
  for (const WorkerKey& key : found_) spdlog::warn("worker found but not attached worker={}", LogValue(key.ToString()));
  session_->Start();
}

void Agent::NoteFoundAttached(const WorkerKey& key) {
  if (found_.erase(key) > 0 && found_.empty()) StartSession();
}

// --- The end

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
