#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bench/lasting_restore.h"
#include "bench/statistics.h"
#include "host/child_process.h"
#include "host/last_lines.h"
#include "host/temporary_folder.h"
#include "local_cluster/bot.h"
#include "local_cluster/command_error.h"
#include "local_cluster/connection.h"
#include "local_cluster/instance_state.h"
#include "local_cluster/local_cluster.h"
#include "local_cluster/scene_file.h"

namespace tessera::bench {
namespace {

using TakeoverClock = std::chrono::steady_clock;

constexpr const char *kTakeoverEngine = "tessera", *kTakeoverScene = "plaza";
constexpr std::chrono::seconds kTakeoverPatience{120}, kTakeoverRunsPatience{30};
constexpr double kTakeoverPlayed_s = 2;  // between two things that are done to the worlds

void RunToItsEnd(std::vector<std::string> argv, const std::string& log) {
  const std::string program = argv[0];
  host::ChildProcess process = local::OrThrow(host::ChildProcess::Start({.argv = std::move(argv), .log_path = log}));
  const auto ended = process.Wait(kTakeoverPatience);
  if (!ended || !ended->Clean()) throw local::CommandError(program + ": " + host::LastLinesText(log, 5));
}

// Three worlds on two hosts, with a player in each who plays on whatever becomes of the control plane.
class TakeoverStage {
 public:
  static constexpr std::uint32_t kWorlds = 3;

  explicit TakeoverStage(std::uint32_t bodies)
      : cluster_({.state_dir = folder_.path(), .hosts = 2, .capacity = 8}), connection_(cluster_.control_address()) {
    for (std::uint32_t i = 0; i < kWorlds; ++i) {
      v1::CreateInstanceRequest request;
      *request.mutable_spec()->mutable_scene() = local::LoadScene(local::FindScene(kTakeoverScene), bodies).message;
      request.mutable_spec()->set_regions(2);
      World& world = worlds_.emplace_back();
      world.id = connection_
                     .Call("instance create", connection_.instances(), &v1::InstanceService::Stub::CreateInstance,
                           request, std::chrono::milliseconds(kTakeoverPatience))
                     .instance()
                     .id();
      local::WaitUntilSettled(connection_, world.id, kTakeoverPatience);
      Join(world);
    }
  }

  void Play(double seconds) {
    const TakeoverClock::time_point until =
        TakeoverClock::now() + std::chrono::milliseconds(static_cast<int>(1000 * seconds));
    while (TakeoverClock::now() < until) Frame();
  }
  void Backup(const std::string& file) const {
    RunToItsEnd({local::ProgramPath("tessera"), "--control", cluster_.control_address(), "cluster", "backup", file},
                folder_.path() + "/backup.log");
  }
  // Things of which the backup does not know: a further player in each world, and a further region of the first.
  void GoOn() {
    for (World& world : worlds_) Join(world);
    v1::ScaleInstanceRequest request;
    request.set_id(worlds_.front().id);
    request.set_regions(3);
    connection_.Call("instance scale", connection_.instances(), &v1::InstanceService::Stub::ScaleInstance, request);
    if (!PlayUntil(kTakeoverPatience, [&] { return Get(worlds_.front()).map().regions_size() == 3; })) {
      throw local::CommandError(worlds_.front().id + " never had a third region");
    }
    Play(kTakeoverPlayed_s);
    for (World& world : worlds_) world.tick = TickOf(Get(world));
  }
  // Seconds from the loss until somebody could join each of the worlds.
  double LoseControlAndRestore(const std::string& backup) {
    const TakeoverClock::time_point lost = TakeoverClock::now();
    cluster_.KillControl();
    const std::string state = folder_.path() + "/control";
    std::filesystem::remove_all(state);
    std::filesystem::create_directory(state);
    RunToItsEnd({local::ProgramPath("tessera-control"), "--state-dir", state, "--restore", backup},
                folder_.path() + "/restore.log");
    cluster_.RestartControl();
    connection_ = local::Connection(cluster_.control_address());
    for (World& world : worlds_) {
      if (!PlayUntil(kTakeoverPatience, [&] { return TryJoin(world); })) {
        throw local::CommandError("nobody can join " + world.id);
      }
    }
    return std::chrono::duration<double>(TakeoverClock::now() - lost).count();
  }
  struct Harm {
    int ended = 0, set_back = 0, twice = 0, dropped = 0;
    int all() const { return ended + set_back + twice; }
  };
  Harm Count() {
    Play(kTakeoverPlayed_s);
    // A world of a backup is called RUNNING once its regions are known to step; one that never is counts as ended.
    (void)PlayUntil(kTakeoverRunsPatience, [&] {
      return std::ranges::all_of(worlds_,
                                 [&](const World& world) { return Get(world).state() == v1::INSTANCE_STATE_RUNNING; });
    });
    Harm harm;
    for (World& world : worlds_) {
      const v1::Instance instance = Get(world);
      harm.ended += instance.state() == v1::INSTANCE_STATE_RUNNING ? 0 : 1;
      harm.set_back += TickOf(instance) >= world.tick ? 0 : 1;
      std::set<std::uint32_t> numbers;
      for (const auto& bot : world.bots) {
        harm.twice += numbers.insert(bot->client().player().value()).second ? 0 : 1;
        harm.dropped += bot->client().state() == client::ClientState::kEnded ? 1 : 0;
      }
    }
    return harm;
  }

