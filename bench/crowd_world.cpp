#include "bench/crowd_world.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "bench/engine.h"
#include "bench/thread_cpu.h"
#include "control_plane/region_tree.h"
#include "core/replication/interest.h"
#include "core/world/player_input.h"
#include "region_worker/core/view_share.h"
#include "region_worker/snapshot_broadcast.h"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

using replication::Bytes;

constexpr double kWorld_m = 200, kView_m = 50, kBytes_per_s = 250'000;  // 2 Mbit/s for each player
constexpr std::uint32_t kSnapshotRate_hz = 30;
constexpr double kMill_m_s = 3;  // at the rim of the disc
constexpr double kLoss = 0.02;
constexpr std::uint32_t kReadBy = 20;  // one client in so many decodes what it gets, and loses nothing

// Places of `count` things in a disc, each as far from the next as the disc allows: a sunflower's seeds.
Vec3d SeedAt(std::uint32_t index, std::uint32_t count, const CrowdPlan& plan) {
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0));
  const double radius = plan.radius_m * std::sqrt((index + 0.5) / count);
  const scenes::SinCos angle = scenes::SinCosOf(std::fmod(index * turn, 2 * std::numbers::pi));
  return plan.centre + Vec3d(radius * angle.cos, 0, radius * angle.sin);
}

}  // namespace

Scene CrowdScene(const CrowdPlan& plan) {
  scenes::Builder make("crowd");
  make.Ground({.friction = 0.5});
  const std::uint32_t all = plan.players + plan.bodies;
  // Every so many-th seed is a player's, so that they stand among the bodies.
  const std::uint32_t every = plan.players == 0 ? all + 1 : all / plan.players;
  std::vector<Vec3d> spawns;
  for (std::uint32_t i = 0; i < all; ++i) {
    const Vec3d at = SeedAt(i, all, plan);
    if (i % every == 0 && spawns.size() < plan.players) {
      spawns.push_back(at + Vec3d(0, 0.45, 0));
    } else if (i % 2 == 0) {
      make.Dynamic(scenes::BoxOf(0.3, 0.3, 0.3), at + Vec3d(0, 0.3, 0), 10, {.friction = 0.3});
    } else {
      make.Dynamic(scenes::BallOf(0.3), at + Vec3d(0, 0.3, 0), 5, {.friction = 0.3});
    }
  }
  Scene scene = make.Take();
  const double edge = kWorld_m / 2;
  scene.bounds = {{-edge, -10, -edge}, {edge, 50, edge}};
  scene.fields.emplace_back(VortexField{.center = plan.centre,
                                        .radius_m = plan.radius_m,
                                        .angular_velocity_rad_s = kMill_m_s / plan.radius_m,
                                        .gain_per_s = 1});
  PlayerRules rules;
  rules.body.name = "player";
  rules.body.motion = Motion::kDynamic;
  rules.body.shape = scenes::BallOf(0.45);
  rules.body.mass_kg = 40;
  rules.body.material.friction = 0.3;
  rules.body.may_sleep = false;
  rules.spawn_points = std::move(spawns);
  rules.max_force_n = 400;
  rules.max_force_up_n = 0;
  rules.max_speed_m_s = 5;
  scene.player = std::move(rules);
  scene.view = {.radius_m = kView_m, .bytes_per_s = kBytes_per_s};
  return scene;
}

PartitionMap BalancedCrowdMap(const Scene& scene, std::uint32_t regions) {
  PartitionMap map = *MakeGridMap(scene.ground(), regions);
  std::vector<Vec3d> places = scene.player->spawn_points;
  for (const BodyDef& body : scene.bodies) {
    if (body.motion == Motion::kDynamic) places.push_back(body.initial.position);
  }
  constexpr int kRounds = 60;
  for (int round = 0; round < kRounds; ++round) {
    control::RegionLoads loads;
    control::RegionSpreads spreads;
    for (const MapRegion& region : map.regions()) loads[region.id] = 0;
    for (const Vec3d& place : places) {
      const RegionId owner = map.OwnerOf(place);
      loads[owner] += 1;
      spreads[owner].x.push_back(place.x);
      spreads[owner].z.push_back(place.z);
    }
    for (auto& [region, spread] : spreads) {
      std::sort(spread.x.begin(), spread.x.end());
      std::sort(spread.z.begin(), spread.z.end());
    }
    std::erase_if(spreads, [](const auto& entry) { return entry.second.x.size() < 2; });
    auto tree = control::RegionTree::FromMap(map);
    if (!tree.ok()) throw std::runtime_error(tree.status().ToString());
    tree->Balance(loads, spreads, 0.5);
    map = *tree->ToMap(MapVersion(1), map.regions());
  }
  return map;
}

