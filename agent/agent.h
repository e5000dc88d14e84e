// Agent: the parts put together, and the life of the program. Decisions are the Supervisor's; here its actions are
// carried out, and what happens in the world (processes, workers, the control plane, signals) is passed to it.
//
//   auto agent = Agent::Create(options);
//   if (!agent.ok()) ...
//   return (*agent)->Run();
//
// It has some 70 methods: one for each thing that happens, and one for each action of the supervisor. None decides.
//
// Thread rule: the main thread, with SIGTERM, SIGINT and SIGHUP blocked in all threads: the agent reads them from a
// descriptor, and workers that die with it are bound to the thread that started them.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "agent/agent_metrics.h"
#include "agent/content_cache.h"
#include "agent/control_session.h"
#include "agent/event_loop.h"
#include "agent/kept_revocations.h"
#include "agent/module_watch.h"
#include "agent/options.h"
#include "agent/release_programs.h"
#include "agent/service_notify.h"
#include "agent/state_dir.h"
#include "agent/state_files.h"
#include "agent/supervisor.h"
#include "agent/worker_socket.h"
#include "host/cgroup.h"
#include "host/process.h"
#include "telemetry/disk_metrics.h"
#include "telemetry/log_throttle.h"
#include "telemetry/metrics_server.h"

namespace tessera::agent {

// By this host's wall clock.
double UnixSeconds();

class Agent {
 public:
  // Takes the state folder, serves workers and metrics, adopts what runs. INVALID_ARGUMENT if neither an identity nor a
  // join token is there, or the state folder's path is too long.
  static absl::StatusOr<std::unique_ptr<Agent>> Create(const AgentOptions& options);
  ~Agent();

  // Until a signal (0) or a refusal by the control plane (1).
  int Run();

 private:
  struct RunningProcess {
    host::Process process;
    std::string log_path;
  };

  Agent(const AgentOptions& options, std::unique_ptr<StateDir> state);
  absl::Status Prepare();
  void WatchModules();
  absl::Status FindJoinToken();
  trust::Credentials ControlCredentials() const;
  absl::Status Restore();
  void RestoreWorker(const WorkerRecord& record, bool same_boot);
  void RestoreUnnamed(const WorkersFile& file);
  void AdoptProcess(const WorkerRecord& record, host::Process process);
  void StartSession();  // once
  void NoteFoundAttached(const WorkerKey& key);
  void WatchSignals();

  bool CertificateIsDue() const;
  void AskWhereCertificateIsDue();  // with the next hello
  void LookAfterCertificate();      // now, and from then on by a timer
  void LookAfterContents();         // likewise
  void NoteRenewal(const v1::Admitted& admitted, const absl::Status& kept);
  void TellCertificate();

  v1::AgentHello Hello() const;
  v1::AgentHeartbeat Heartbeat();
  void OnAdmitted(const v1::Admitted& admitted);
  absl::Status KeepIdentity(const v1::Admitted& admitted);
  void KeepLife(std::uint64_t life);
  void BeginRevocations();
  void TakeRevocations(const v1::SignedRevocations& list);
  void KeepRevocations();
  void OnDesired(const v1::DesiredSet& set);
  void OnRefused(const absl::Status& status);
  void OnAway();
  void OnModules(const v1::GameModuleList& list);
  void OnLease(const v1::LeaseRenewal& renewal);
  void OnWorkerMessage(ConnectionId connection, pid_t peer, const v1::WorkerMessage& message);
  void OnWorkerReport(ConnectionId connection, pid_t peer, const v1::WorkerReport& report);
  void NoteRefused(const v1::WorkerIdentity& says, const absl::Status& why);
  void PassOn(const WorkerKey& key, const v1::WorkerMessage& message);
  void OnWorkerClosed(ConnectionId connection);
  void OnWorkerFlood(pid_t peer);
  void OnProcessEnd(const WorkerKey& key);
  void OnSignal();

  // Carries out what the supervisor has decided, saves, and sets the next deadline. After each event.
  void Settle();
  void Do(const SpawnWorker& action);
  void Do(const SignalWorker& action);
  void Do(const SendOrder& action);
  void Do(const KeepOrder& action);
  void Do(const FetchContent& action);
  void Do(const FetchState& action);
  void Do(const UploadState& action);
  void Do(const ForwardReport& action);
  void Do(const ReportExit& action);
  void Save();
  void SaveWorkers();
  void SaveIdentity();
  void SaveOrder(const WorkerKey& key, const v1::WorkerOrder& order);
  void NoteSaved(StateFile file, const absl::Status& saved);
  void SaveAgain();
  void SaveOrdersAgain();
  void TellWorkersAside();
  void Watch(const WorkerKey& key, host::Process process, const std::string& log_path);
  std::vector<std::string> WorkerArguments(const SpawnWorker& action) const;
  std::vector<std::string> SandboxArguments(const WorkerKey& key) const;
  void OpenCgroups();
  std::string MakeCgroup(const WorkerKey& key);
  void SendExited(const v1::WorkerExited& exited);
  void WriteReadyFile();
  void EndWorkers();
  void Finish(int exit_code);

  AgentOptions options_;
  std::shared_ptr<EventLoop> loop_;
  std::unique_ptr<StateDir> state_;
  std::string boot_id_;
  ReleasePrograms programs_;
  std::optional<HostIdentity> identity_;
  std::string requested_key_;  // PEM, secret: for the certificate that the next hello requests; empty: none
  TimePoint next_renewal_;     // none is requested before, unless with a join token
  KeptRevocations revocations_;
  std::optional<v1::SignedRevocations> unkept_revocations_;  // the disk did not take it yet
  std::string revocations_trouble_;                          // why the last one is not kept; logged once
  std::set<StateFile> unsaved_;                              // that the disk did not take; a timer tries them again
  std::map<WorkerKey, v1::WorkerOrder> unkept_orders_;       // likewise
  bool saves_again_ = false;                                 // the timer runs
  bool workers_aside_ = false;                               // a file that could not be read lies there
  AgentMetrics metrics_;
  ServiceNotify notify_;
  Supervisor supervisor_;
  ContentCache contents_;
  StateFiles states_;
  std::map<WorkerKey, RunningProcess> processes_;
  std::set<WorkerKey> found_;  // adopted by their processes alone, and not attached yet
  telemetry::LogThrottle floods_, impostors_, unknown_workers_;
  std::optional<host::DelegatedCgroup> cgroups_;  // nothing: workers have none of their own
  std::map<WorkerKey, ConnectionId> connections_;
  std::map<ConnectionId, WorkerKey> attached_;
  std::map<WorkerKey, v1::InventoryReport> inventories_;  // answers in failovers not known to be resolved
  std::shared_ptr<telemetry::DiskMetrics> disk_metrics_;
  std::unique_ptr<telemetry::MetricsServer> metrics_server_;
  std::unique_ptr<WorkerSocket> socket_;
  std::unique_ptr<ControlSession> session_;
  v1::GameModuleList game_modules_;            // that this host has
  std::unique_ptr<ModuleWatch> module_watch_;  // null: it has no folder of them
  std::optional<EventLoop::TimerId> deadline_;
  int signals_ = -1;
  bool ending_workers_ = false, finishing_ = false, ready_written_ = false, session_started_ = false;
  int exit_code_ = 0;
};

}  // namespace tessera::agent
