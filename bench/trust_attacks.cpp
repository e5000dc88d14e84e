// Attacks at the doors of a control plane: what gets through, what they cost it, and who waits meanwhile; then its
// memory over much coming and going.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <iostream>
#include <thread>
#include <vector>

#include "bench/statistics.h"
#include "bench/trust_scenes.h"
#include "bench/trust_stage.h"

namespace tessera::bench {
namespace {

constexpr std::uint32_t kLeastCallsBeside = 20;

struct TrustAttack {
  const char* name;
  std::function<support::Outcome(const support::Target&, const std::string& world)> run;
};

std::vector<TrustAttack> Attacks(const TrustSize& size) {
  using support::Target;
  return {
      {"methods", [](const Target& t, const std::string&) { return support::CallEveryMethod(t); }},
      {"plain", [](const Target& t, const std::string&) { return support::SpeakPlainText(t); }},
      {"tokens", [](const Target& t, const std::string&) { return support::ShowLongTokens(t, 8, 60U << 20); }},
      {"requests", [](const Target& t, const std::string&) { return support::AskAtLength(t, 16, 60U << 20); }},
      {"connections", [](const Target& t, const std::string&) { return support::HoldConnections(t, 300, 64); }},
      {"silence", [](const Target& t, const std::string&) { return support::SayNothing(t, 100); }},
      {"imports",
       [=](const Target& t, const std::string&) {
         return support::ImportAsStranger(t, 4, std::size_t{size.import_mb} << 20);
       }},
      {"joins",
       [=](const Target& t, const std::string& world) {
         return support::JoinAndLeave(t, world, static_cast<int>(size.join_threads), static_cast<int>(size.joins_each));
       }},
      {"lies", [](const Target& t, const std::string& world) { return support::LieAsHost(t, world); }},
      {"deaf", [=](const Target& t,
                   const std::string&) { return support::NeverRead(t, static_cast<int>(size.lease_requests)); }},
  };
}

std::vector<double> OperatorsCalls(const support::Target& target, std::uint32_t at_least,
                                   const std::atomic<bool>* until) {
  std::vector<double> times;
  while (times.size() < at_least || (until != nullptr && !*until)) {
    const double took_s = support::OperatorsCallSeconds(target);
    if (took_s < 0) throw local::CommandError("an operator's call was not answered");
    times.push_back(took_s);
  }
  return times;
}

}  // namespace

absl::Status RunAttacks(const TrustSize& size, Report& report) {
  double through = 0;
  for (const TrustAttack& attack : Attacks(size)) {
    TrustStage stage;  // anew, so that its memory is that of this attack
    const std::string world = stage.CreateWorld(false);
    const double quiet_p99_s = Quantile(OperatorsCalls(stage.target(), size.calls, nullptr), 0.99);
    const double before_mb = stage.ControlMegabytes();
    std::atomic<bool> over = false;
    support::Outcome outcome;
    std::thread attacker([&] {
      try {
        outcome = attack.run(stage.target(), world);
      } catch (const std::exception& error) {
        outcome.Try(error.what(), false);
      }
      over = true;
    });
    double highest_mb = before_mb;
    std::thread watcher([&] {
      while (!over) {
        highest_mb = std::max(highest_mb, stage.ControlMegabytes());
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
    std::vector<double> beside;
    std::string failure;
    try {
      beside = OperatorsCalls(stage.target(), kLeastCallsBeside, &over);
    } catch (const std::exception& error) {
      failure = error.what();
    }
    attacker.join();
    watcher.join();
    if (!failure.empty()) outcome.Try(failure, false);
    for (const std::string& line : outcome.through) std::cerr << "trust: " << attack.name << ": " << line << "\n";
    through += static_cast<double>(outcome.through.size());
    const double p99_s = beside.empty() ? 0 : Quantile(beside, 0.99);
    report.Add("attacks", kTrustEngine, attack.name, "tries", outcome.tries, "1");
    report.Add("attacks", kTrustEngine, attack.name, "through", static_cast<double>(outcome.through.size()), "1");
    report.Add("attacks", kTrustEngine, attack.name, "control_memory_mb", stage.ControlMegabytes() - before_mb, "MB");
    report.Add("attacks", kTrustEngine, attack.name, "control_memory_highest_mb", highest_mb - before_mb, "MB");
    report.Add("attacks", kTrustEngine, attack.name, "operator_p99_quiet_ms", 1e3 * quiet_p99_s, "ms");
    report.Add("attacks", kTrustEngine, attack.name, "operator_p99_ms", 1e3 * p99_s, "ms");
    report.Add("attacks", kTrustEngine, attack.name, "operator_p99_ratio", p99_s / quiet_p99_s, "1");
    report.Add("attacks", kTrustEngine, attack.name, "operator_calls", static_cast<double>(beside.size()), "1");
    std::cerr << fmt::format("trust: {}: {} of {} got through\n", attack.name, outcome.through.size(), outcome.tries);
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
