// A host that is evicted while people play: who is dropped, what is lost, when its regions run elsewhere, and when
// nothing that it knew opens anything any more.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <exception>
#include <functional>
#include <iostream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bench/failover_stage.h"
#include "bench/statistics.h"
#include "bench/trust_scenes.h"
#include "host/files.h"
#include "local_cluster/connection.h"
#include "tests/support/knocks.h"
#include "tests/support/region_keys.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

// A region that is there answers within milliseconds.
constexpr std::chrono::milliseconds kTryPatience{1000};
// So many rounds of tries in a row must open nothing.
constexpr int kShutRounds = 2;
constexpr std::size_t kMaxIdentityBytes = 1 << 16;

// All that a host knew, as its root has it, and goes on to use.
struct KeptByHost {
  std::string control, host, identity, scene_hash;
  std::vector<support::RegionKeys> keys;  // those of each of its workers
};

support::Regions RegionsElsewhere(const v1::Instance& world, const std::string& host) {
  support::Regions regions;
  for (const v1::RegionStatus& status : world.region_status()) {
    if (status.host() != host && status.report().has_address()) *regions.Add() = status;
  }
  return regions;
}

absl::StatusOr<KeptByHost> Keep(FailoverStage& stage, const std::string& host) {
  const local::LocalCluster& cluster = stage.run().cluster();
  const v1::Instance world = stage.run().Latest();
  auto identity = host::ReadFile(fmt::format("{}/{}/host.json", cluster.state_dir(), host), kMaxIdentityBytes);
  if (!identity.ok()) return identity.status();
  KeptByHost kept{.control = cluster.control_address(),
                  .host = host,
                  .identity = *std::move(identity),
                  .scene_hash = world.scene_hash(),
                  .keys = {}};
  const net::VerificationKey instance_key = support::InstanceKeyOf(kept.control, world.id());
  for (const v1::RegionStatus& status : world.region_status()) {
    if (status.host() != host) continue;
    auto keys = support::TakeRegionKeys(status.report(), instance_key);
    if (!keys.ok()) return keys.status();
    kept.keys.push_back(*std::move(keys));
  }
  return kept;
}

// How many of all tries get in: its secret at the control plane, and a link in the name of each of its workers to each
// region elsewhere that takes links of it.
std::ptrdiff_t CountOpened(const KeptByHost& kept, const std::vector<support::Knock>& knocks) {
  const bool fetched = support::FetchSceneByIdentity(kept.control, kept.identity, kept.scene_hash).ok();
  const std::vector<support::Knocked> answers = support::KnockAll(knocks, kTryPatience);
  return (fetched ? 1 : 0) + std::ranges::count(answers, support::Knocked::Answer::kOpened, &support::Knocked::answer);
}

// Tries all of it, again and again, until nothing opens; on a thread of its own, for players play meanwhile.
class ShutWatch {
 public:
  ShutWatch(const KeptByHost& kept, std::function<v1::Instance()> latest)
      : kept_(kept), latest_(std::move(latest)), begin_(Clock::now()), thread_([this] { Watch(); }) {}
  ~ShutWatch() {
    over_ = true;
    thread_.join();
  }
  ShutWatch(const ShutWatch&) = delete;
  ShutWatch& operator=(const ShutWatch&) = delete;

  // The rest is there once it is.
  bool is_over() const { return over_; }
  const std::string& failure() const { return failure_; }
  double shut_s() const { return shut_s_; }          // from the beginning to the end of the first round without any
  std::ptrdiff_t opened() const { return opened_; }  // in all rounds before

 private:
  void Watch() {
    try {
      for (int shut = 0; shut < kShutRounds && !over_;) {
        const support::Regions elsewhere = RegionsElsewhere(latest_(), kept_.host);
        const std::ptrdiff_t opened = CountOpened(kept_, support::LinkKnocks(kept_.keys, elsewhere));
        opened_ += opened;
        shut = opened == 0 ? shut + 1 : 0;
        if (shut == 1) shut_s_ = std::chrono::duration<double>(Clock::now() - begin_).count();
      }
    } catch (const std::exception& error) {
      failure_ = error.what();
    }
    over_ = true;
  }

