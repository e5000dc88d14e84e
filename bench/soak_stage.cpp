#include "bench/soak_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <iostream>
#include <iterator>
#include <random>
#include <utility>

#include "bench/world_at_rest.h"
#include "host/files.h"
#include "host/process.h"
#include "local_cluster/connection.h"
#include "local_cluster/conservation.h"

namespace tessera::bench {
namespace {

constexpr std::uint32_t kSoakRegions = 4, kSoakMoreRegions = 6, kSoakHosts = 2;
constexpr std::uint32_t kSoakCapacity = 8;  // regions a host: one alone could carry all
constexpr double kSoakView_m = 30;          // some 140 bodies in sight
constexpr std::chrono::seconds kSoakPatience{120};
constexpr std::chrono::milliseconds kSoakLook{50};
constexpr std::chrono::seconds kSoakCheckpointing{60};
constexpr std::uint64_t kRollCensuses = 2, kRollPatience = 10;  // censuses: one a second
constexpr std::uint64_t kMostInARow = 5;
constexpr std::size_t kGroupsAWave = 2;
constexpr int kPropertiesATurn = 16, kSparksATurn = 32;

// Its messages make bodies all over the square, above what stands there. One half is removed by the game, the other one
// expires.
constexpr char kSoakGame[] = R"(
function on_message(name, values)
  if name ~= "sparks" then return end
  for i = 0, values.count - 1 do
    local place = vec(-70 + 20 * (i % 8), 8, -70 + 40 * (i // 8 % 4))
    local spark = world.spawn("spark", place, { velocity = vec(0, 3, 0), expire_after = 900 })
    if i % 2 == 0 then spark:after(600, "end") end
  end
  world.sparks = world.sparks + values.count
end
kinds.spark = {
  on_timer = function(self, name) self:remove() end,
}
)";

void AdjustSoak(v1::InstanceSpec& spec) {
  v1::Scene& scene = *spec.mutable_scene();
  scene.mutable_view()->set_radius(kSoakView_m);
  v1::Property& sparks = *scene.add_instance_properties();
  sparks.set_name("sparks");
  sparks.set_number(0);
  v1::Prefab& prefab = *scene.add_prefabs();
  prefab.set_name("spark");
  v1::Body& body = *prefab.add_bodies();
  body.set_name("spark");
  body.set_kind("spark");
  body.set_mass(1);
  body.set_material("smooth");
  body.mutable_shape()->mutable_sphere()->set_radius(0.3);
}

// The number that the world's property `sparks` has.
std::int64_t SparksOf(const v1::Instance& instance) {
  for (const v1::Property& property : instance.world_properties()) {
    if (property.name() == "sparks") return property.number();
  }
  return 0;
}

bool IsOver(const v1::Instance& instance) {
  return instance.state() == v1::INSTANCE_STATE_FAILED || instance.state() == v1::INSTANCE_STATE_ENDED;
}

std::uint64_t NewestTick(const v1::Instance& instance) {
  std::uint64_t newest = 0;
  for (const v1::RegionStatus& status : instance.region_status()) newest = std::max(newest, status.report().tick());
  return newest;
}

}  // namespace

SoakStage::SoakStage(const SoakSize& size, cli::StopSignal& stop) : size_(size), stop_(stop), regions_(kSoakRegions) {
  const std::string game = folder_.path() + "/soak.lua", scene = local::FindScene("plaza");
  local::OrThrow(host::WriteFile(game, kSoakGame, host::Durability::kSurvivesProcess));
  const LoadedScene loaded = local::LoadScene(scene, size.bodies);
  for (const BodyDef& body : loaded.scene->bodies) {
    if (body.motion == Motion::kDynamic) bodies_.push_back(body.id);
  }
  run_ = std::make_unique<local::WorldRun>(local::RunOptions{.scene = scene,
                                                             .game = game,
                                                             .regions = kSoakRegions,
                                                             .bodies = size.bodies,
                                                             .bots = 0,
                                                             .hosts = kSoakHosts,
                                                             .capacity = kSoakCapacity,
                                                             .adjust = AdjustSoak});
  meter_ = std::make_unique<SoakMeter>(run_->cluster(), kSoakHosts, size.interval_s);
  players_ = std::make_unique<SoakPlayers>(run_->cluster().control_address(), run_->instance_id());
}

SoakStage::~SoakStage() { End(); }

void SoakStage::End() {
  if (run_ == nullptr) return;
  joins_ = players_->joins();
  players_.reset();
  try {
    (void)run_->Finish();
  } catch (const std::exception& error) {  // the control plane is gone: the cluster's own end is left
    std::cerr << "soak: " << error.what() << "\n";
  }
  run_.reset();
  counts_.left_running = meter_->KillLeftWorkers();
}

double SoakStage::run_s() const { return begun_ ? std::chrono::duration<double>(Clock::now() - begin_).count() : 0; }

absl::Status SoakStage::Await(const std::string& what, const std::function<bool(const v1::Instance&)>& holds) {
  const auto deadline = Clock::now() + kSoakPatience;
  while (true) {
    const v1::Instance instance = run_->Latest();
    if (IsOver(instance)) return absl::AbortedError("the world ended: " + instance.reason());
    players_->Look();
    joins_ = players_->joins();
    players_failed_ = players_->failed();
    NoteTakenOut(instance);
    if (begun_ && IsAtRest(instance, regions_)) meter_->Look(instance, run_s());
    if (holds(instance)) return absl::OkStatus();
    if (Clock::now() > deadline) {
      return absl::DeadlineExceededError(fmt::format("never: {}; {} players, {} regions, {} changes, unprotected {}",
                                                     what, instance.players(), instance.map().regions_size(),
                                                     instance.changes_size(), instance.unprotected_regions_size()));
    }
    if (stop_.Wait(kSoakLook)) return absl::CancelledError("ended by a signal");
  }
}

absl::Status SoakStage::AwaitWell() {
  SteadyFor steady(kFollowed);
  return Await("every region is protected",
               [&](const v1::Instance& instance) { return steady.Take(IsAtRest(instance, regions_), Clock::now()); });
}

void SoakStage::NoteTakenOut(const v1::Instance& instance) {
  for (const v1::RegionStatus& status : instance.region_status()) {
    for (const std::uint64_t id : status.report().nonfinite_ids()) taken_out_.insert(BodyId(id));
  }
  counts_.taken_out = taken_out_.size();
}

// While nobody joins or leaves, all regions together must own each body of the scene and of a player once.
absl::Status SoakStage::CallRoll() {
  const v1::Instance now = run_->Latest();
  std::vector<BodyId> expected;
  for (const BodyId body : bodies_) {
    if (!taken_out_.contains(body)) expected.push_back(body);
  }
  for (const v1::Player& player : now.player_list()) {
    const BodyId body = PlayerBodyId(PlayerNumber(player.number()));
    if (!player.left() && !taken_out_.contains(body)) expected.push_back(body);
  }
  local::Conservation roll(expected);
  // From a second after now, by when all have the bodies of those who came, and not of those who left.
  constexpr std::uint64_t kLater_ticks = 60;
  roll.Expect(expected.front(), NewestTick(now) + kLater_ticks);
  absl::Status status = Await("a roll call", [&](const v1::Instance& instance) {
    roll.Observe(instance);
    const auto result = roll.result();
    if (!result || result->censuses < kRollCensuses) return false;
    return result->lost == 0 || result->censuses >= kRollPatience;  // on its way over a closed border it is not lost
  });
  if (!status.ok()) return status;
  const local::ConservationResult result = *roll.result();
  if (result.lost > lost_) counts_.lost += result.lost - lost_;
  if (result.duplicated > duplicated_) counts_.duplicated += result.duplicated - duplicated_;
  lost_ = result.lost;
  duplicated_ = result.duplicated;
  return absl::OkStatus();
}

absl::Status SoakStage::Begin() {
  players_->Join(size_.groups);
  absl::Status status = Await("all players are in",
                              [&](const v1::Instance& instance) { return instance.players() == players_->wanted(); });
  if (status.ok()) status = AwaitWell();
  begin_ = Clock::now();
  begun_ = true;
  return status;
}

absl::Status SoakStage::RestUntil(double until_s) {
  return Await("time passed", [&](const v1::Instance&) { return run_s() >= until_s; });
}

absl::Status SoakStage::Take(const SoakTurn& turn) {
  absl::Status status;
  try {
    status = Carry(turn);
    if (status.ok()) status = AwaitWell();
    if (status.ok()) status = CallRoll();
  } catch (const std::exception& error) {  // a call was refused
    status = absl::InternalError(error.what());
  }
  if (absl::IsCancelled(status) || absl::IsAborted(status)) return status;
  ++counts_.turns;
  failed_in_a_row_ = status.ok() ? 0 : failed_in_a_row_ + 1;
  if (status.ok()) return status;
  ++counts_.failed;
  std::cerr << fmt::format("soak: {} failed: {}\n", NameOf(turn.kind), std::string(status.message()));
  return failed_in_a_row_ < kMostInARow ? absl::OkStatus() : status;
}

absl::Status SoakStage::Carry(const SoakTurn& turn) {
  switch (turn.kind) {
    case SoakTurnKind::kPlayers:
      return ChangePlayers();
    case SoakTurnKind::kScale:
      return Scale();
    case SoakTurnKind::kDeath:
      return KillWorker(turn.draw);
    case SoakTurnKind::kCheckpoint:
      Checkpoint();
      return absl::OkStatus();
    case SoakTurnKind::kProperties:
      SetProperties(turn.draw);
      return absl::OkStatus();
    case SoakTurnKind::kSpawns:
      return Spawn();
  }
  return absl::InternalError("a turn of no kind");
}

absl::Status SoakStage::ChangePlayers() {
  const std::size_t wave = std::min(kGroupsAWave, players_->groups());
  players_->Leave(wave);
  absl::Status status =
      Await("they have left", [&](const v1::Instance& instance) { return instance.players() <= players_->wanted(); });
  players_->Join(wave);
  if (!status.ok()) return status;
  return Await("others have joined",
               [&](const v1::Instance& instance) { return instance.players() == players_->wanted(); });
}

absl::Status SoakStage::Scale() {
  const std::uint32_t wanted = regions_ == kSoakRegions ? kSoakMoreRegions : kSoakRegions;
  v1::ScaleInstanceRequest request;
  request.set_id(run_->instance_id());
  request.set_regions(wanted);
  run_->connection().Call("instance scale", run_->connection().instances(), &v1::InstanceService::Stub::ScaleInstance,
                          request);
  regions_ = wanted;
  absl::Status status = AwaitWell();
  if (status.ok()) ++counts_.scales;
  return status;
}

// The one that has lived longest is spared, so that there is a worker whose memory is known over the whole run.
absl::Status SoakStage::KillWorker(std::uint64_t draw) {
  const v1::Instance now = run_->Latest();
  std::set<std::pair<std::uint64_t, pid_t>> by_age;  // with start times, oldest first
  for (const v1::RegionStatus& status : now.region_status()) {
    const auto pid = static_cast<pid_t>(status.report().identity().pid());
    if (const auto started = host::ProcessStartTime(pid)) by_age.emplace(*started, pid);
  }
  if (by_age.size() < 2) return absl::UnavailableError("no two workers run");
  const auto victim = std::next(by_age.begin(), static_cast<std::ptrdiff_t>(1 + draw % (by_age.size() - 1)));
  const auto process = host::Process::Adopt(victim->second, victim->first);
  if (!process.ok()) return process.status();
  process->Signal(SIGKILL);
  absl::Status status = Await("it is carried on", [&](const v1::Instance& instance) {
    return instance.failovers() > now.failovers() && instance.state() == v1::INSTANCE_STATE_RUNNING;
  });
  if (status.ok()) ++counts_.deaths;
  return status;
}

void SoakStage::Checkpoint() {
  v1::CheckpointInstanceRequest request;
  request.set_id(run_->instance_id());
  run_->connection().Call("instance checkpoint", run_->connection().instances(),
                          &v1::InstanceService::Stub::CheckpointInstance, request, kSoakCheckpointing);
  ++counts_.checkpoints;
}

void SoakStage::SetProperties(std::uint64_t draw) {
  std::mt19937_64 random(draw);
  for (int i = 0; i < kPropertiesATurn; ++i) {
    const BodyId body = bodies_[random() % bodies_.size()];
    if (taken_out_.contains(body)) continue;
    v1::SetPropertyRequest request;
    request.set_id(run_->instance_id());
    request.set_body(body.value());
    request.mutable_property()->set_name("health");
    request.mutable_property()->set_number(static_cast<std::int64_t>(random() % 100));
    run_->connection().Call("instance set-property", run_->connection().instances(),
                            &v1::InstanceService::Stub::SetProperty, request);
    ++counts_.properties;
  }
}

absl::Status SoakStage::Spawn() {
  const std::int64_t before = SparksOf(run_->Latest());
  v1::SendToGameRequest request;
  request.set_id(run_->instance_id());
  request.set_request_id(fmt::format("soak-{}", ++messages_));
  request.set_name("sparks");
  v1::GameField& count = *request.add_values();
  count.set_name("count");
  count.set_number(kSparksATurn);
  run_->connection().Call("game send", run_->connection().instances(), &v1::InstanceService::Stub::SendToGame, request);
  absl::Status status = Await("the game has made bodies", [&](const v1::Instance& instance) {
    return SparksOf(instance) >= before + kSparksATurn;
  });
  if (status.ok()) counts_.spawned += kSparksATurn;
  return status;
}

}  // namespace tessera::bench
