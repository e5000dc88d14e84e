#include "bench/lasting_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <deque>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <thread>
#include <utility>

#include "bench/lasting_stage.h"
#include "bench/lasting_witness.h"
#include "host/temporary_folder.h"
#include "local_cluster/connection.h"
#include "local_cluster/scene_file.h"

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;
using Kind = LastingFaultKind;

// A region that makes no steps for so long stands still.
constexpr double kLeastStall_s = 0.5;
// All of it must hold for so long before the next fault strikes.
constexpr double kWell_s = 1;
// A backup that is taken up is of so many faults ago.
constexpr std::size_t kBackupAge = 3;
// The second blow comes after this share of the time that a fault holds.
constexpr double kSecondBlow = 1.0 / 3;
constexpr std::chrono::milliseconds kCheckpointPatience{30000};
constexpr std::chrono::seconds kWritesPatience{30};
// A link that is cut for so long degrades the world (docs/operating.md): RUNNING is a lie from then on.
constexpr double kCutKnown_s = 5;

bool StrikesTheLeader(Kind kind) {
  return kind == Kind::kKillLeader || kind == Kind::kStopLeader || kind == Kind::kCutLeader ||
         kind == Kind::kLoseLeader || kind == Kind::kCutLeaderWithHost || kind == Kind::kOrphan;
}
bool KillsAWorker(Kind kind) {
  return kind == Kind::kKillWorker || kind == Kind::kOrphan || kind == Kind::kSlowStore || kind == Kind::kFullStore ||
         kind == Kind::kFullDisk || kind == Kind::kStoreMember || kind == Kind::kStoreLeader;
}

absl::StatusOr<std::string> MakeWorld(const LastingStage& stage, const LastingPlan& plan) {
  try {
    local::Connection connection(stage.control());
    v1::CreateInstanceRequest request;
    *request.mutable_spec()->mutable_scene() = local::LoadScene(local::FindScene("plaza"), plan.bodies).message;
    request.mutable_spec()->set_regions(kLastingHosts);
    request.mutable_spec()->set_guests(true);
    return connection
        .Call("instance create", connection.instances(), &v1::InstanceService::Stub::CreateInstance, request)
        .instance()
        .id();
  } catch (const std::exception& error) {
    return absl::UnavailableError(error.what());
  }
}

// Two deaths may take a region and its standby: then the world goes back to its checkpoint, of which it has one a
// minute.
absl::Status MakeCheckpoint(const LastingStage& stage, const std::string& instance) {
  try {
    local::Connection connection(stage.control());
    v1::CheckpointInstanceRequest request;
    request.set_id(instance);
    connection.Call("instance checkpoint", connection.instances(), &v1::InstanceService::Stub::CheckpointInstance,
                    request, kCheckpointPatience);
  } catch (const std::exception& error) {
    return absl::UnavailableError(error.what());
  }
  return absl::OkStatus();
}

// Empty: every region steps by the map in force, each with a standby that has all, and nothing is under way.
std::string WhyNotWell(const v1::Instance& world, std::uint32_t regions, std::uint32_t players) {
  if (world.state() != v1::INSTANCE_STATE_RUNNING) {
    return fmt::format("{}: {}", v1::InstanceState_Name(world.state()), world.reason());
  }
  if (!world.changes().empty()) return world.changes(0).text();
  if (!world.unprotected_regions().empty())
    return fmt::format("region {} is unprotected", world.unprotected_regions(0));
  if (world.players() < players) return fmt::format("{} players are in", world.players());
  if (world.map().regions_size() != static_cast<int>(regions)) {
    return fmt::format("{} regions are in the map", world.map().regions_size());
  }
  for (const v1::RegionStatus& status : world.region_status()) {
    if (status.report().phase() != v1::WORKER_PHASE_RUNNING || status.report().acknowledged_tick() == 0) {
      return fmt::format("region {} is not known to run with its standby", status.region());
    }
  }
  return "";
}

// Two hosts that run neighbouring regions, the `which`th of such pairs.
absl::StatusOr<std::pair<std::uint32_t, std::uint32_t>> HostsOfABorder(const std::vector<Border>& borders,
                                                                       std::uint32_t which) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const Border& border : borders) {
    const auto one = LastingStage::HostNamed(border.host_of_one), other = LastingStage::HostNamed(border.host_of_other);
    if (one && other && *one != *other) pairs.insert(std::minmax(*one, *other));
  }
  if (pairs.empty()) return absl::UnavailableError("no two hosts run neighbouring regions");
  return *std::next(pairs.begin(), static_cast<std::ptrdiff_t>(which % pairs.size()));
}

std::string Worded(const LastingGap& gap) {
  std::string text = fmt::format("  {}:", NameOf(gap.kind));
  if (gap.leader_s >= 0) text += fmt::format(" changes accepted again after {:.2f} s", gap.leader_s);
  if (gap.failover_s >= 0) text += fmt::format(" all regions step again after {:.2f} s", gap.failover_s);
  return gap.leader_s < 0 && gap.failover_s < 0 ? text + " mended" : text;
}

