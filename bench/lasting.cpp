#include "bench/lasting.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <iostream>

#include "bench/lasting_restore.h"
#include "bench/lasting_run.h"
#include "bench/small_disk.h"

namespace tessera::bench {
namespace {

using Kind = LastingFaultKind;

constexpr std::uint64_t kLastingSeed = 23;
constexpr unsigned kLastingKinds = static_cast<unsigned>(kLastLastingFault) + 1;
constexpr unsigned kFullFaults = 4 * kLastingKinds, kQuickFaults = kLastingKinds;  // four of each kind, one
constexpr std::uint32_t kLastingPlayers = 2;
constexpr std::chrono::milliseconds kPatientElection{5000};
constexpr const char *kLastingScene = "plaza", *kLastingEngine = "tessera";

std::vector<LastingFault> FaultsFor(const SuiteOptions& options) {
  const unsigned wanted = options.runs > 0 ? options.runs : options.quick ? kQuickFaults : kFullFaults;
  std::vector<LastingFault> faults;
  // Each kind comes once before any comes again, so so many hold as many of it as are wanted.
  for (const LastingFault& fault : DrawFaults(kLastingSeed, options.only.empty() ? wanted : wanted * kLastingKinds)) {
    if (faults.size() < wanted && std::string(NameOf(fault.kind)).find(options.only) != std::string::npos) {
      faults.push_back(fault);
    }
  }
  return faults;
}

// In milliseconds, of those that are known.
std::vector<double> SpansOf(const std::vector<LastingGap>& gaps, double LastingGap::*span, const auto& counts) {
  std::vector<double> spans;
  for (const LastingGap& gap : gaps) {
    if (counts(gap.kind) && gap.*span >= 0) spans.push_back(1000 * gap.*span);
  }
  return spans;
}

void AddSpans(const std::string& name, std::vector<double> spans, Report& report) {
  if (spans.empty()) return;
  std::ranges::sort(spans);
  report.Set(kLastingScene, kLastingEngine, "faults", name + "_p50", spans[spans.size() / 2], "ms");
  report.Set(kLastingScene, kLastingEngine, "faults", name + "_max", spans.back(), "ms");
}

void Tell(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::cerr << "lasting: " << line << "\n";
}

void AddVerdict(const LastingVerdict& verdict, Report& report) {
  const auto add = [&](const char* name, double value, const char* unit) {
    report.Set(kLastingScene, kLastingEngine, "faults", name, value, unit);
  };
  const auto count = [](const std::vector<std::string>& lines) { return static_cast<double>(lines.size()); };
  add("faults", static_cast<double>(verdict.gaps.size()), "1");
  add("faults_not_mended", count(verdict.not_well), "1");
  add("acknowledged", static_cast<double>(verdict.changes), "1");
  add("acknowledged_lost", count(verdict.lost), "1");
  add("two_writers", count(verdict.two_writers), "1");
  add("two_owners", count(verdict.two_owners), "1");
  add("players_dropped", count(verdict.players_dropped), "1");
  add("false_running_s", verdict.false_running.total_s, "s");
  add("false_running_longest_s", verdict.false_running.longest_s, "s");
  add("false_degraded_s", verdict.false_degraded.total_s, "s");
  const auto any = [](Kind) { return true; };
  AddSpans("leader_gap_ms", SpansOf(verdict.gaps, &LastingGap::leader_s, any), report);
  AddSpans("orphan_failover_ms", SpansOf(verdict.gaps, &LastingGap::orphan_s, any), report);
  AddSpans("stopped_store_gap_ms",
           SpansOf(verdict.gaps, &LastingGap::failover_s, [](Kind kind) { return kind == Kind::kSlowStore; }), report);
  AddSpans("worker_gap_ms",
           SpansOf(verdict.gaps, &LastingGap::failover_s, [](Kind kind) { return kind == Kind::kKillWorker; }), report);
  Tell(verdict.not_well);
  Tell(verdict.lost);
  Tell(verdict.two_writers);
  Tell(verdict.two_owners);
  Tell(verdict.players_dropped);
  Tell(verdict.false_running.told);
  Tell(verdict.false_degraded.told);
}

void TellLine(const std::string& line) { std::cerr << "lasting: " << line << "\n"; }

struct LastingScene {
  const char* name;
  absl::Status (*run)(const RestoreSize& size, Report& report);
};

constexpr LastingScene kLastingScenes[] = {
    {"restored", RunRestored}, {"upgrade", RunUpgrades}, {"takeover", RunTakeover}};

// An exception, as where a program cannot be started, is an error of this scene alone.
absl::Status RunScene(const LastingScene& scene, const RestoreSize& size, Report& report) {
  try {
    return scene.run(size, report);
  } catch (const std::exception& error) {
    return absl::InternalError(error.what());
  }
}

absl::Status RunFaults(const local::HostNetwork& network, const std::vector<LastingFault>& faults, Report& report) {
  const auto verdict = RunLasting(network, {.faults = faults, .players = kLastingPlayers, .tell = TellLine});
  if (!verdict.ok()) return verdict.status();
  AddVerdict(*verdict, report);
  return report.Save();
}

// Writes that take 2 s, and no election among etcd's members on top of it: they wait longer for each other.
absl::Status RunSlowStore(const local::HostNetwork& network, std::vector<LastingFault> faults, Report& report) {
  std::erase_if(faults, [](const LastingFault& fault) { return fault.kind != Kind::kSlowStore; });
  if (faults.empty()) return absl::OkStatus();
  const auto verdict = RunLasting(
      network, {.faults = faults, .players = kLastingPlayers, .etcd_election = kPatientElection, .tell = TellLine});
  if (!verdict.ok()) return verdict.status();
  const std::vector<double> gaps = SpansOf(verdict->gaps, &LastingGap::failover_s, [](Kind) { return true; });
  AddSpans("slow_store_gap_ms", gaps, report);
  if (!gaps.empty()) {
    report.Set(kLastingScene, kLastingEngine, "faults", "slow_store_gap_ms", std::ranges::max(gaps), "ms");
  }
  Tell(verdict->not_well);
  return report.Save();
}

}  // namespace

absl::Status RunLastingSuite(const SuiteOptions& options, Report& report) {
  const std::vector<LastingFault> faults = FaultsFor(options);
  std::vector<LastingScene> scenes;
  for (const LastingScene& scene : kLastingScenes) {
    if (std::string(scene.name).find(options.only) != std::string::npos) scenes.push_back(scene);
  }
  if (faults.empty() && scenes.empty()) {
    return absl::InvalidArgumentError("--only: no fault and no scene has this in its name");
  }
  // Before gRPC makes threads, which would stay in the old one.
  if (absl::Status own = local::EnterOwnNetwork(); !own.ok()) return own;
  if (absl::Status own = EnterOwnMounts(); !own.ok()) return own;
  absl::Status worst = absl::OkStatus();
  const RestoreSize size{.runs = options.runs > 0 ? options.runs
                                 : options.quick  ? 1U
                                                  : 10U,
                         .bodies = 200,
                         .players = 4};
  for (const LastingScene& scene : scenes) {
    // One that fails is reported, and leaves the others their turn.
    if (const absl::Status status = RunScene(scene, size, report); !status.ok()) {
      TellLine(std::string(scene.name) + ": " + std::string(status.message()));
      worst = status;
    }
  }
  if (faults.empty()) return worst;
  const auto network = local::HostNetwork::Create(LastingStage::kMachines);
  if (!network.ok()) return network.status();
  worst.Update(RunFaults(**network, faults, report));
  worst.Update(RunSlowStore(**network, faults, report));
  return worst;
}

}  // namespace tessera::bench
