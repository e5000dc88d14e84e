// Supervisor: what an agent decides. Which workers to start, what to order, when to end them, what to report.
//
// Pure: no process, socket, clock or file. Events come in with the time, what is to be done goes out as actions, which
// the caller carries out and answers in order before it passes the next event:
//
//   supervisor.Desired(set, now);
//   for (const Action& action : supervisor.TakeActions()) Do(action);   // SpawnWorker -> Spawned or SpawnFailed
//   if (supervisor.TakeDirty(now)) Save(supervisor.State(boot_id));     // workers.json
//
// Promises. A worker that is wanted and was never started here is started once; after its end the same incarnation is
// never started again, but its exit is kept, and sent to each control plane that the agent attaches to, until the
// desired set no longer holds it. Only a bind failure before its ports are known (exit code 98) is tried again, with
// other ports. Nothing is ended because a control plane or an agent is away. Thread rule: one owner.
//
// It has 46 methods: one for each event, and one for each step of a worker's life that several events lead to.
#pragma once

#include <sys/types.h>

#include <compare>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "agent/agent_state.pb.h"
#include "agent/content.h"
#include "agent/kept_revocations.h"
#include "agent/limits.h"
#include "agent/ports.h"
#include "host/process.h"

namespace tessera::agent {

struct WorkerKey {
  std::string instance_id;
  std::uint32_t region = 0;
  std::uint64_t incarnation = 0;

  friend auto operator<=>(const WorkerKey&, const WorkerKey&) = default;
  std::string ToString() const;  // "inst-7/2#31": instance, region, incarnation
};
WorkerKey KeyOf(const v1::WorkerIdentity& identity);
v1::WorkerIdentity IdentityOf(const WorkerKey& key);
// True if it can be part of a file's name: 1 to 64 letters, digits, '-', '_' or '.', the first of them no '-' or '.'.
bool IsInstanceId(const std::string& id);
// Where one worker's states are, and no other's: others cannot read it (region_worker/sandbox.h).
std::string StateFolderOf(const std::string& folder, const WorkerKey& key);
// Whether process `peer` speaks for the worker that it says it is, whose pid is `pid`; 0: there is no such worker.
absl::Status CheckSpeaker(const v1::WorkerIdentity& says, pid_t peer, std::int64_t pid);

// --- Actions ---------------------------------------------------------------------------------------------------------

struct SpawnWorker {  // answered by Spawned or SpawnFailed
  WorkerKey key;
  std::uint16_t first_port = 0;
  std::uint32_t max_players = 0;  // as its order says; 0: it does not
  std::string release = {};       // likewise; empty: the agent's own
};
struct SignalWorker {
  WorkerKey key;
  int signal = 0;
};
struct SendOrder {
  WorkerKey key;
  v1::WorkerOrder order;
  bool notable = true;  // as OrderOutcome::changed
};
struct KeepOrder {  // as the control plane gave it, for the agent after this one (Adopt)
  WorkerKey key;
  v1::WorkerOrder order;
};
struct FetchContent {  // answered, some time, by ContentReady or ContentFailed
  Content content;
};
// Answered, some time, by StateReady or StateFailed.
struct FetchState {
  WorkerKey key;
  std::uint64_t tick = 0;
  std::string hash, path;
};
struct UploadState {
  WorkerKey key;
  std::uint64_t tick = 0;
  std::string path;
};
struct ForwardReport {
  v1::WorkerReport report;
};
enum class ExitResult { kClean, kError, kSignal };
struct ReportExit {
  v1::WorkerExited exited;
  ExitResult result = ExitResult::kError;
};
using Action = std::variant<SpawnWorker, SignalWorker, SendOrder, KeepOrder, FetchContent, FetchState, UploadState,
                            ForwardReport, ReportExit>;

// The outcome of one order, for the log.
struct OrderOutcome {
  WorkerKey key;
  std::uint64_t revision = 0;
  std::string what;
  // False: nothing new in it that an operator cares about. Each worker that starts is in the orders of all others, so
  // lines of the log for that would grow with the square of a world's regions.
  bool changed = true;
  std::string operation{};  // to which the order belongs, as the control plane names it
};

class Supervisor {
 public:
  // `ports_free(first)`: whether a worker can bind the three ports from `first` on, as far as one can know beforehand.
  Supervisor(PortRange ports, std::function<bool(std::uint16_t)> ports_free);

  // Where workers' states are written and read.
  void SetStateFolder(std::string folder) { state_folder_ = std::move(folder); }

  // Where this host's native games are; empty: it has none.
  void SetModuleFolder(std::string folder) { module_folder_ = std::move(folder); }

  // From the last life of this agent, before anything else. A record of a process that lives, with its last order where
  // that was kept; one of a process that is gone, with the reason to report; an exit that may not have been heard.
  void Adopt(const WorkerRecord& record, std::optional<v1::WorkerOrder> order = std::nullopt);
  void AdoptGone(const WorkerRecord& record, const std::string& reason, std::vector<std::string> last_lines);
  void AdoptExit(const v1::WorkerExited& exited);

  // Goes with each order, and to workers that have one already.
  void SetRevoked(RevokedLives lives);

  // From the control plane.
  std::vector<OrderOutcome> Desired(const v1::DesiredSet& set, TimePoint now);
  void ContentReady(const Content& content, const std::string& path);
  void ContentFailed(const Content& content, const std::string& reason);
  // All that orders name, those to the agent before this one too. What they name no more is asked for again before it
  // is used again, so its file may be removed.
  std::set<Content> NamedContents();
  void StateReady(const WorkerKey& key, const std::string& path);
  void StateFailed(const WorkerKey& key, const std::string& reason);