 private:
  struct World {
    std::string id;
    std::vector<std::unique_ptr<local::Bot>> bots;
    std::uint64_t tick = 0;  // that it had reached before the loss
  };

  void Frame() {
    for (World& world : worlds_) {
      for (const auto& bot : world.bots) bot->Frame(TakeoverClock::now());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  // False: time is up.
  bool PlayUntil(std::chrono::seconds patience, const std::function<bool()>& holds) {
    const TakeoverClock::time_point until = TakeoverClock::now() + patience;
    while (!holds()) {
      if (TakeoverClock::now() >= until) return false;
      Frame();
    }
    return true;
  }
  bool TryJoin(World& world) {
    auto bot = local::Bot::Join(cluster_.control_address(), world.id, fmt::format("bot-{}", world.bots.size()),
                                world.bots.size() + 1);
    const bool joined = bot.ok();
    if (joined) world.bots.push_back(*std::move(bot));
    return joined;
  }
  void Join(World& world) {
    if (!TryJoin(world)) throw local::CommandError("nobody can join " + world.id);
  }
  v1::Instance Get(const World& world) {
    v1::GetInstanceRequest request;
    request.set_id(world.id);
    return connection_.Call("instance get", connection_.instances(), &v1::InstanceService::Stub::GetInstance, request)
        .instance();
  }
  static std::uint64_t TickOf(const v1::Instance& instance) {
    std::uint64_t tick = 0;
    for (const v1::RegionStatus& region : instance.region_status()) tick = std::max(tick, region.report().tick());
    return tick;
  }

  const host::TemporaryFolder folder_;
  local::LocalCluster cluster_;
  local::Connection connection_;
  std::vector<World> worlds_;
};

}  // namespace

absl::Status RunTakeover(const RestoreSize& size, Report& report) {
  std::vector<double> takeover_s;
  TakeoverStage::Harm harm;
  for (unsigned run = 0; run < size.runs; ++run) {
    try {
      const host::TemporaryFolder folder;
      const std::string backup = folder.path() + "/cluster.tessera";
      TakeoverStage stage(size.bodies);
      stage.Play(kTakeoverPlayed_s);
      stage.Backup(backup);
      stage.GoOn();
      takeover_s.push_back(stage.LoseControlAndRestore(backup));
      const TakeoverStage::Harm here = stage.Count();
      harm.ended += here.ended;
      harm.set_back += here.set_back;
      harm.twice += here.twice;
      harm.dropped += here.dropped;
      std::cerr << fmt::format("lasting: takeover {}: {:.1f} s, {} worlds harmed, {} players dropped\n", run + 1,
                               takeover_s.back(), here.all(), here.dropped);
    } catch (const std::exception& error) {
      return absl::InternalError(error.what());
    }
  }
  const auto add = [&](const std::string& metric, double value, const char* unit) {
    report.Set(kTakeoverScene, kTakeoverEngine, "takeover", metric, value, unit);
  };
  add("runs", size.runs, "1");
  add("worlds", TakeoverStage::kWorlds, "1");
  add("backup_harmed", harm.all(), "1");
  add("backup_ended", harm.ended, "1");
  add("backup_set_back", harm.set_back, "1");
  add("backup_numbers_twice", harm.twice, "1");
  add("takeover_dropped", harm.dropped, "1");
  add("takeover_s_p50", Median(takeover_s), "s");
  add("takeover_s", Quantile(takeover_s, 1), "s");
  return report.Save();
}

}  // namespace tessera::bench
