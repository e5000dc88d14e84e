#include "local_cluster/world_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "local_cluster/connection.h"
#include "local_cluster/game_file.h"
#include "local_cluster/instance_state.h"
#include "local_cluster/scene_upload.h"
#include "local_cluster/visual_upload.h"

namespace tessera::local {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kStartTimeout{60};
constexpr std::chrono::seconds kEndTimeout{20};
constexpr std::chrono::milliseconds kFrame{4};
constexpr std::chrono::seconds kComeBackInterval{1};
constexpr int kMaxRefusals = 10;

double SecondsSince(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

std::vector<BodyId> DynamicBodies(const Scene& scene) {
  std::vector<BodyId> ids;
  for (const BodyDef& body : scene.bodies) {
    if (body.motion == Motion::kDynamic) ids.push_back(body.id);
  }
  return ids;
}

}  // namespace

WorldRun::WorldRun(const RunOptions& options)
    : scene_(LoadScene(options.scene, options.bodies)),
      bots_come_back_(options.bots_come_back),
      players_elsewhere_(options.players_elsewhere),
      conservation_(std::make_unique<Conservation>(DynamicBodies(*scene_.scene))) {
  cluster_ = std::make_unique<LocalCluster>(
      LocalClusterOptions{.state_dir = folder_.path(),
                          .hosts = options.hosts,
                          .capacity = options.capacity == 0 ? options.regions : options.capacity,
                          .workers_outlive_agents = options.workers_outlive_agents,
                          .network = options.network,
                          .page_listen = options.page_listen,
                          .game_modules = options.game_modules,
                          .control_arguments = options.control_arguments,
                          .control_programs = options.control_programs,
                          .agent_programs = options.agent_programs,
                          .release_programs = options.release_programs});
  if (options.on_cluster) options.on_cluster(*cluster_);
  connection_ = std::make_unique<Connection>(cluster_->control_address());
  CreateInstance(options);
  JoinBots(options.bots);
  if (!watch_->WaitUntil([](const v1::Instance& i) { return i.state() == v1::INSTANCE_STATE_RUNNING; },
                         kStartTimeout)) {
    const v1::Instance latest = watch_->Latest();
    throw CommandError(
        fmt::format("{} did not start: {} {}", instance_id_, InstanceStateName(latest), latest.reason()));
  }
  started_ = Clock::now();
}

WorldRun::~WorldRun() {
  watch_.reset();
  bots_.clear();
}

void WorldRun::CreateInstance(const RunOptions& options) {
  v1::CreateInstanceRequest request;
  *request.mutable_spec()->mutable_scene() = scene_.message;
  if (!options.game.empty()) SetGame(options.game, *request.mutable_spec());
  request.mutable_spec()->set_regions(options.regions);
  request.mutable_spec()->set_expected_players(options.bots);
  if (options.adjust) options.adjust(*request.mutable_spec());
  SendVisuals(*connection_, scene_.message, VisualsBeside(options.scene));
  const auto begin = Clock::now();
  instance_id_ = local::CreateInstance(*connection_, std::move(request)).instance().id();
  watch_ = std::make_unique<InstanceWatch>(*connection_, instance_id_, [this](const v1::Instance& i) { Observe(i); });
  const bool ready = watch_->WaitUntil(
      [](const v1::Instance& i) {
        return i.state() == v1::INSTANCE_STATE_WAITING_FOR_PLAYERS || i.state() == v1::INSTANCE_STATE_RUNNING ||
               i.state() == v1::INSTANCE_STATE_FAILED;
      },
      kStartTimeout);
  ready_s_ = SecondsSince(begin);
  const v1::Instance latest = watch_->Latest();
  if (!ready || latest.state() == v1::INSTANCE_STATE_FAILED) {
    throw CommandError(
        fmt::format("{} could not be started: {} {}", instance_id_, InstanceStateName(latest), latest.reason()));
  }
}

void WorldRun::JoinBots(std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) {
    auto bot = Bot::Join(cluster_->control_address(), instance_id_, fmt::format("bot-{}", i + 1), i + 1);
    if (!bot.ok()) throw CommandError(std::string(bot.status().message()));
    bots_.push_back(*std::move(bot));
  }
  const auto playing = [](const std::unique_ptr<Bot>& bot) {
    return bot->client().state() == client::ClientState::kPlaying;
  };
  if (!PlayUntil([&] { return std::all_of(bots_.begin(), bots_.end(), playing); }, kStartTimeout)) {
    throw CommandError("the bots could not get into " + instance_id_);
  }
}

bool WorldRun::PlayUntil(const std::function<bool()>& holds, std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  while (!holds()) {
    if (!Frame() || Clock::now() > deadline) return false;
    watch_->WaitForChange(kFrame);
  }
  return true;
}

bool WorldRun::Frame() {
  for (const auto& bot : bots_) {
    if (!bot->Frame(Clock::now()) && !BringBack(*bot)) return false;
  }
  if (!bots_expected_ && !players_elsewhere_) ExpectBotBodies();
  const v1::InstanceState state = watch_->Latest().state();
  return state != v1::INSTANCE_STATE_FAILED && state != v1::INSTANCE_STATE_ENDED;
}

