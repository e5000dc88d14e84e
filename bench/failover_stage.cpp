#include "bench/failover_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <numeric>
#include <utility>

#include "bench/player_seat.h"
#include "bench/scrape.h"
#include "bench/statistics.h"
#include "bench/world_at_rest.h"
#include "local_cluster/command_error.h"
#include "telemetry/http_get.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kStagePatience{120};
constexpr std::uint64_t kCensusesAfter = 2;
constexpr std::chrono::seconds kPlacesApart{1};
constexpr const char *kTicksMade = "tessera_region_ticks_total", *kTicksLate = "tessera_region_late_ticks_total";

std::vector<double> SamplesOf(const std::vector<Worker>& workers, const std::string& name) {
  std::vector<double> values;
  for (const Worker& worker : workers) {
    const auto page = telemetry::HttpGet(worker.metrics, "/metrics");
    if (!page.ok()) continue;  // it is dead
    const Samples samples = ParseMetrics(page->body);
    if (const auto found = samples.find(name); found != samples.end()) values.push_back(found->second);
  }
  return values;
}

}  // namespace

local::RunOptions StageOptions(const FailoverSize& size) {
  return {.scene = local::FindScene("plaza"),
          .regions = 4,
          .bodies = size.bodies,
          .bots = size.bots,
          .hosts = 2,
          .capacity = 8};
}

namespace {

local::RunOptions WithoutBots(local::RunOptions options) {
  options.bots = 0;
  options.players_elsewhere = true;
  return options;
}

}  // namespace

FailoverStage::FailoverStage(const local::RunOptions& options, Players players)
    : run_(players == Players::kBots ? options : WithoutBots(options)), regions_(options.regions) {
  if (players == Players::kProcesses) SeatPlayers(options.bots);
}

void FailoverStage::SeatPlayers(std::uint32_t count) {
  auto players = PlayerProcesses::Start(SeatCommands(run_.cluster().control_address(), run_.instance_id(), count));
  if (!players.ok()) throw local::CommandError(std::string(players.status().message()));
  players_ = *std::move(players);
  if (const absl::Status in = PlayUntil("all players are in", [&] { return players_->AllIn(); }); !in.ok()) {
    throw local::CommandError(std::string(in.message()));
  }
  std::vector<BodyId> bodies;
  bodies.reserve(count);
  Tick tick;
  for (const PlayerView* player : players_->views()) {
    bodies.push_back(*player->body());
    tick = std::max(tick, player->tick());
  }
  run_.ExpectPlayers(bodies, tick);
}

absl::Status FailoverStage::PlayUntil(const std::string& what, const std::function<bool()>& holds) {
  absl::Status players;
  const auto look = [&] {
    if (players_ != nullptr) players = players_->TakeIn(Clock::now());
    NotePlaces();
    return !players.ok() || holds();
  };
  const bool in_time = run_.PlayUntil(look, kStagePatience);
  if (in_time && players.ok()) return absl::OkStatus();
  std::string ended = players.ok() ? "" : fmt::format("{}; ", std::string(players.message()));
  for (local::Bot* bot : run_.bots()) {
    if (bot->client().state() != client::ClientState::kEnded) continue;
    ended += fmt::format("{} ended: {}; ", bot->name(), bot->client().reason().ToString());
  }
  return absl::InternalError(fmt::format("{}never: {}; {}", ended, what, run_.Latest().ShortDebugString()));
}

absl::Status FailoverStage::PlayFor(double seconds) {
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  return PlayUntil("time passed", [end] { return Clock::now() > end; });
}

absl::Status FailoverStage::PlayUntilWell() {
  SteadyFor steady(kFollowed);
  return PlayUntil("every region is protected", [&] {
    const v1::Instance instance = run_.Latest();
    return steady.Take(IsAtRest(instance, regions_) && IsSpreadEvenly(instance), Clock::now());
  });
}

absl::Status FailoverStage::PlayOn() {
  const auto counted = [&] { return run_.conservation() ? run_.conservation()->censuses : 0; };
  const std::uint64_t before = counted();
  return PlayUntil("further censuses", [&] { return counted() >= before + kCensusesAfter; });
}

