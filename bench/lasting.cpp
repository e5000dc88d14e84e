#include "bench/lasting.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <iostream>
#include <map>
#include <utility>

#include "bench/lasting_restore.h"
#include "bench/lasting_run.h"
#include "bench/small_disk.h"

namespace tessera::bench {
namespace {

using Kind = LastingFaultKind;

constexpr std::uint64_t kLastingSeed = 23;
constexpr unsigned kLastingKinds = static_cast<unsigned>(kLastLastingFault) + 1;
constexpr unsigned kQuickFaults = kLastingKinds;               // one of each kind
constexpr unsigned kStrikesOfKind = 4, kStrikesOfStores = 10;  // in a whole run; of those with a bound of their own
constexpr std::uint32_t kLastingPlayers = 2;
constexpr std::chrono::milliseconds kPatientElection{5000};
constexpr const char *kLastingScene = "plaza", *kLastingEngine = "tessera";

unsigned StrikesOf(Kind kind) {
  return kind == Kind::kStoreMember || kind == Kind::kStoreLeader ? kStrikesOfStores : kStrikesOfKind;
}

std::vector<LastingFault> FaultsFor(const SuiteOptions& options) {
  const bool whole = options.runs == 0 && !options.quick;
  const unsigned wanted = options.runs > 0 ? options.runs : kQuickFaults;
  std::map<Kind, unsigned> struck;
  std::vector<LastingFault> faults;
  // Each kind comes once before any comes again, so so many hold as many of it as are wanted.
  const unsigned drawn = (whole ? kStrikesOfStores : options.only.empty() ? 1 : wanted) * kLastingKinds;
  for (const LastingFault& fault : DrawFaults(kLastingSeed, std::max(drawn, wanted))) {
    if (std::string(NameOf(fault.kind)).find(options.only) == std::string::npos) continue;
    if (whole ? ++struck[fault.kind] <= StrikesOf(fault.kind) : faults.size() < wanted) faults.push_back(fault);
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

// The longest by the plain name, too.
void AddWorstSpan(const std::string& name, const std::vector<double>& spans, Report& report) {
  AddSpans(name, spans, report);
  if (!spans.empty()) report.Set(kLastingScene, kLastingEngine, "faults", name, std::ranges::max(spans), "ms");
}

void Tell(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::cerr << "lasting: " << line << "\n";
}

// Those of the faults for a minute alone, the worst of them.
void AddFullDisk(const LastingVerdict& verdict, const char* config, Report& report) {
  std::vector<double> running, degraded;
  for (const LastingGap& gap : verdict.gaps) {
    if (gap.kind != Kind::kFullStoreMinute) continue;
    running.push_back(gap.false_running_s);
    degraded.push_back(gap.false_degraded_s);
  }
  if (running.empty()) return;
  const auto add = [&](const char* name, const std::vector<double>& spans) {
    report.Set(kLastingScene, kLastingEngine, config, name, std::ranges::max(spans), "s");
  };
  add("full_disk_false_running_s", running);
  add("full_disk_false_degraded_s", degraded);
}

// Links between hosts of which the regions are neighbours: when it was said, and when it was over.
void AddCuts(const LastingVerdict& verdict, Report& report) {
  std::vector<double> degraded_ms, routed_ms, false_running_s;
  for (const LastingGap& gap : verdict.gaps) {
    if (!gap.cut) continue;
    const CutOutcome& outcome = gap.cut_outcome;
    if (outcome.degraded_s >= 0) degraded_ms.push_back(1000 * outcome.degraded_s);
    if (outcome.routed_s >= 0) routed_ms.push_back(1000 * outcome.routed_s);
    false_running_s.push_back(outcome.false_running_s);
  }
  if (false_running_s.empty()) return;
  const auto add = [&](const char* name, double value, const char* unit) {
    report.Set(kLastingScene, kLastingEngine, "faults", name, value, unit);
  };
  add("cuts_not_told", static_cast<double>(verdict.cuts_not_told.size()), "1");
  add("cuts_routed", static_cast<double>(routed_ms.size()), "1");
  add("cut_false_running_s", std::ranges::max(false_running_s), "s");
  AddSpans("cut_degraded_ms", std::move(degraded_ms), report);
  AddSpans("cut_routed_ms", std::move(routed_ms), report);
}

void TellFalsehoods(const LastingVerdict& verdict) {
  std::map<std::string, std::pair<double, double>> by_kind;
  for (const LastingGap& gap : verdict.gaps) {
    auto& [running, degraded] = by_kind[NameOf(gap.kind)];
    running += gap.false_running_s;
    degraded += gap.false_degraded_s;
  }
  for (const auto& [kind, spans] : by_kind) {
    if (spans.first == 0 && spans.second == 0) continue;
    std::cerr << fmt::format("lasting: {}: RUNNING was said falsely for {:.2f} s, DEGRADED for {:.2f} s\n", kind,
                             spans.first, spans.second);
  }
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
  const auto of = [&](Kind wanted) {
    return SpansOf(verdict.gaps, &LastingGap::failover_s, [wanted](Kind kind) { return kind == wanted; });
  };
  AddSpans("stopped_store_gap_ms", of(Kind::kSlowStore), report);
  AddSpans("worker_gap_ms", of(Kind::kKillWorker), report);
  AddWorstSpan("store_member_gap_ms", of(Kind::kStoreMember), report);
  AddWorstSpan("store_leader_gap_ms", of(Kind::kStoreLeader), report);
  AddFullDisk(verdict, "faults", report);
  AddCuts(verdict, report);
  Tell(verdict.not_well);
  Tell(verdict.lost);
  Tell(verdict.two_writers);
  Tell(verdict.two_owners);
  Tell(verdict.players_dropped);
  Tell(verdict.cuts_not_told);
  Tell(verdict.false_running.told);
  Tell(verdict.false_degraded.told);
  TellFalsehoods(verdict);
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
      network,
      {.faults = faults, .players = kLastingPlayers, .setup = {.election = kPatientElection}, .tell = TellLine});
  if (!verdict.ok()) return verdict.status();
  AddWorstSpan("slow_store_gap_ms", SpansOf(verdict->gaps, &LastingGap::failover_s, [](Kind) { return true; }), report);
  Tell(verdict->not_well);
  return report.Save();
}

// The only control plane, with SQLite on a disk that is full for a minute.
absl::Status RunFullDisk(const local::HostNetwork& network, std::vector<LastingFault> faults, Report& report) {
  std::erase_if(faults, [](const LastingFault& fault) { return fault.kind != Kind::kFullStoreMinute; });
  if (faults.empty()) return absl::OkStatus();
  const auto verdict =
      RunLasting(network, {.faults = faults, .players = kLastingPlayers, .setup = {.etcd = false}, .tell = TellLine});
  if (!verdict.ok()) return verdict.status();
  const auto add = [&](const char* name, const std::vector<std::string>& lines) {
    report.Set(kLastingScene, kLastingEngine, "full_disk", name, static_cast<double>(lines.size()), "1");
    Tell(lines);
  };
  add("faults_not_mended", verdict->not_well);
  add("acknowledged_lost", verdict->lost);
  add("two_owners", verdict->two_owners);
  add("players_dropped", verdict->players_dropped);
  AddFullDisk(*verdict, "full_disk", report);
  Tell(verdict->false_running.told);
  Tell(verdict->false_degraded.told);
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
  worst.Update(RunFullDisk(**network, faults, report));
  return worst;
}

}  // namespace tessera::bench
