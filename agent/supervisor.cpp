#include "agent/supervisor.h"

#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <cassert>
#include <csignal>
#include <set>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/game/native_name.h"
#include "core/world/player_changes.h"

namespace tessera::agent {
namespace {

bool Uses(const std::optional<v1::WorkerOrder>& order, const Content& content) {
  return order && std::ranges::count(ContentsOf(*order), content) > 0;
}

// Without a game that is to be the next one a worker goes on.
bool NeedsNow(const v1::WorkerOrder& order, const Content& content) {
  return content.kind == ContentKind::kScene || content.hash == order.game_hash();
}

// A region that has begun is in the worker's memory.
bool HasBegun(const v1::WorkerReport& report) { return report.phase() >= v1::WORKER_PHASE_BOUND; }

v1::WorkerExited NeverStarted(const WorkerKey& key, const std::string& reason) {
  v1::WorkerExited exited;
  *exited.mutable_identity() = IdentityOf(key);
  exited.set_reason(reason);
  return exited;
}

// Only a difference that the next agent needs is worth a write to the disk.
bool DiffersInState(const v1::WorkerReport& a, const v1::WorkerReport& b) {
  const auto same = [](const auto& x, const auto& y) { return std::equal(x.begin(), x.end(), y.begin(), y.end()); };
  return a.phase() != b.phase() || a.order_revision() != b.order_revision() || a.map_version() != b.map_version() ||
         a.failure() != b.failure() || !same(a.linked_regions(), b.linked_regions()) ||
         !same(a.connected_players(), b.connected_players()) ||
         !google::protobuf::util::MessageDifferencer::Equals(a.address(), b.address());
}

// A process that dies in the code of a native game says so in a line, which nothing but a fault's own text follows.
void NoteDeathInGame(v1::WorkerExited& exited) {
  for (const std::string& line : exited.last_log_lines()) {
    if (const std::string_view where = game::DeathInModule(line); !where.empty()) {
      exited.set_died_in_game(std::string(where));
    }
  }
}

// The library of this host's that the order needs, for people; empty: none.
std::string LibraryOf(const v1::WorkerOrder& order) {
  if (order.game_native()) return game::NativeGameText(order.game_name(), order.game_hash());
  if (order.movement_name().empty()) return "";
  return game::NativeGameText(order.movement_name(), order.movement_hash());
}

std::string ReasonOf(const host::ExitStatus& status) {
  return status.Describe() + (status.known ? "" : ", since an earlier agent had started it");
}

}  // namespace

Supervisor::Supervisor(PortRange ports, std::function<bool(std::uint16_t)> ports_free)
    : ports_(std::move(ports)), ports_free_(std::move(ports_free)) {}

// --- The last life

void Supervisor::Adopt(const WorkerRecord& record, std::optional<v1::WorkerOrder> order) {
  const WorkerKey key = KeyOf(record.identity());
  Worker& worker = workers_[key];
  worker.record = record;
  worker.record.clear_report();
  worker.report = record.report();
  *worker.report.mutable_identity() = record.identity();
  worker.ever_attached = true;
  worker.old_order = std::move(order);
  ports_.Mark(static_cast<std::uint16_t>(record.first_port()));
  dirty_ = true;
}

void Supervisor::AdoptGone(const WorkerRecord& record, const std::string& reason, std::vector<std::string> last_lines) {
  v1::WorkerExited exited;
  *exited.mutable_identity() = record.identity();
  exited.set_started(true);
  exited.set_newest_tick(record.report().tick());
  exited.set_reason(reason);
  exited.mutable_last_log_lines()->Add(last_lines.begin(), last_lines.end());
  NoteDeathInGame(exited);
  KeepExit(KeyOf(record.identity()), std::move(exited), ExitResult::kError);
}

void Supervisor::AdoptExit(const v1::WorkerExited& exited) { exits_[KeyOf(exited.identity())] = exited; }

// --- From the control plane

void Supervisor::SetRevoked(RevokedLives lives) {
  revoked_ = std::move(lives);
  for (auto& [key, worker] : workers_) PushOrder(key, worker);
}

std::vector<OrderOutcome> Supervisor::Desired(const v1::DesiredSet& set, TimePoint now) {
  std::vector<OrderOutcome> outcomes;
  std::set<WorkerKey> wanted;
  for (const v1::WorkerOrder& order : set.workers()) {
    const WorkerKey key{order.instance_id(), order.region(), order.incarnation()};
    const bool twice = !wanted.insert(key).second;
    outcomes.push_back(twice ? OrderOutcome{key, order.revision(), "ignored: in the set twice"}
                             : Apply(key, order, now));
  }
  for (auto& [key, worker] : workers_) {
    if (wanted.contains(key) || worker.stopping != Stopping::kNo) continue;
    BeginStop(key, worker, now);
    outcomes.push_back({key, 0, "no longer wanted: stopping"});
  }
  if (std::erase_if(exits_, [&](const auto& exit) { return !wanted.contains(exit.first); }) > 0) dirty_ = true;
  desired_revision_ = set.revision();
  return outcomes;
}

OrderOutcome Supervisor::Apply(const WorkerKey& key, const v1::WorkerOrder& order, TimePoint now) {
  const auto outcome = [&](std::string what, bool changed = true) {
    return OrderOutcome{key, order.revision(), std::move(what), changed, order.operation()};
  };
  if (exits_.contains(key)) return outcome("has ended already", false);
  if (stopping_all_) return outcome("ignored: this agent is stopping", !workers_.contains(key));
  const auto found = workers_.find(key);
  if (found == workers_.end()) {
    if (order.players_since() != 0) {
      needs_whole_ = true;
      return outcome("ignored: it names changes alone, and there is no such worker");
    }
    if (absl::Status status = CheckOrder(order); !status.ok()) {
      std::string reason(status.message());
      KeepExit(key, NeverStarted(key, reason), ExitResult::kError);
      return outcome("refused: " + reason);
    }
    if (const std::string library = LibraryOf(order); !library.empty() && module_folder_.empty() && !order.stop()) {
      std::string reason = absl::StrCat("this host's agent has no --game-modules, and the world runs ", library);
      KeepExit(key, NeverStarted(key, reason), ExitResult::kError);
      return outcome("refused: " + reason);
    }
    if (!order.stop()) return outcome(Start(key, order));
    KeepExit(key, NeverStarted(key, "stopped before it was started"), ExitResult::kClean);
    return outcome("stopped before it was started");
  }
  Worker& worker = found->second;
  if (worker.stopping != Stopping::kNo) return outcome("is stopping already", false);
  if (worker.order ? !Continues(*worker.order, order) : order.players_since() != 0) {
    needs_whole_ = true;
    return outcome("ignored: its players are changes of an order that is not here");
  }
  const std::string before = NotablePart(worker.order);
  if (!TakeOrder(key, worker, order, now)) return outcome("unchanged", false);
  if (order.stop()) {
    BeginStop(key, worker, now);
    return outcome("stopping");
  }
  if (absl::Status status = CheckOrder(order); !status.ok())
    return outcome(absl::StrCat("ignored: ", status.message()));
  WantContents(order);
  PushOrder(key, worker);
  return outcome(worker.attached ? "passed on" : "kept until the worker attaches", before != NotablePart(worker.order));
}

std::string Supervisor::Start(const WorkerKey& key, const v1::WorkerOrder& order) {
  const auto [place, is_new] = workers_.try_emplace(key);
  assert(is_new);
  Worker& worker = place->second;
  worker.order = order;
  *worker.report.mutable_identity() = IdentityOf(key);
  *worker.record.mutable_identity() = IdentityOf(key);
  if (!Spawn(key, worker)) {
    const std::string reason = absl::StrCat("no three free ports in ", ports_.ToString());
    v1::WorkerExited exited = NeverStarted(key, reason);
    exited.set_exit_code(kExitPortInUse);
    Finish(place, std::move(exited), ExitResult::kError);
    return "refused: " + reason;
  }
  // Anew, though others have it: since they began the file may have been removed or damaged.
  for (const Content& content : ContentsOf(order)) Ask(content, contents_[content]);
  return absl::StrCat("starting on ports from ", worker.record.first_port());
}

bool Supervisor::Spawn(const WorkerKey& key, Worker& worker) {
  const std::optional<std::uint16_t> port = ports_.Take(ports_free_);
  if (worker.record.first_port() != 0) ports_.Return(static_cast<std::uint16_t>(worker.record.first_port()));
  worker.record.set_first_port(port.value_or(0));
  if (!port) return false;
  ++worker.port_attempts;
  actions_.push_back(SpawnWorker{key, *port, worker.order ? worker.order->max_players() : 0,
                                 worker.order ? worker.order->release() : ""});
  return true;
}

void Supervisor::WantContents(const v1::WorkerOrder& order) {
  for (const Content& content : ContentsOf(order)) {
    if (const auto [entry, is_new] = contents_.try_emplace(content); is_new) Ask(content, entry->second);
  }
}

void Supervisor::Ask(const Content& content, KeptContent& kept) {
  if (!std::exchange(kept.asked, true)) actions_.push_back(FetchContent{content});
}

void Supervisor::ForgetUnnamed() {
  std::erase_if(contents_, [this](const auto& entry) {
    return std::none_of(workers_.begin(), workers_.end(),
                        [&](const auto& other) { return Uses(other.second.order, entry.first); });
  });
}

std::set<Content> Supervisor::NamedContents() {
  ForgetUnnamed();
  std::set<Content> named;
  for (const auto& [key, worker] : workers_) {
    for (const auto* order : {&worker.order, &worker.old_order}) {
      if (!*order) continue;
      for (Content& content : ContentsOf(**order)) named.insert(std::move(content));
    }
  }
  return named;
}

void Supervisor::ContentReady(const Content& content, const std::string& path) {
  const auto wanted = contents_.find(content);
  if (wanted == contents_.end()) return;
  wanted->second = {path};
  next_failures_.erase(content.hash);
  for (auto& [key, worker] : workers_) PushOrder(key, worker);
}

void Supervisor::ContentFailed(const Content& content, const std::string& reason) {
  bool in_use = false;
  for (auto& [key, worker] : workers_) {
    if (!Uses(worker.order, content)) continue;
    if (!NeedsNow(*worker.order, content)) {
      next_failures_[content.hash] = reason;
      PushOrder(key, worker);
    } else if (HasBegun(worker.report)) {
      in_use = true;
    } else {
      Kill(key, worker, reason);
    }
  }
  if (in_use) {
    contents_[content].asked = false;
  } else {
    contents_.erase(content);
  }
}

void Supervisor::StateReady(const WorkerKey& key, const std::string& path) {
  const auto found = workers_.find(key);
  if (found == workers_.end()) return;
  found->second.state_path = path;
  PushOrder(key, found->second);
}

void Supervisor::StateFailed(const WorkerKey& key, const std::string& reason) {
  if (const auto found = workers_.find(key); found != workers_.end()) Kill(key, found->second, reason);
}

std::string Supervisor::StatePath(const WorkerKey& key, const char* what, std::uint64_t tick) const {
  return absl::StrCat(StateFolderOf(state_folder_, key), "/", tick, ".", what);
}

// Empty: not here yet. A worker that has begun has read it, whether or not it is being looked for once more.
std::string Supervisor::PathOf(const Content& content, const Worker& worker) const {
  const auto found = contents_.find(content);
  return found == contents_.end() || (found->second.asked && !HasBegun(worker.report)) ? "" : found->second.path;
}

// False: a file that it needs is not here yet. A worker that is past its beginning needs no state to begin with.
bool Supervisor::SetPaths(const WorkerKey& key, Worker& worker, v1::WorkerOrder& order) {
  const auto path_of = [&](ContentKind kind, const std::string& hash) { return PathOf({kind, hash}, worker); };
  order.set_scene_path(path_of(ContentKind::kScene, order.scene_hash()));
  if (order.game_native()) {
    order.set_game_path(absl::StrCat(module_folder_, "/", order.game_name(), ".so"));
  } else if (!order.game_hash().empty()) {
    order.set_game_path(path_of(ContentKind::kGame, order.game_hash()));
  }
  if (!order.movement_name().empty()) {
    order.set_movement_path(absl::StrCat(module_folder_, "/", order.movement_name(), ".so"));
  }
  if (order.has_next_game()) {
    v1::NextGame& next = *order.mutable_next_game();
    next.set_path(path_of(ContentKind::kGame, next.hash()));
    const auto failed = next_failures_.find(next.hash());
    if (next.path().empty() && failed != next_failures_.end()) next.set_failure(failed->second);
  }
  const bool has_contents = !order.scene_path().empty() && order.game_path().empty() == order.game_hash().empty();
  if (order.has_checkpoint()) {
    order.mutable_checkpoint()->set_path(StatePath(key, "checkpoint", order.checkpoint().tick()));
  }
  if (!order.has_initial_state() || HasBegun(worker.report)) return has_contents;
  const v1::InitialState& state = order.initial_state();
  if (!std::exchange(worker.state_wanted, true)) {
    actions_.push_back(FetchState{key, state.tick(), state.hash(), StatePath(key, "state", state.tick())});
  }
  order.mutable_initial_state()->set_path(worker.state_path);
  return has_contents && !worker.state_path.empty();
}

// --- Of processes

void Supervisor::Spawned(const WorkerKey& key, pid_t pid, std::uint64_t start_time, const std::string& log_path,
                         TimePoint now) {
  const auto found = workers_.find(key);
  assert(found != workers_.end());
  Worker& worker = found->second;
  worker.record.mutable_identity()->set_pid(pid);
  worker.record.set_start_time(start_time);
  worker.record.set_log_path(log_path);
  worker.report.mutable_identity()->set_pid(pid);
  worker.deadline = now + kAttachTimeout;
  dirty_ = true;
  Keep(key, worker);
}

void Supervisor::SpawnFailed(const WorkerKey& key, const std::string& reason) {
  const auto found = workers_.find(key);
  assert(found != workers_.end());
  Finish(found, NeverStarted(key, reason), ExitResult::kError);
}

void Supervisor::Ended(const WorkerKey& key, const host::ExitStatus& status, std::vector<std::string> last_lines) {
  const auto found = workers_.find(key);
  if (found == workers_.end()) return;
  Worker& worker = found->second;
  std::string reason = worker.why.empty() ? ReasonOf(status) : worker.why;
  const bool port_in_use = status.known && status.signal == 0 && status.code == kExitPortInUse &&
                           worker.report.phase() < v1::WORKER_PHASE_BOUND && worker.stopping == Stopping::kNo;
  if (port_in_use) {
    worker.deadline.reset();
    worker.attached = worker.ever_attached = false;
    ForgetSent(worker);
    worker.record.mutable_identity()->set_pid(0);
    worker.report.Clear();
    *worker.report.mutable_identity() = IdentityOf(key);
    if (worker.port_attempts < kPortAttempts && Spawn(key, worker)) return;
    reason = absl::StrCat("port in use: no three free ports in ", ports_.ToString(), " after ", worker.port_attempts,
                          worker.port_attempts == 1 ? " attempt" : " attempts");
  }
  if (!worker.report.failure().empty()) absl::StrAppend(&reason, ": ", worker.report.failure());

  v1::WorkerExited exited;
  *exited.mutable_identity() = worker.record.identity();
  exited.set_started(worker.ever_attached);
  exited.set_newest_tick(worker.report.tick());
  exited.set_exit_code(status.code);
  exited.set_signal(status.signal);
  exited.mutable_last_log_lines()->Add(last_lines.begin(), last_lines.end());
  exited.set_reason(std::move(reason));
  if (!status.known || status.signal != 0) NoteDeathInGame(exited);
  const bool in_order = status.known ? status.code == 0 : worker.stopping == Stopping::kOrdered;
  const ExitResult result = status.signal != 0 ? ExitResult::kSignal
                            : in_order         ? ExitResult::kClean
                                               : ExitResult::kError;
  Finish(found, std::move(exited), result);
}

void Supervisor::Finish(Workers::iterator worker, v1::WorkerExited exited, ExitResult result) {
  const WorkerKey key = worker->first;
  if (const auto port = worker->second.record.first_port(); port != 0) ports_.Return(static_cast<std::uint16_t>(port));
  workers_.erase(worker);
  ForgetUnnamed();
  KeepExit(key, std::move(exited), result);
}

void Supervisor::KeepExit(const WorkerKey& key, v1::WorkerExited exited, ExitResult result) {
  actions_.push_back(ReportExit{exited, result});
  exits_[key] = std::move(exited);
  dirty_ = true;
}

// --- From workers

absl::StatusOr<WorkerKey> Supervisor::Attached(const v1::WorkerReport& first, pid_t peer) {
  const WorkerKey key = KeyOf(first.identity());
  const auto found = workers_.find(key);
  const std::int64_t pid = found == workers_.end() ? 0 : found->second.record.identity().pid();
  if (absl::Status status = CheckSpeaker(first.identity(), peer, pid); !status.ok()) return status;
  Worker& worker = found->second;
  worker.attached = worker.ever_attached = true;
  if (worker.stopping == Stopping::kNo) worker.deadline.reset();
  ForgetSent(worker);
  worker.takes_changes = first.takes_player_changes();
  Reported(key, first);
  PushOrder(key, worker);
  return key;
}

void Supervisor::Reported(const WorkerKey& key, const v1::WorkerReport& report) {
  const auto found = workers_.find(key);
  if (found == workers_.end()) return;
  Worker& worker = found->second;
  if (const std::size_t bytes = report.ByteSizeLong(); bytes > kMaxReportBytes) {
    return Kill(key, worker, absl::StrCat("killed: a report of ", bytes, " bytes, at most ", kMaxReportBytes));
  }
  const bool differs = DiffersInState(worker.report, report);
  if (worker.report.tick() != report.tick()) ticks_moved_ = true;
  worker.report = report;
  *worker.report.mutable_identity() = worker.record.identity();
  actions_.push_back(ForwardReport{worker.report});
  if (worker.order && worker.order->has_checkpoint() && report.checkpoint_tick() == worker.order->checkpoint().tick() &&
      std::exchange(worker.uploaded_tick, report.checkpoint_tick()) != report.checkpoint_tick()) {
    actions_.push_back(
        UploadState{key, report.checkpoint_tick(), StatePath(key, "checkpoint", report.checkpoint_tick())});
  }
  if (differs) dirty_ = true;
}

void Supervisor::Detached(const WorkerKey& key) {
  if (const auto found = workers_.find(key); found != workers_.end()) found->second.attached = false;
}

// --- Ending

void Supervisor::BeginStop(const WorkerKey& key, Worker& worker, TimePoint now) {
  if (worker.attached) {
    worker.stopping = Stopping::kOrdered;
    worker.deadline = now + kStopPatience;
    PushOrder(key, worker);
  } else {
    worker.stopping = Stopping::kTerminated;
    worker.deadline = now + kTermPatience;
    Signal(key, worker, SIGTERM);
  }
}

void Supervisor::Signal(const WorkerKey& key, const Worker& worker, int signal) {
  if (worker.record.identity().pid() != 0) actions_.push_back(SignalWorker{key, signal});
}

void Supervisor::Kill(const WorkerKey& key, Worker& worker, const std::string& why) {
  worker.stopping = Stopping::kKilled;
  worker.deadline.reset();
  worker.why = why;
  Signal(key, worker, SIGKILL);
}

void Supervisor::Tick(TimePoint now) {
  const auto seconds = [](Duration d) { return std::chrono::duration_cast<std::chrono::seconds>(d).count(); };
  for (auto& [key, worker] : workers_) {
    if (worker.keep_at && *worker.keep_at <= now) Keep(key, worker);
    if (!worker.deadline || *worker.deadline > now) continue;
    switch (worker.stopping) {
      case Stopping::kNo:
        Kill(key, worker, absl::StrCat("killed: did not attach within ", seconds(kAttachTimeout), " s"));
        break;
      case Stopping::kOrdered:
        worker.stopping = Stopping::kTerminated;
        worker.deadline = now + kTermPatience;
        Signal(key, worker, SIGTERM);
        break;
      case Stopping::kTerminated:
        Kill(key, worker, absl::StrCat("killed: did not stop within ", seconds(kTermPatience), " s of SIGTERM"));
        break;
      case Stopping::kKilled:
        break;
    }
  }
}

std::optional<TimePoint> Supervisor::NextDeadline() const {
  std::optional<TimePoint> next;
  for (const auto& [key, worker] : workers_) {
    for (const std::optional<TimePoint>& due : {worker.deadline, worker.keep_at}) {
      if (due && (!next || *due < *next)) next = due;
    }
  }
  return next;
}

void Supervisor::StopAll(TimePoint now) {
  const bool again = std::exchange(stopping_all_, true);
  for (auto& [key, worker] : workers_) {
    if (again) {
      Kill(key, worker, "killed: ordered to stop at once");
    } else if (worker.stopping == Stopping::kNo) {
      BeginStop(key, worker, now);
    }
  }
}

}  // namespace tessera::agent
