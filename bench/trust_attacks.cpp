// Attacks at the doors of a control plane: what gets through, what they cost it, and who waits meanwhile; then its
// memory over much coming and going.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bench/attack_seat.h"
#include "bench/statistics.h"
#include "bench/trust_scenes.h"
#include "bench/trust_stage.h"
#include "host/child_process.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "local_cluster/command_error.h"

namespace tessera::bench {
namespace {

constexpr std::uint32_t kCallsBeside = 500;  // at least, where an attack can be repeated
constexpr std::size_t kMaxSaid_bytes = 1 << 20;
constexpr std::chrono::seconds kAttackPatience{180};
// An instance keeps those who have left for a minute (keep_left_players of control_settings.h), and a second passes
// until the last are forgotten.
constexpr std::chrono::seconds kLeftAreKept{62};
constexpr std::chrono::seconds kRest{5}, kRestPatience{180};
constexpr std::chrono::milliseconds kRestPoll{500};
constexpr double kRestless_mb = 0.005;

// An operator's calls, in turns at the socket and at the door by TLS, each by a connection of its own.
struct OperatorsCalls {
  std::vector<double> at_socket_s, at_door_s;
};

// Adds to `calls` while there are to be more, of which it is asked by how many there are.
void CallAsOperator(const support::Target& target, const std::string& token, OperatorsCalls& calls,
                    const std::function<bool(std::size_t)>& more) {
  while (more(calls.at_socket_s.size())) {
    const double at_socket_s = support::OperatorsCallSeconds(target);
    const double at_door_s = support::OperatorsCallSecondsAtDoor(target, token);
    if (at_socket_s < 0 || at_door_s < 0) throw local::CommandError("an operator's call was not answered");
    calls.at_socket_s.push_back(at_socket_s);
    calls.at_door_s.push_back(at_door_s);
  }
}

// One attack under way, by a process of its own.
class Attacker {
 public:
  explicit Attacker(const AttackSeat& seat)
      : process_(local::OrThrow(host::ChildProcess::Start(
            {.argv = AttackCommand(seat), .log_path = folder_.path() + "/log", .output_path = said_}))) {}

  bool IsOver() { return process_.Wait(std::chrono::milliseconds(0)).has_value(); }
  void Enough() const { process_.Signal(SIGTERM); }
  support::Outcome End() {
    const auto ended = process_.Wait(kAttackPatience);
    if (!ended || !ended->Clean()) {
      throw local::CommandError("the attacker " + (ended ? ended->Describe() : "did not end") +
                                host::LastLinesText(folder_.path() + "/log", 4));
    }
    return ReadOutcome(local::OrThrow(host::ReadFile(said_, kMaxSaid_bytes)));
  }