absl::StatusOr<StagePace> FailoverStage::MeasurePace(double seconds) {
  if (players_ == nullptr) return absl::InvalidArgumentError("bots have no frames of their own");
  const std::vector<Worker> workers = Workers();
  const FrameCount frames = players_->frames();
  const double ticks = SumOf(workers, kTicksMade), late = SumOf(workers, kTicksLate);
  if (absl::Status status = PlayFor(seconds); !status.ok()) return status;
  const FrameCount after = players_->frames();
  return StagePace{.frames = static_cast<double>(after.due - frames.due),
                   .late_frames = static_cast<double>(after.late - frames.late),
                   .ticks = SumOf(workers, kTicksMade) - ticks,
                   .late_ticks = SumOf(workers, kTicksLate) - late};
}

void FailoverStage::NoteSeen(BodyId body, const SeenPlace& place) {
  const auto [at, first] = seen_.try_emplace(body, place);
  if (!first && place.tick >= at->second.tick) at->second = place;
}

void FailoverStage::NotePlaces() {
  if (Clock::now() < look_at_places_) return;
  look_at_places_ = Clock::now() + kPlacesApart;
  for (local::Bot* bot : run_.bots()) {
    for (const auto& [id, body] : bot->client().World()) {
      const Vec3d at = body.state.position;
      NoteSeen(id, {body.tick, body.region, at.x, at.y, at.z, Length(body.state.linear_velocity)});
    }
  }
  if (players_ == nullptr) return;
  for (const PlayerView* player : players_->views()) {
    for (const auto& [id, place] : player->sees()) NoteSeen(id, place);
  }
}

std::set<BodyId> FailoverStage::SeenNow() {
  std::set<BodyId> seen;
  for (local::Bot* bot : run_.bots()) {
    for (const auto& [id, body] : bot->client().World()) seen.insert(id);
  }
  if (players_ == nullptr) return seen;
  for (const PlayerView* player : players_->views()) {
    for (const auto& [id, place] : player->sees()) seen.insert(id);
  }
  return seen;
}

// Bodies that nobody sees any more: where they were last.
void FailoverStage::TellMissing() {
  const std::set<BodyId> now = SeenNow();
  for (const auto& [id, place] : seen_) {
    if (now.contains(id)) continue;
    std::cerr << fmt::format(
        "failover: body {} was last seen in tick {} of region {} at {:.1f} {:.1f} {:.1f}, {:.1f} m/s\n", id.value(),
        place.tick.value(), place.region.value(), place.x, place.y, place.z, place.speed);
  }
}

void FailoverStage::TakeCensus(FailoverOutcome& outcome) {
  const auto add_new = [](double now, double& before, double& sum) {
    sum += std::max(now - before, 0.0);
    before = now;
  };
  if (const auto found = run_.conservation()) {
    if (static_cast<double>(found->lost) > lost_) TellMissing();
    add_new(static_cast<double>(found->taken_out), taken_out_, outcome.taken_out);
    add_new(static_cast<double>(found->lost), lost_, outcome.lost);
    add_new(static_cast<double>(found->duplicated), duplicated_, outcome.duplicated);
  }
  const std::vector<local::Bot*> bots = run_.bots();
  const Rect ground = run_.scene().ground();
  outcome.beyond = static_cast<double>(std::ranges::count_if(seen_, [&](const auto& entry) {
    const SeenPlace& at = entry.second;
    return at.x < ground.min_x || at.x > ground.max_x || at.z < ground.min_z || at.z > ground.max_z;
  }));
  const auto dropped = std::ranges::count_if(
      bots, [](local::Bot* bot) { return bot->client().state() != client::ClientState::kPlaying; });
  const std::size_t processes = players_ == nullptr ? 0 : players_->ended();
  add_new(static_cast<double>(dropped) + static_cast<double>(processes), dropped_, outcome.clients_dropped);
}