class LastingDrama {
 public:
  // `folder`: for backups.
  LastingDrama(LastingStage& stage, LastingWitnesses& witnesses, const LastingPlan& plan, std::string instance,
               std::string folder)
      : stage_(stage), witnesses_(witnesses), plan_(plan), instance_(std::move(instance)), folder_(std::move(folder)) {}

  // The last reason why it is not; empty: it is.
  std::string WaitUntilWell(std::uint32_t regions = kLastingHosts, std::uint32_t players = 0) {
    const double since = witnesses_.Now();
    const auto until = std::chrono::steady_clock::now() + plan_.patience;
    if (!witnesses_.AcknowledgedAfter(since, plan_.patience)) return "no change is acknowledged";
    std::string why = "nothing is said of the world";
    std::optional<double> well_since;
    while (std::chrono::steady_clock::now() < until) {
      if (const auto world = witnesses_.LatestAfter(since)) {
        why = WhyNotWell(*world, regions, players);
        if (!why.empty()) well_since.reset();
        if (why.empty() && !well_since) well_since = witnesses_.Now();
      }
      if (well_since && witnesses_.Now() - *well_since >= kWell_s) {
        map_ = witnesses_.LatestAfter(since)->map().version();
        return witnesses_.SteppedAfter(since, map_, plan_.patience) ? "" : "a region makes no steps";
      }
      std::this_thread::sleep_for(50ms);
    }
    return why;
  }

  absl::StatusOr<LastingGap> Play(LastingFault& fault) {
    LastingGap gap{.kind = fault.kind};
    if (absl::Status status = UntilDone([&] { return BackUp(); }); !status.ok()) return status;
    if (StrikesTwice(fault.kind)) {
      if (absl::Status status = UntilDone([&] { return MakeCheckpoint(stage_, instance_); }); !status.ok())
        return status;
    }
    if (!backups_.empty()) fault.backup = backups_.front().file;
    fault.recorded = [this] { return witnesses_.AwaitWrites(kWritesPatience); };
    if (absl::Status status = UntilDone([&] { return AimAt(fault, gap); }); !status.ok()) return status;
    const double struck = gap.struck = witnesses_.Now();
    if (absl::Status status = Strike(fault, stage_); !status.ok()) return status;
    plan_.tell(fmt::format("{:.1f} s: {} {} for {:.1f} s, leader {}", struck, NameOf(fault.kind), fault.which,
                           fault.hold_s, fault.leader));
    if (fault.kind == Kind::kOldBackup) setbacks_.push_back({backups_.front().begun, witnesses_.Now()});
    const std::chrono::duration<double> hold(fault.hold_s);
    const auto first = StrikesTwice(fault.kind) ? kSecondBlow * hold : hold;
    std::this_thread::sleep_for(first);
    if (StrikesTwice(fault.kind)) {
      if (absl::Status status = StrikeAgain(fault, stage_); !status.ok()) return status;
      std::this_thread::sleep_for(hold - first);
    }
    gap.mended = witnesses_.Now();
    if (gap.cut) {
      gap.cut->from = struck;
      gap.cut->to = gap.mended;
    }
    if (absl::Status status = Mend(fault, stage_); !status.ok()) return status;
    if (StrikesTheLeader(fault.kind)) {
      gap.leader_s = witnesses_.AcknowledgedAfter(struck, plan_.patience).value_or(struck - 1) - struck;
    }
    if (KillsAWorker(fault.kind)) {
      const auto stepped = witnesses_.SteppedAfter(struck, map_ + 1, plan_.patience);
      if (stepped) gap.failover_s = *stepped - struck;
      if (stepped && fault.kind == Kind::kOrphan && gap.leader_s >= 0) {
        gap.orphan_s = std::max(gap.failover_s - gap.leader_s, 0.0);
      }
    }
    return gap;
  }

  const std::vector<Setback>& setbacks() const { return setbacks_; }

 private:
  struct Backup {
    std::string file;
    double begun = 0;
  };

  absl::Status AimAt(LastingFault& fault, LastingGap& gap) const {
    if (fault.kind == Kind::kCutBorder) {
      const auto hosts = HostsOfABorder(witnesses_.Borders(), fault.which);
      if (!hosts.ok()) return hosts.status();
      fault.border = *hosts;
      gap.cut = HostCut{LastingStage::NameOfHost(hosts->first), LastingStage::NameOfHost(hosts->second), 0, 0};
    }
    return Aim(fault, stage_);
  }

