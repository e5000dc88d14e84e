// WorldRun: a world on a cluster of this machine with bots in it, from creation to its orderly end. What the demo shows
// and the benchmarks measure.
//
//   WorldRun run({.scene = FindScene("plaza"), .regions = 4, .bots = 2});
//   while (...) run.Frame();           // about 60 times a second
//   RunSummary summary = run.Finish();
//
// CommandError where something cannot be started. Destruction leaves nothing running.
// Thread rule: one thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/temporary_folder.h"
#include "local_cluster/bot.h"
#include "local_cluster/conservation.h"
#include "local_cluster/instance_watch.h"
#include "local_cluster/local_cluster.h"
#include "local_cluster/scene_file.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::local {

class Connection;

struct RunOptions {
  std::string scene;      // path
  std::string game = {};  // likewise, or native:NAME; empty: it runs none
  std::uint32_t regions = 4;
  std::optional<std::uint32_t> bodies = std::nullopt;  // scattered ones, instead of the scene's own number
  std::uint32_t bots = 2;
  bool players_elsewhere = false;  // others will play: no census counts before ExpectPlayers
  bool bots_come_back = false;     // one that was thrown out joins again; otherwise the run is over
  std::uint32_t hosts = 1;
  std::uint32_t capacity = 0;                       // regions a host; 0: all of them
  bool workers_outlive_agents = false;              // as in LocalClusterOptions
  const HostNetwork* network = nullptr;             // likewise
  std::string page_listen = {};                     // likewise
  std::string game_modules = {};                    // likewise
  std::vector<std::string> control_arguments = {};  // likewise
  std::string control_programs = {};                // likewise
  std::string agent_programs = {};                  // likewise
  std::string release_programs = {};                // likewise
  // Called when the cluster stands, before there is a world in it.
  std::function<void(const LocalCluster&)> on_cluster = {};
  // Further settings of the instance.
  std::function<void(v1::InstanceSpec&)> adjust = {};
};

// One region over the whole run.
struct RegionSummary {
  std::uint32_t region = 0;
  double tick_rate_hz = 0;      // ticks over the time from the first report that ran to the last
  double worst_step_p99_s = 0;  // the worst window of any report
  v1::WorkerReport last;
};

struct RunSummary {
  double ready_s = 0;                 // from CreateInstance until all workers were linked
  double running_s = 0;               // how long the world ran
  std::uint64_t bodies_at_start = 0;  // dynamic ones of the scene, and a body for each bot
  std::optional<ConservationResult> conservation;
  std::uint64_t nonfinite = 0;
  std::uint64_t comebacks = 0;  // returns of bots that were thrown out
  std::vector<RegionSummary> regions;
  std::string ended_as;                      // state of the instance after it was deleted
  std::vector<std::int64_t> processes_left;  // workers that still run; always empty unless something is badly wrong
  std::string failure;                       // why the run is no proof: empty when every body is accounted for
};

class WorldRun {
 public:
  explicit WorldRun(const RunOptions& options);
  ~WorldRun();

  // One frame of every bot. False when the instance or a bot has ended unasked; bots that come back end it only when
  // they have been refused for 10 s.
  bool Frame();
  // Frames at a game's pace until it holds, which is asked after each frame and each update of the instance. False when
  // the instance or a bot has ended, or time is up.
  bool PlayUntil(const std::function<bool()>& holds, std::chrono::milliseconds patience);
  // Ends the instance in order and the cluster with it.
  RunSummary Finish();

  // In a line, what ended after Frame was false.
  std::string WhyOver();

  v1::Instance Latest() { return watch_->Latest(); }
  std::vector<Bot*> bots();
  const std::string& instance_id() const { return instance_id_; }
  Connection& connection() { return *connection_; }
  // Covers all complete censuses until now.
  std::optional<ConservationResult> conservation();
  // With `players_elsewhere`: once, all of them. They have these bodies, and were there at `tick`.
  void ExpectPlayers(std::span<const BodyId> bodies, Tick tick);
  const Scene& scene() const { return *scene_.scene; }
  // The control plane was away: watches it anew.
  void WatchAnew();
  double ready_s() const { return ready_s_; }
  double running_s() const;
  LocalCluster& cluster() { return *cluster_; }

 private:
  struct RegionProgress {
    std::chrono::steady_clock::time_point first_time, last_time;
    std::uint64_t first_tick = 0, last_tick = 0;
    double worst_step_p99_s = 0;
    v1::WorkerReport last;
  };
  struct Refusals {
    std::chrono::steady_clock::time_point next_try;
    int count = 0;
  };
  void CreateInstance(const RunOptions& options);
  void JoinBots(std::uint32_t count);
  bool BringBack(Bot& bot);
  void ExpectBotBodies();
  void Observe(const v1::Instance& instance);
  std::string FailureOf(const RunSummary& summary) const;

  LoadedScene scene_;
  host::TemporaryFolder folder_;
  std::unique_ptr<LocalCluster> cluster_;
  std::unique_ptr<Connection> connection_;
  std::string instance_id_;
  double ready_s_ = 0;
  std::chrono::steady_clock::time_point started_;
  std::vector<std::unique_ptr<Bot>> bots_;
  bool bots_come_back_ = false, players_elsewhere_ = false;
  std::map<const Bot*, Refusals> refusals_;  // only bots that are out now
  std::uint64_t comebacks_ = 0;

  std::mutex mutex_;  // guards what follows: written by the watch's thread
  std::unique_ptr<Conservation> conservation_;
  bool bots_expected_ = false;  // the bodies of all players
  bool ending_ = false;         // reports from now on do not count for the tick rate
  std::map<std::uint32_t, RegionProgress> progress_;
  std::unique_ptr<InstanceWatch> watch_;  // last: its thread ends first
};

}  // namespace tessera::local