std::vector<Worker> FailoverStage::Workers() {
  const v1::Instance instance = run_.Latest();
  std::vector<Worker> workers;
  workers.reserve(static_cast<std::size_t>(instance.region_status_size()));
  for (const v1::RegionStatus& status : instance.region_status()) {
    const v1::WorkerReport& report = status.report();
    workers.push_back({RegionId(status.region()), static_cast<pid_t>(report.identity().pid()),
                       fmt::format("{}:{}", report.address().host(), report.address().metrics_port()), status.host()});
  }
  return workers;
}

std::vector<Worker> FailoverStage::WorkersOn(std::size_t host) {
  std::vector<Worker> workers = Workers();
  std::erase_if(workers, [&](const Worker& worker) { return worker.host != fmt::format("local-{}", host + 1); });
  return workers;
}

double SumOf(const std::vector<Worker>& workers, const std::string& sample) {
  double sum = 0;
  for (const double value : SamplesOf(workers, sample)) sum += value;
  return sum;
}

double HighestOf(const std::vector<Worker>& workers, const std::string& sample) {
  double highest = 0;
  for (const double value : SamplesOf(workers, sample)) highest = std::max(highest, value);
  return highest;
}

void FailoverOutcome::TellKept(const std::string& scene, const std::string& config, Report& report) const {
  report.Set(scene, kFailoverEngine, config, "bodies_lost", lost, "1");
  report.Set(scene, kFailoverEngine, config, "bodies_duplicated", duplicated, "1");
  report.Set(scene, kFailoverEngine, config, "clients_dropped", clients_dropped, "1");
  report.Set(scene, kFailoverEngine, config, "bodies_taken_out", taken_out, "1");
  report.Set(scene, kFailoverEngine, config, "bodies_beyond_bounds", beyond, "1");
}

// The effect of a fault is reported beside that of time alone: the same difference between two spans in which
// nothing happened.
void FailoverOutcome::TellLateTicks(const std::string& config, Report& report) const {
  const auto add = [&](const std::string& metric, double value) {
    report.Set("plaza", kFailoverEngine, config, metric, value, "1");
  };
  const auto add_all = [&](const std::string& metric, std::vector<double> differences) {
    add(metric, std::max(std::accumulate(differences.begin(), differences.end(), 0.0), 0.0));
    add(metric + "_p50", Median(differences));
    add(metric + "_min", std::ranges::min(differences));
    add(metric + "_max", std::ranges::max(differences));
  };
  double before = 0;
  std::vector<double> added, added_by_nothing;
  added.reserve(late_ticks.size());
  added_by_nothing.reserve(late_ticks.size());
  for (const LateTicks& late : late_ticks) {
    before += late.second;
    added.push_back(late.fault - late.second);
    added_by_nothing.push_back(late.second - late.first);
  }
  add("late_ticks_before", before);
  add_all("late_ticks_added", added);
  add_all("late_ticks_added_by_nothing", added_by_nothing);
}

void FailoverOutcome::AddTo(const std::string& fault, const FailoverSize& size, Report& report) const {
  const std::string config = "fault=" + fault;
  const auto add = [&](const char* metric, double value, const char* unit) {
    report.Set("plaza", kFailoverEngine, config, metric, value, unit);
  };
  add("bodies", size.bodies, "1");
  add("players", size.bots, "1");
  add("runs", runs, "1");
  add("runs_failed", runs_failed, "1");
  add("runs_stage_too_slow", runs_too_slow, "1");
  add("late_frames_before_max", late_frames, "1");
  add("late_ticks_before_max", late_ticks_before_strike, "1");
  TellKept("plaza", config, report);
  if (fault == "agent") add("workers_lost", workers_lost, "1");
  if (!late_ticks.empty()) TellLateTicks(config, report);
  if (gaps_ms.empty()) return;
  add("gap_ms_p50", Median(gaps_ms), "ms");
  add("gap_ms_max", std::ranges::max(gaps_ms), "ms");
  add("gap_worst_player_ms_max", std::ranges::max(worst_gaps_ms), "ms");
  add("gap_without_a_step_ms_p50", Median(server_gaps_ms), "ms");
  add("gap_without_a_step_ms_max", std::ranges::max(server_gaps_ms), "ms");
  add("state_age_ticks_max", age_ticks, "1");
}

}  // namespace tessera::bench