  // One before each fault, where one of them is to be taken up; the oldest of the last ones comes first.
  absl::Status BackUp() {
    if (std::ranges::none_of(plan_.faults, [](const LastingFault& f) { return f.kind == Kind::kOldBackup; })) {
      return absl::OkStatus();
    }
    Backup backup{fmt::format("{}/backup-{}", folder_, ++backups_made_), witnesses_.Now()};
    if (absl::Status status = stage_.BackUp(backup.file); !status.ok()) return status;
    backups_.push_back(std::move(backup));
    if (backups_.size() > kBackupAge + 1) backups_.pop_front();
    return absl::OkStatus();
  }
  // A member of etcd that is back after a cut may have another elected once more, though the world is well.
  absl::Status UntilDone(const std::function<absl::Status()>& attempt) const {
    const auto until = std::chrono::steady_clock::now() + plan_.patience;
    absl::Status status = attempt();
    while (!status.ok() && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(50ms);
      status = attempt();
    }
    return status;
  }

  LastingStage& stage_;
  LastingWitnesses& witnesses_;
  const LastingPlan& plan_;
  const std::string instance_, folder_;
  std::uint64_t map_ = 0;  // in force when it was well
  std::deque<Backup> backups_;
  std::size_t backups_made_ = 0;
  std::vector<Setback> setbacks_;
};

// A fault that strikes nothing would be measured as one that harms nothing.
bool WasRefused(const std::vector<ChangeRecord>& changes, double from, double to) {
  return std::ranges::any_of(changes, [&](const ChangeRecord& change) {
    return !change.acknowledged && change.asked >= from && change.answered <= to;
  });
}

void Judge(const History& history, const std::set<std::string>& hosts, const std::vector<Setback>& setbacks,
           LastingVerdict& verdict) {
  const Stalls stalls = StallsOf(history.steps, history.until, kLeastStall_s);
  verdict.lost = LostChanges(history.changes, hosts, setbacks);
  verdict.two_writers = TwoWriters(history.writes);
  verdict.two_owners = TwoOwners(history.steps);
  verdict.false_running = FalseRunning(history.claims, stalls);
  std::vector<HostCut> cuts;
  for (const LastingGap& gap : verdict.gaps) {
    if (gap.cut) cuts.push_back(*gap.cut);
  }
  verdict.false_degraded = FalseDegraded(history.claims, stalls, cuts);
  for (LastingGap& gap : verdict.gaps) {
    if (!gap.cut) continue;
    gap.cut_outcome = OutcomeOf(history.claims, *gap.cut, kCutKnown_s);
    if (gap.cut_outcome.told()) continue;
    verdict.cuts_not_told.push_back(
        fmt::format("{} and {} were cut from each other at {:.1f} s for {:.1f} s, and nobody said so", gap.cut->one,
                    gap.cut->other, gap.struck, gap.mended - gap.struck));
  }
  for (LastingGap& gap : verdict.gaps) {
    gap.false_running_s = verdict.false_running.Between(gap.struck, gap.well);
    gap.false_degraded_s = verdict.false_degraded.Between(gap.struck, gap.well);
  }
  for (const LastingGap& gap : verdict.gaps) {
    if (gap.kind == Kind::kFullStoreMinute && !WasRefused(history.changes, gap.struck, gap.mended)) {
      verdict.not_well.push_back(
          fmt::format("{} at {:.1f} s: the store took each change", NameOf(gap.kind), gap.struck));
    }
  }
  verdict.late_s = history.late_s;
  verdict.changes = static_cast<std::size_t>(std::ranges::count_if(history.changes, &ChangeRecord::acknowledged));
  verdict.writes = history.writes.size();
  verdict.readings = history.steps.size();
}

}  // namespace

absl::StatusOr<LastingVerdict> RunLasting(const local::HostNetwork& network, LastingPlan plan) {
  const host::TemporaryFolder folder;
  const auto stage = LastingStage::Start(network, folder.path(), plan.setup);
  if (!stage.ok()) return stage.status();
  const auto instance = MakeWorld(**stage, plan);
  if (!instance.ok()) return instance.status();
  const auto witnesses = LastingWitnesses::Begin(**stage, *instance, plan.players);
  if (!witnesses.ok()) return witnesses.status();
  LastingDrama drama(**stage, **witnesses, plan, *instance, folder.path());
  if (const std::string why = drama.WaitUntilWell(kLastingHosts, plan.players); !why.empty()) {
    return absl::UnavailableError("the world never was well: " + why);
  }
  LastingVerdict verdict;
  for (LastingFault& fault : plan.faults) {
    const auto gap = drama.Play(fault);
    if (!gap.ok()) return gap.status();
    verdict.gaps.push_back(*gap);
    plan.tell(Worded(*gap));
    const std::string why = drama.WaitUntilWell();
    verdict.gaps.back().well = (*witnesses)->Now();
    if (!why.empty()) {
      verdict.not_well.push_back(fmt::format("after {}: {}", NameOf(fault.kind), why));
      break;  // the next changes would be this one's
    }
  }
  const History history = (*witnesses)->End();
  verdict.players_dropped = (*witnesses)->PlayersDropped();
  const auto hosts = (*witnesses)->KnownHosts();
  if (!hosts.ok()) return hosts.status();
  Judge(history, *hosts, drama.setbacks(), verdict);
  return verdict;
}

}  // namespace tessera::bench