CrowdWorld::CrowdWorld(std::shared_ptr<const Scene> scene, std::uint32_t players, const PartitionMap& map,
                       const region::RegionSettings& settings, bool by_the_clock)
    : scene_(std::move(scene)),
      snapshots_(replication::SnapshotSettingsFor(*scene_)),
      by_the_clock_(by_the_clock),
      places_(players),
      owners_(players),
      clients_(players) {
  sides_.resize(map.regions().size());
  for (Side& side : sides_) {
    side.history = std::make_unique<replication::SnapshotHistory>(scene_->bounds, snapshots_);
    side.stubs.reserve(players);
    for (std::uint32_t client = 0; client < players; ++client) {
      Stub& stub = side.stubs.emplace_back(snapshots_);
      if (client % kReadBy == 0) stub.receiver.emplace(scene_->bounds, snapshots_);
    }
  }
  Lockstep::Observer observer;
  observer.stepped = [this](const region::Region& region, const region::StepResult& result, double cpu_s) {
    Side& side = sides_[region.id().value() - 1];
    side.feed.Note(region.tick(), result.departures);
    if (by_the_clock_) return;
    side.figures.step_s += cpu_s;
    side.figures.busy_s += cpu_s;
  };
  observer.received = [this](RegionId, region::OutgoingFrame& frame, double cpu_s) {
    if (!by_the_clock_) sides_[frame.to.value() - 1].figures.busy_s += cpu_s;
  };
  world_ = std::make_unique<Lockstep>(scene_, map, settings, std::move(observer));
  for (std::uint32_t client = 0; client < players; ++client) {
    const Vec3d at = scene_->player->spawn_points[client % scene_->player->spawn_points.size()];
    owners_[client] = map.OwnerOf(at).value() - 1;
    world_->region(owners_[client]).SpawnPlayer(PlayerNumber(client + 1));
    headings_.push_back(std::uniform_real_distribution<double>(0, 2 * std::numbers::pi)(random_));
  }
}