  // The caller reports what became of processes.
  void Spawned(const WorkerKey& key, pid_t pid, std::uint64_t start_time, const std::string& log_path, TimePoint now);
  void SpawnFailed(const WorkerKey& key, const std::string& reason);
  void Ended(const WorkerKey& key, const host::ExitStatus& status, std::vector<std::string> last_lines);

  // From workers. NOT_FOUND for one that this agent neither started nor adopted, or that another process, `peer`,
  // speaks for: the kernel knows who dialled.
  absl::StatusOr<WorkerKey> Attached(const v1::WorkerReport& first, pid_t peer);
  void Reported(const WorkerKey& key, const v1::WorkerReport& report);
  void Detached(const WorkerKey& key);

  // Deadlines: call at NextDeadline.
  void Tick(TimePoint now);
  std::optional<TimePoint> NextDeadline() const;

  // Ends all workers and starts no more. The second call kills.
  void StopAll(TimePoint now);

  bool Empty() const { return workers_.empty(); }
  std::size_t size() const { return workers_.size(); }
  std::uint64_t desired_revision() const { return desired_revision_; }
  std::vector<v1::WorkerReport> Reports() const;
  // The orders that the control plane gave this host, to an agent before this one too where they were kept.
  v1::HeldOrders HeldOrders() const;
  std::vector<v1::WorkerExited> Exits() const;
  WorkersFile State(const std::string& boot_id) const;

  std::vector<Action> TakeActions() { return std::exchange(actions_, {}); }
  // An order named players by what changed since one that is not here: a new stream begins with a whole one.
  bool TakeNeedsWhole() { return std::exchange(needs_whole_, false); }
  // True: State is to be saved, for it differs in what the next agent needs, or ticks in it are old.
  bool TakeDirty(TimePoint now);

 private:
  enum class Stopping { kNo, kOrdered, kTerminated, kKilled };
  struct Worker {
    WorkerRecord record;  // pid 0: not spawned yet
    v1::WorkerReport report;
    std::optional<v1::WorkerOrder> order;      // as the control plane gave it, with all its players
    std::optional<v1::WorkerOrder> old_order;  // to the agent before this one
    std::string sent;                          // the last order, serialised, without players
    std::string notable;                       // NotablePart of the last order that was sent
    bool takes_changes = false;                // its orders may name players by what changed
    std::optional<v1::WorkerOrder> unsent;  // players since the last order that was sent; none: it knows none of them
    std::optional<TimePoint> keep_at;       // the order is written to the disk again
    std::optional<TimePoint> deadline;      // to attach, or to end
    Stopping stopping = Stopping::kNo;
    bool attached = false, ever_attached = false;
    int port_attempts = 0;
    std::string state_path;           // holds the state to begin with; empty: not here yet
    bool state_wanted = false;        // has been asked for
    std::uint64_t uploaded_tick = 0;  // the last checkpoint that was passed on
    std::string why;                  // we ended it, if not in order
  };
  using Workers = std::map<WorkerKey, Worker>;
  struct KeptContent {
    std::string path;    // where it was last found; empty: not yet
    bool asked = false;  // is being looked for: by hand it may have been removed since
  };

  OrderOutcome Apply(const WorkerKey& key, const v1::WorkerOrder& order, TimePoint now);
  std::string Start(const WorkerKey& key, const v1::WorkerOrder& order);
  bool Spawn(const WorkerKey& key, Worker& worker);
  void WantContents(const v1::WorkerOrder& order);
  void Ask(const Content& content, KeptContent& kept);
  void ForgetUnnamed();
  std::string PathOf(const Content& content, const Worker& worker) const;
  bool SetPaths(const WorkerKey& key, Worker& worker, v1::WorkerOrder& order);
  std::string StatePath(const WorkerKey& key, const char* what, std::uint64_t tick) const;
  bool TakeOrder(const WorkerKey& key, Worker& worker, const v1::WorkerOrder& order, TimePoint now);
  static void ForgetSent(Worker& worker);
  void AddPlayers(Worker& worker, v1::WorkerOrder& order);
  void Keep(const WorkerKey& key, Worker& worker);
  void PushOrder(const WorkerKey& key, Worker& worker);
  void BeginStop(const WorkerKey& key, Worker& worker, TimePoint now);
  void Signal(const WorkerKey& key, const Worker& worker, int signal);
  void Kill(const WorkerKey& key, Worker& worker, const std::string& why);
  void Finish(Workers::iterator worker, v1::WorkerExited exited, ExitResult result);
  void KeepExit(const WorkerKey& key, v1::WorkerExited exited, ExitResult result);

  PortRange ports_;
  std::function<bool(std::uint16_t)> ports_free_;
  Workers workers_;
  std::map<WorkerKey, v1::WorkerExited> exits_;  // still in the desired set
  std::map<Content, KeptContent> contents_;
  std::map<std::string, std::string> next_failures_;  // why a game that is to be next did not come, by hash
  std::uint64_t desired_revision_ = 0;
  bool stopping_all_ = false, dirty_ = false, needs_whole_ = false;
  bool ticks_moved_ = false;  // since State was saved last
  TimePoint saved_at_;
  RevokedLives revoked_;
  std::string state_folder_, module_folder_;
  std::vector<Action> actions_;
};

// All of an order that an operator cares about, as bytes that differ where that does: what it belongs to, that the
// worker is to run or to stop, the map, a failover. Empty: there is no order.
std::string NotablePart(const std::optional<v1::WorkerOrder>& order);

// OK, or INVALID_ARGUMENT that names the field: an order's texts become file names and arguments.
absl::Status CheckOrder(const v1::WorkerOrder& order);

}  // namespace tessera::agent