 private:
  const host::TemporaryFolder folder_;
  const std::string said_ = folder_.path() + "/said";
  host::ChildProcess process_;
};

struct AttackCosts {
  support::Outcome outcome;
  OperatorsCalls beside;  // meanwhile
  double stays_mb = 0, highest_mb = 0;
};

AttackCosts Attack(const TrustStage& stage, const AttackSeat& seat, const std::string& token) {
  AttackCosts costs;
  const double before_mb = stage.ControlMegabytes();
  Attacker attacker(seat);
  std::atomic<bool> over = false;
  std::thread watcher([&] {
    while (!over) {
      costs.highest_mb = std::max(costs.highest_mb, stage.ControlMegabytes() - before_mb);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  std::string failure;
  bool enough = false;
  try {
    CallAsOperator(stage.target(), token, costs.beside, [&](std::size_t calls) {
      if (calls >= kCallsBeside && !std::exchange(enough, true)) attacker.Enough();
      return !attacker.IsOver();
    });
  } catch (const std::exception& error) {
    failure = error.what();
    attacker.Enough();
  }
  over = true;
  watcher.join();
  costs.outcome = attacker.End();
  if (!failure.empty()) costs.outcome.Try(failure, false);
  costs.stays_mb = stage.ControlMegabytes() - before_mb;
  return costs;
}

}  // namespace

absl::Status RunAttacks(const TrustSize& size, Report& report) {
  double through = 0;
  for (const std::string& name : AttackNames()) {
    TrustStage stage;  // anew, so that its memory is that of this attack
    const std::string world = stage.CreateWorld(false);
    const std::string token = stage.OperatorsToken();
    OperatorsCalls quiet;
    CallAsOperator(stage.target(), token, quiet, [&](std::size_t calls) { return calls < size.calls; });
    const AttackSeat seat{.name = name,
                          .target = stage.target(),
                          .world = world,
                          .size = {.import_mb = size.import_mb,
                                   .lease_requests = size.lease_requests,
                                   .join_threads = size.join_threads,
                                   .joins_each = size.joins_each}};
    const AttackCosts costs = Attack(stage, seat, token);
    for (const std::string& line : costs.outcome.through) std::cerr << "trust: " << name << ": " << line << "\n";
    const auto got_through = static_cast<double>(costs.outcome.through.size());
    through += got_through;
    const auto add = [&](const char* metric, double value, const char* unit) {
      report.Add("attacks", kTrustEngine, name, metric, value, unit);
    };
    add("tries", costs.outcome.tries, "1");
    add("through", got_through, "1");
    add("control_memory_mb", costs.stays_mb, "MB");
    add("control_memory_highest_mb", costs.highest_mb, "MB");
    const auto add_calls = [&](const std::string& calls, const std::vector<double>& quiet_times_s,
                               const std::vector<double>& beside_times_s) {
      const double quiet_s = Quantile(quiet_times_s, 0.99);
      const double beside_s = beside_times_s.empty() ? 0 : Quantile(beside_times_s, 0.99);
      add((calls + "_p99_quiet_ms").c_str(), 1e3 * quiet_s, "ms");
      add((calls + "_p99_ms").c_str(), 1e3 * beside_s, "ms");
      add((calls + "_p99_ratio").c_str(), beside_s / quiet_s, "1");
      std::cerr << fmt::format("trust: {}: {}'s p99 {:.1f} ms, quiet {:.1f} ms\n", name, calls, 1e3 * beside_s,
                               1e3 * quiet_s);
    };
    add_calls("operator", quiet.at_socket_s, costs.beside.at_socket_s);
    add_calls("operator_door", quiet.at_door_s, costs.beside.at_door_s);
    add("operator_calls", static_cast<double>(costs.beside.at_socket_s.size()), "1");
    std::cerr << fmt::format("trust: {}: {} of {} got through\n", name, got_through, costs.outcome.tries);
  }
  report.Add("attacks", kTrustEngine, "all", "attacks_through", through, "1");
  return absl::OkStatus();
}

namespace {

// The heap when it has come to rest: when all is forgotten that is kept for a time, and it has not fallen for some
// seconds.
double RestingHeapMegabytes(const TrustStage& stage, std::chrono::seconds kept) {
  double lowest_mb = stage.HeapMegabytes();
  const auto begin = std::chrono::steady_clock::now();
  auto now = begin, lowest_at = begin;
  for (; now < begin + kept || now < lowest_at + kRest; now = std::chrono::steady_clock::now()) {
    if (now - begin > kRestPatience) throw local::CommandError("churn: the heap does not come to rest");
    std::this_thread::sleep_for(kRestPoll);
    const double heap_mb = stage.HeapMegabytes();
    if (heap_mb >= lowest_mb - kRestless_mb) continue;
    lowest_mb = heap_mb;
    lowest_at = std::chrono::steady_clock::now();
  }
  return lowest_mb;
}

// The highest of all readings but the first against the first.
double Growth(const std::string& what, const std::vector<double>& readings_mb) {
  std::cerr << fmt::format("trust: churn: {}, MB: {:.2f}\n", what, fmt::join(readings_mb, " "));
  return *std::max_element(readings_mb.begin() + 1, readings_mb.end()) / readings_mb.front();
}

// The growth of the heap in use, at rest, and beside it of all memory that is of no file: the heap with the pages that
// malloc keeps for later, and stacks.
void AddGrowth(const TrustStage& stage, const std::string& config, std::chrono::seconds kept, std::uint32_t readings,
               std::uint32_t times, const std::function<void()>& act, Report& report) {
  const std::uint32_t between = std::max(1U, times / readings);
  std::vector<double> heap_mb, anonymous_mb;
  for (std::uint32_t done = 1; done <= times; ++done) {
    act();
    if (done % between != 0) continue;
    heap_mb.push_back(RestingHeapMegabytes(stage, kept));
    anonymous_mb.push_back(stage.AnonymousMegabytes());
  }
  report.Add("churn", kTrustEngine, config, "heap_growth_ratio", Growth(config + ": heap", heap_mb), "1");
  report.Add("churn", kTrustEngine, config, "heap_mb", heap_mb.back(), "MB");
  report.Add("churn", kTrustEngine, config, "memory_growth_ratio", Growth(config + ": memory", anonymous_mb), "1");
  report.Add("churn", kTrustEngine, config, "memory_mb", anonymous_mb.back(), "MB");
}

}  // namespace

absl::Status RunChurn(const TrustSize& size, Report& report) {
  // Freed memory that a thread keeps for itself counts as in use, so in this scene none keeps any.
  setenv("GLIBC_TUNABLES", "glibc.malloc.tcache_count=0", 1);
  {
    // All of them join, for it is what they leave behind that counts.
    TrustStage stage({"--guests-per-address", "0", "--guests-per-instance", "0"});
    const std::string world = stage.CreateWorld(false);
    constexpr int kThreads = 4, kEach = 25;
    const std::uint32_t rounds = std::max(10U, size.churn_joins / (kThreads * kEach));
    const auto join = [&] {
      const support::Outcome outcome = support::JoinAndLeave(stage.target(), world, kThreads, kEach);
      if (!outcome.through.empty()) throw local::CommandError("churn: " + outcome.through.front());
    };
    AddGrowth(stage, fmt::format("joins={}", rounds * kThreads * kEach), kLeftAreKept, size.churn_readings, rounds,
              join, report);
  }
  TrustStage stage;
  AddGrowth(
      stage, fmt::format("worlds={}", size.churn_worlds), std::chrono::seconds{0}, size.churn_readings,
      size.churn_worlds, [&] { stage.DeleteWorld(stage.CreateWorld(true)); }, report);
  unsetenv("GLIBC_TUNABLES");
  return absl::OkStatus();
}

}  // namespace tessera::bench
