// Attacks at the doors of a control plane: what gets through, what they cost it, and who waits meanwhile; then its
// memory over much coming and going.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
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

std::vector<double> OperatorsCalls(const support::Target& target, const std::function<bool(std::size_t)>& more) {
  std::vector<double> times;
  while (more(times.size())) {
    const double took_s = support::OperatorsCallSeconds(target);
    if (took_s < 0) throw local::CommandError("an operator's call was not answered");
    times.push_back(took_s);
  }
  return times;
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
  std::vector<double> beside_s;  // operator's calls meanwhile
  double stays_mb = 0, highest_mb = 0;
};

AttackCosts Attack(const TrustStage& stage, const AttackSeat& seat) {
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
    costs.beside_s = OperatorsCalls(stage.target(), [&](std::size_t calls) {
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
    const double quiet_s =
        Quantile(OperatorsCalls(stage.target(), [&](std::size_t calls) { return calls < size.calls; }), 0.99);
    const AttackCosts costs = Attack(stage, {.name = name,
                                             .target = stage.target(),
                                             .world = world,
                                             .size = {.import_mb = size.import_mb,
                                                      .lease_requests = size.lease_requests,
                                                      .join_threads = size.join_threads,
                                                      .joins_each = size.joins_each}});
    for (const std::string& line : costs.outcome.through) std::cerr << "trust: " << name << ": " << line << "\n";
    const auto got_through = static_cast<double>(costs.outcome.through.size());
    through += got_through;
    const double beside_s = costs.beside_s.empty() ? 0 : Quantile(costs.beside_s, 0.99);
    const auto add = [&](const char* metric, double value, const char* unit) {
      report.Add("attacks", kTrustEngine, name, metric, value, unit);
    };
    add("tries", costs.outcome.tries, "1");
    add("through", got_through, "1");
    add("control_memory_mb", costs.stays_mb, "MB");
    add("control_memory_highest_mb", costs.highest_mb, "MB");
    add("operator_p99_quiet_ms", 1e3 * quiet_s, "ms");
    add("operator_p99_ms", 1e3 * beside_s, "ms");
    add("operator_p99_ratio", beside_s / quiet_s, "1");
    add("operator_calls", static_cast<double>(costs.beside_s.size()), "1");
    std::cerr << fmt::format("trust: {}: {} of {} got through, operator's p99 {:.1f} ms, quiet {:.1f} ms\n", name,
                             got_through, costs.outcome.tries, 1e3 * beside_s, 1e3 * quiet_s);
  }
  report.Add("attacks", kTrustEngine, "all", "attacks_through", through, "1");
  return absl::OkStatus();
}

namespace {

// Memory after all of it against that after the first tenth.
double GrowthRatio(const TrustStage& stage, std::uint32_t times, const std::function<void(std::uint32_t)>& act) {
  const std::uint32_t tenth = std::max(1U, times / 10);
  for (std::uint32_t i = 0; i < tenth; ++i) act(i);
  const double early_mb = stage.ControlMegabytes();
  for (std::uint32_t i = tenth; i < times; ++i) act(i);
  const double late_mb = stage.ControlMegabytes();
  std::cerr << fmt::format("trust: churn: {:.1f} MB after a tenth, {:.1f} MB in the end\n", early_mb, late_mb);
  return late_mb / early_mb;
}

}  // namespace

absl::Status RunChurn(const TrustSize& size, Report& report) {
  {
    // All of them join, for it is what they leave behind that counts.
    TrustStage stage({"--guests-per-address", "0", "--guests-per-instance", "0"});
    const std::string world = stage.CreateWorld(false);
    constexpr int kThreads = 4, kEach = 25;
    const std::uint32_t rounds = std::max(10U, size.churn_joins / (kThreads * kEach));
    const double ratio = GrowthRatio(stage, rounds, [&](std::uint32_t) {
      const support::Outcome outcome = support::JoinAndLeave(stage.target(), world, kThreads, kEach);
      if (!outcome.through.empty()) throw local::CommandError("churn: " + outcome.through.front());
    });
    report.Add("churn", kTrustEngine, fmt::format("joins={}", rounds * kThreads * kEach), "heap_growth_ratio", ratio,
               "1");
  }
  TrustStage stage;
  const double ratio =
      GrowthRatio(stage, size.churn_worlds, [&](std::uint32_t) { stage.DeleteWorld(stage.CreateWorld(true)); });
  report.Add("churn", kTrustEngine, fmt::format("worlds={}", size.churn_worlds), "heap_growth_ratio", ratio, "1");
  return absl::OkStatus();
}

}  // namespace tessera::bench