  const KeptByHost& kept_;
  const std::function<v1::Instance()> latest_;
  const Clock::time_point begin_;
  double shut_s_ = 0;
  std::ptrdiff_t opened_ = 0;
  std::string failure_;
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

struct Evictions {
  FailoverOutcome outcome;
  std::vector<double> carried_on_s, shut_s;
};

absl::Status EvictOne(const TrustSize& size, bool agent_stands, Evictions& evictions) {
  const FailoverSize world{
      .runs = 1, .bodies = size.bodies, .bots = 4, .control_away_s = 0, .scale_rounds = 0, .restored_bodies = 0};
  local::RunOptions options = StageOptions(world);
  options.regions = size.regions;
  options.capacity = size.regions;
  FailoverStage stage(options);
  if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
  // The host of the lowest region, for links are dialled by the lower id.
  const v1::Instance before = stage.run().Latest();
  const std::string host = before.region_status(0).host();
  const std::size_t index = host == "local-1" ? 0 : 1;
  const std::size_t victims = stage.WorkersOn(index).size();
  const auto kept = Keep(stage, host);
  if (!kept.ok()) return kept.status();
  // All of it is good as long as it is a host: here one link, which its own worker then takes back.
  std::vector<support::Knock> one = support::LinkKnocks({kept->keys.front()}, RegionsElsewhere(before, host));
  one.resize(std::min<std::size_t>(one.size(), 1));
  if (CountOpened(*kept, one) != 2) return absl::InternalError("evict: what a host knows opens nothing before either");
  if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;

  host::ChildProcess& agent = stage.run().cluster().agent(index);
  if (agent_stands) agent.Signal(SIGSTOP);
  v1::RemoveHostRequest request;
  request.set_name(host);
  request.set_force(true);
  const auto begin = Clock::now();
  stage.run().connection().Call("host remove", stage.run().connection().hosts(), &v1::HostService::Stub::RemoveHost,
                                request);
  ShutWatch watch(*kept, [&stage] { return stage.run().Latest(); });
  absl::Status carried_on = stage.PlayUntil("carried on without the evicted host", [&] {
    const v1::Instance latest = stage.run().Latest();
    return latest.state() == v1::INSTANCE_STATE_RUNNING && latest.failovers() > 0 && stage.WorkersOn(index).empty();
  });
  evictions.carried_on_s.push_back(std::chrono::duration<double>(Clock::now() - begin).count());
  if (carried_on.ok()) carried_on = stage.PlayUntil("nothing that it knew opens", [&] { return watch.is_over(); });
  if (agent_stands) agent.Signal(SIGCONT);
  if (!carried_on.ok()) return carried_on;
  if (!watch.failure().empty()) return absl::InternalError(watch.failure());
  evictions.shut_s.push_back(watch.shut_s());
  evictions.outcome.runs += 1;
  if (absl::Status status = stage.PlayOn(); !status.ok()) return status;
  stage.TakeCensus(evictions.outcome);
  std::cerr << fmt::format(
      "trust: evict: {} of {} regions, on elsewhere after {:.2f} s, shut after {:.2f} s ({} opened)\n", victims,
      size.regions, evictions.carried_on_s.back(), watch.shut_s(), watch.opened());
  return absl::OkStatus();
}

}  // namespace

absl::Status RunEvictions(const TrustSize& size, Report& report) {
  for (const bool agent_stands : {false, true}) {
    Evictions evictions;
    for (std::uint32_t i = 0; i < size.evictions; ++i) {
      if (absl::Status status = EvictOne(size, agent_stands, evictions); !status.ok()) return status;
    }
    const std::string config = fmt::format("regions={}{}", size.regions, agent_stands ? " agent=stands" : "");
    const FailoverOutcome& outcome = evictions.outcome;
    report.Add("evict", kTrustEngine, config, "evictions", outcome.runs, "1");
    report.Add("evict", kTrustEngine, config, "evict_dropped", outcome.clients_dropped, "1");
    report.Add("evict", kTrustEngine, config, "evict_lost", outcome.lost, "1");
    report.Add("evict", kTrustEngine, config, "evict_duplicated", outcome.duplicated, "1");
    report.Add("evict", kTrustEngine, config, "evict_carried_on_s", Quantile(evictions.carried_on_s, 1), "s");
    report.Add("evict", kTrustEngine, config, "evict_seconds", Quantile(evictions.shut_s, 1), "s");
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