// False: it may not, or has been refused too often.
bool WorldRun::BringBack(Bot& bot) {
  if (!bots_come_back_) return false;
  Refusals& refusals = refusals_[&bot];
  if (Clock::now() < refusals.next_try) return true;
  if (bot.ComeBack().ok()) {
    refusals_.erase(&bot);
    ++comebacks_;
    return true;
  }
  refusals.next_try = Clock::now() + kComeBackInterval;
  return ++refusals.count < kMaxRefusals;
}

std::string WorldRun::WhyOver() {
  for (const auto& bot : bots_) {
    if (bot->client().state() == client::ClientState::kEnded) {
      return fmt::format("{} is out: {}", bot->name(), std::string(bot->client().reason().message()));
    }
  }
  const v1::Instance latest = watch_->Latest();
  return latest.reason().empty() ? v1::InstanceState_Name(latest.state()) : latest.reason();
}

// Once every bot sees its own body, those bodies exist; they count from a second later, by which time every report
// knows them.
void WorldRun::ExpectBotBodies() {
  const auto visible = [](const std::unique_ptr<Bot>& bot) {
    return bot->client().World().contains(bot->client().own_body());
  };
  if (!std::all_of(bots_.begin(), bots_.end(), visible)) return;
  const std::lock_guard lock(mutex_);
  for (const auto& bot : bots_) {
    conservation_->Expect(bot->client().own_body(), bot->client().tick().value() + scene_.scene->tick_rate_hz);
  }
  bots_expected_ = true;
}

// As with bots' bodies, from a second later on.
void WorldRun::ExpectPlayers(std::span<const BodyId> bodies, Tick tick) {
  const std::lock_guard lock(mutex_);
  for (const BodyId body : bodies) conservation_->Expect(body, tick.value() + scene_.scene->tick_rate_hz);
  bots_expected_ = true;
}

void WorldRun::Observe(const v1::Instance& instance) {
  const std::lock_guard lock(mutex_);
  if (bots_expected_) conservation_->Observe(instance);
  const auto now = Clock::now();
  for (const v1::RegionStatus& status : instance.region_status()) {
    const v1::WorkerReport& report = status.report();
    if (report.phase() != v1::WORKER_PHASE_RUNNING) continue;
    RegionProgress& progress = progress_[status.region()];
    // From the first regular report on: the one at the start comes at once, later ones wait for their turn.
    if (progress.first_tick == 0 && report.tick() > scene_.scene->tick_rate_hz) {
      progress.first_tick = report.tick();
      progress.first_time = now;
    }
    if (!ending_ && report.tick() > progress.last_tick) {
      progress.last_tick = report.tick();
      progress.last_time = now;
    }
    progress.worst_step_p99_s = std::max(progress.worst_step_p99_s, report.step().p99_seconds());
    progress.last = report;
  }
}

std::optional<ConservationResult> WorldRun::conservation() {
  const std::lock_guard lock(mutex_);
  return conservation_->result();
}

void WorldRun::WatchAnew() {
  watch_ = std::make_unique<InstanceWatch>(*connection_, instance_id_, [this](const v1::Instance& i) { Observe(i); });
}

std::vector<Bot*> WorldRun::bots() {
  std::vector<Bot*> all;
  for (const auto& bot : bots_) all.push_back(bot.get());
  return all;
}

double WorldRun::running_s() const { return SecondsSince(started_); }

RunSummary WorldRun::Finish() {
  RunSummary summary;
  summary.ready_s = ready_s_;
  summary.running_s = running_s();
  summary.comebacks = comebacks_;
  summary.bodies_at_start = DynamicBodies(*scene_.scene).size() + bots_.size();
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  v1::DeleteInstanceRequest request;
  request.set_id(instance_id_);
  connection_->Call("instance delete", connection_->instances(), &v1::InstanceService::Stub::DeleteInstance, request);
  summary.ended_as = InstanceStateName(WaitUntilEnded(*connection_, instance_id_, kEndTimeout));
  watch_.reset();
  bots_.clear();
  cluster_.reset();
  for (const auto& [region, progress] : progress_) {
    const double elapsed = std::chrono::duration<double>(progress.last_time - progress.first_time).count();
    const auto ticks = static_cast<double>(progress.last_tick - progress.first_tick);
    summary.regions.push_back({region, progress.first_tick > 0 && elapsed > 0 ? ticks / elapsed : 0,
                               progress.worst_step_p99_s, progress.last});
    summary.nonfinite += progress.last.nonfinite_bodies();
    const std::int64_t pid = progress.last.identity().pid();
    if (pid > 0 && host::IsAlive(pid)) summary.processes_left.push_back(pid);
  }
  summary.conservation = conservation_->result();
  summary.failure = FailureOf(summary);
  return summary;
}

std::string WorldRun::FailureOf(const RunSummary& summary) const {
  if (!summary.conservation) return "no census was complete; let it run for some seconds";
  if (summary.conservation->lost > 0) return fmt::format("{} bodies were lost", summary.conservation->lost);
  if (summary.conservation->duplicated > 0)
    return fmt::format("{} bodies were doubled", summary.conservation->duplicated);
  if (summary.nonfinite > 0) return fmt::format("{} bodies became non-finite", summary.nonfinite);
  if (!summary.processes_left.empty())
    return fmt::format("{} processes were left running", summary.processes_left.size());
  if (summary.ended_as != "ENDED") return "the instance ended as " + summary.ended_as;
  return "";
}

}  // namespace tessera::local
