#include "control_plane/life.h"

#include <algorithm>
#include <map>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace tessera::control {
namespace {

bool AllReached(const LifeFacts& facts, v1::WorkerPhase phase) {
  return std::all_of(facts.workers.begin(), facts.workers.end(), [phase](const WorkerFacts& worker) {
    return worker.phase >= phase && worker.phase != v1::WORKER_PHASE_STOPPING;
  });
}

// Why an instance that wants all its workers cannot go on; empty if it can.
std::string Failure(const LifeFacts& facts, v1::InstanceState state, bool started) {
  if (state == v1::INSTANCE_STATE_RUNNING) return "";
  for (const WorkerFacts& worker : facts.workers) {
    if (worker.gone) return absl::StrCat("region ", worker.region, " on ", worker.host_name, ": ", worker.ending);
    if (worker.host_lost && !started) {
      return absl::StrCat("region ", worker.region, ": host ", worker.host_name, " was lost before the start");
    }
  }
  return "";
}

// True if nobody has to be waited for, or no longer.
bool PlayersNoMatter(const LifeFacts& facts) { return facts.players_ready || facts.start_deadline_passed; }

std::string StartTimedOut(const LifeFacts& facts, bool run) {
  const v1::WorkerPhase phase = run ? v1::WORKER_PHASE_RUNNING : v1::WORKER_PHASE_LINKED;
  std::vector<std::string> late;
  for (const WorkerFacts& worker : facts.workers) {
    if (worker.phase < phase) late.push_back(absl::StrCat(worker.region, " on ", worker.host_name));
  }
  return absl::StrCat("start timed out: not ", run ? "running" : "linked", ": region ", absl::StrJoin(late, ", "));
}

}  // namespace

bool WantsWorkers(v1::InstanceState state) {
  return state == v1::INSTANCE_STATE_STARTING || state == v1::INSTANCE_STATE_WAITING_FOR_PLAYERS ||
         state == v1::INSTANCE_STATE_RUNNING;
}

bool IsStarting(v1::InstanceState state) {
  return state == v1::INSTANCE_STATE_PENDING || state == v1::INSTANCE_STATE_PLACING ||
         state == v1::INSTANCE_STATE_STARTING || state == v1::INSTANCE_STATE_WAITING_FOR_PLAYERS;
}

bool IsFinal(v1::InstanceState state) {
  return state == v1::INSTANCE_STATE_ENDED || state == v1::INSTANCE_STATE_FAILED;
}

LifeStep NextStep(v1::InstanceState state, bool run, const LifeFacts& facts) {
  if (WantsWorkers(state)) {
    std::string failure = Failure(facts, state, run);
    if (!failure.empty()) return {v1::INSTANCE_STATE_FAILED, run, std::move(failure)};
  }
  if (state == v1::INSTANCE_STATE_PENDING && PlayersNoMatter(facts)) {
    return {v1::INSTANCE_STATE_PLACING, run, ""};
  }
  if (state == v1::INSTANCE_STATE_STARTING) {
    const bool linked = AllReached(facts, v1::WORKER_PHASE_LINKED);
    run = run || (linked && PlayersNoMatter(facts));
    if (run && AllReached(facts, v1::WORKER_PHASE_RUNNING)) return {v1::INSTANCE_STATE_RUNNING, run, ""};
    if (linked && !run) return {v1::INSTANCE_STATE_WAITING_FOR_PLAYERS, run, ""};
    if (facts.start_timed_out) return {v1::INSTANCE_STATE_FAILED, run, StartTimedOut(facts, run)};
  }
  if (state == v1::INSTANCE_STATE_WAITING_FOR_PLAYERS) {
    run = run || PlayersNoMatter(facts);
    if (run && AllReached(facts, v1::WORKER_PHASE_RUNNING)) state = v1::INSTANCE_STATE_RUNNING;
  }
  if (state == v1::INSTANCE_STATE_STOPPING &&
      std::all_of(facts.workers.begin(), facts.workers.end(), [](const WorkerFacts& worker) { return worker.gone; })) {
    state = v1::INSTANCE_STATE_ENDED;
  }
  return {state, run, ""};
}

std::string NameOf(v1::InstanceState state) {
  constexpr std::string_view kPrefix = "INSTANCE_STATE_";
  const std::string& name = v1::InstanceState_Name(state);
  return name.size() > kPrefix.size() ? name.substr(kPrefix.size()) : absl::StrCat(static_cast<int>(state));
}

std::string DegradedReason(const std::vector<WorkerFacts>& workers) {
  std::map<std::string, std::vector<std::uint32_t>> silent;
  std::vector<std::string> causes;
  for (const WorkerFacts& worker : workers) {
    if (worker.gone) {
      causes.push_back(absl::StrCat("region ", worker.region, " on ", worker.host_name, " has ended",
                                    worker.ending.empty() ? "" : ": ", worker.ending));
    } else if (worker.host_lost) {
      silent[worker.host_name].push_back(worker.region);
    }
  }
  for (const auto& [host, regions] : silent) {
    causes.push_back(absl::StrCat("host ", host, " is silent: region", regions.size() == 1 ? " " : "s ",
                                  absl::StrJoin(regions, ", ")));
  }
  return absl::StrJoin(causes, "; ");
}

}  // namespace tessera::control