double CrowdWorld::Now() const {
  if (!by_the_clock_) return ThreadCpuSeconds();
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void CrowdWorld::Tick() {
  Steer();
  const double before = Now();
  world_->Tick();
  if (by_the_clock_) {
    // One region: the clock cannot tell several apart that take turns.
    sides_.front().figures.step_s += Now() - before;
    sides_.front().figures.busy_s += Now() - before;
  }
  Locate();
  for (std::size_t region = 0; region < sides_.size(); ++region) {
    ++sides_[region].figures.ticks;
    const region::Region& here = world_->region(region);
    if (worker::SnapshotFallsOn(here.tick(), here.id(), kSnapshotRate_hz, scene_->tick_rate_hz)) Show(region);
  }
}

void CrowdWorld::Forget() {
  for (Side& side : sides_) side.figures = {};
  std::ranges::fill(clients_, ClientFigures());
}

// Each player runs to and fro, now this way and now that.
void CrowdWorld::Steer() {
  ++inputs_;
  std::uniform_real_distribution<double> chance(0, 1);
  for (std::uint32_t client = 0; client < places_.size(); ++client) {
    if (chance(random_) < 0.02) headings_[client] = 2 * std::numbers::pi * chance(random_);
    const scenes::SinCos heading = scenes::SinCosOf(headings_[client]);
    PlayerInput input;
    input.number = inputs_;
    input.player = PlayerNumber(client + 1);
    input.body = PlayerBodyId(input.player);
    input.force_n = {static_cast<float>(200 * heading.cos), 0, static_cast<float>(200 * heading.sin)};
    const double before = Now();
    (void)world_->region(owners_[client]).QueueInput(input);  // while it is being handed over nobody takes it
    sides_[owners_[client]].figures.busy_s += Now() - before;
  }
}

void CrowdWorld::Locate() {
  std::ranges::fill(places_, std::nullopt);
  for (std::size_t region = 0; region < sides_.size(); ++region) {
    for (const region::OwnedBody& body : region::PlayersAmong(world_->region(region).owned())) {
      const std::size_t client = PlayerOf(body.def->id).value() - 1;
      places_[client] = body.state.position;
      owners_[client] = region;
    }
  }
}

void CrowdWorld::Show(std::size_t region) {
  Side& side = sides_[region];
  double mark = Now();
  const auto took = [&] {
    const double since = std::exchange(mark, Now());
    side.figures.busy_s += mark - since;
    side.figures.write_s += mark - since;
  };
  side.feed.Push(world_->region(region), *side.history);
  const std::vector<std::uint32_t> order = replication::NeighboursInARow(places_, snapshots_.interest_radius_m);
  took();
  for (std::size_t i = 0; i < order.size(); ++i) {
    mark = Now();
    if (i + 1 < order.size()) side.stubs[order[i + 1]].sender.Prefetch();
    const std::uint32_t client = order[i];
    replication::ClientView view{.centre = places_[client], .own = PlayerBodyId(PlayerNumber(client + 1))};
    if (places_[client]) {
      view.budget_share =
          worker::ViewShare(world_->region(region).map(), world_->region(region).id(), *places_[client], kView_m);
    }
    const replication::WrittenSnapshot written = side.stubs[client].sender.Write(*side.history, view, inputs_, 0);
    took();
    ++side.figures.snapshots;
    side.figures.bodies += written.bodies;
    side.figures.deferred += written.deferred;
    for (const Bytes& bytes : written.datagrams) {
      side.figures.bytes += bytes.size() + replication::kDatagramOverheadBytes;
      clients_[client].bytes += bytes.size() + replication::kDatagramOverheadBytes;
    }
    Deliver(region, client, written.datagrams);
    mark = Now();
    if (!side.stubs[client].answers.empty() && side.stubs[client].answers.size() > 1 + client % 4) {
      const Bytes answer = std::move(side.stubs[client].answers.front());
      side.stubs[client].answers.erase(side.stubs[client].answers.begin());
      if (!answer.empty() && !side.stubs[client].sender.Acknowledge(answer).ok()) {
        throw std::runtime_error("crowd: an acknowledgement was refused");
      }
    }
    took();
  }
}

void CrowdWorld::Deliver(std::size_t region, std::uint32_t client, const std::vector<Bytes>& datagrams) {
  Stub& stub = sides_[region].stubs[client];
  std::vector<BodyId> came;
  for (const Bytes& bytes : datagrams) {
    if (stub.receiver) {
      const auto got = stub.receiver->Read(bytes);
      if (!got.ok()) throw std::runtime_error("crowd: " + got.status().ToString());
      for (const replication::BodyRecord& body : got->bodies) came.push_back(body.id);
      continue;
    }
    if (std::uniform_real_distribution<double>(0, 1)(random_) < kLoss) continue;
    stub.acknowledger.Take(bytes);
  }
  if (stub.receiver) {
    stub.answers.push_back(stub.receiver->WriteAck());
    if (!places_[client]) return;
    std::ranges::sort(came);
    constexpr double kMoving_m_s = 0.1;
    for (const region::OwnedBody& body : world_->region(region).owned()) {
      const Vec3d way = body.state.position - *places_[client];
      const bool moves = Length(Vec3d(body.state.linear_velocity)) > kMoving_m_s;
      if (!moves || std::hypot(way.x, way.z) > kNear_m) continue;
      ++clients_[client].near;
      if (std::ranges::binary_search(came, body.def->id)) ++clients_[client].near_came;
    }
    return;
  }
  stub.answers.push_back(stub.acknowledger.Answer());
}

}  // namespace tessera::bench
