#include "client_sdk/local/local_world.h"

#include <unistd.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <type_traits>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/movement.h"
#include "core/world/packed_scene.h"
#include "core/world/partition_map.h"
#include "core/world/scene_load.h"
#include "net/credential.h"
#include "net/endpoint.h"
#include "net/join_grant.h"
#include "region_worker/client_side.h"
#include "region_worker/core/worker_core.h"
#include "region_worker/worker_metrics.h"

namespace tessera::local {
namespace {

constexpr char kInstanceId[] = "local", kAddress[] = "127.0.0.1";
constexpr RegionId kRegion(1);
constexpr Incarnation kIncarnation(1);
constexpr std::size_t kMaxLines = 1000;
// A movement is the region's by its game; where there is none, this one does nothing.
constexpr char kNoGame[] = "-- a movement alone\n";
// Players, each once more while it comes back.
constexpr std::size_t kPeers = 2 * kUsualPlayers;

// A player that came by its grant, as an order would name it.
worker::OrderedPlayer LocalPlayer(PlayerNumber number) { return {.number = number, .spawn_region = kRegion}; }

}  // namespace

struct LocalWorld::Impl {
  Impl(LoadedScene loaded, const LocalWorldOptions& options, std::unique_ptr<net::Endpoint> endpoint);
  worker::WorkerSetup Setup() const;
  worker::Order FirstOrder(const LocalWorldOptions& options) const;
  net::EndpointIdentity Self() const;
  void Advance(worker::TimePoint time);
  void CarryOut();
  template <class Action>
  void Do(const Action& action);
  void KeepLines();

  std::shared_ptr<const Scene> scene;
  std::string scene_hash, game;
  const tessera_movement* movement;
  std::vector<std::uint8_t> packed_scene;
  // Made here and known to nobody: a grant of this world is all that opens it.
  const net::SigningKey instance_key = net::SigningKey::Make(), key = net::SigningKey::Make();
  worker::WorkerMetrics metrics;
  worker::ClientSide clients;
  PartitionMap map;
  worker::Certified certified;
  std::uint32_t snapshot_rate_hz;
  worker::WorkerCore core;
  worker::TimePoint now{};
  std::uint32_t players = 0;
  std::uint64_t last_line = 0;
  std::deque<LocalGameLine> lines;
};

absl::StatusOr<std::unique_ptr<LocalWorld>> LocalWorld::Open(const LocalWorldOptions& options) {
  absl::StatusOr<LoadedScene> loaded = LoadScene(SceneForm::kText, options.scene, options.scene_name);
  if (!loaded.ok()) return loaded.status();
  if (options.snapshot_rate_hz > loaded->scene->tick_rate_hz) {
    return absl::InvalidArgumentError(absl::StrCat("snapshot_rate_hz: must be at most ", loaded->scene->tick_rate_hz,
                                                   ", got ", options.snapshot_rate_hz));
  }
  if (options.movement != nullptr) {
    const auto movement = MovementIn(*loaded->scene, *options.movement);
    if (!movement.ok()) return movement.status();
  }
  // Without limits by the second: they count real time, and a test may let hours pass in a second.
  auto endpoint =
      net::Endpoint::Create({.bind_address = kAddress, .max_peers = kPeers, .accept_reliable_messages = false});
  if (!endpoint.ok()) return endpoint.status();
  auto world = std::make_unique<Impl>(*std::move(loaded), options, *std::move(endpoint));
  world->core.StartStandalone(world->FirstOrder(options), world->scene, world->now);
  world->CarryOut();
  if (const std::string& why = world->core.failure(); !why.empty()) return absl::InvalidArgumentError(why);
  return std::unique_ptr<LocalWorld>(new LocalWorld(std::move(world)));
}

LocalWorld::Impl::Impl(LoadedScene loaded, const LocalWorldOptions& options, std::unique_ptr<net::Endpoint> endpoint)
    : scene(std::move(loaded.scene)),
      scene_hash(std::move(loaded.hash)),
      game(options.game.empty() && options.movement != nullptr ? kNoGame : options.game),
      movement(options.movement),
      packed_scene(PackScene(*scene)),
      clients(std::move(endpoint), metrics),
      map(*MakeGridMap(scene->ground(), 1)),
      certified{.instance_key = instance_key.verification_key(),
                .certificate = net::Sign(net::WorkerCertificate{.instance_id = kInstanceId,
                                                                .region = kRegion,
                                                                .incarnation = kIncarnation,
                                                                .key = key.verification_key()},
                                         instance_key),
                .worker_key = key.verification_key()},
      snapshot_rate_hz(options.snapshot_rate_hz == 0 ? scene->tick_rate_hz : options.snapshot_rate_hz),
      core(Setup()) {}

LocalWorld::LocalWorld(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LocalWorld::~LocalWorld() {
  impl_->clients.port().Close("the local world ends");
  impl_->clients.port().Flush();
}

worker::WorkerSetup LocalWorld::Impl::Setup() const {
  worker::WorkerSetup setup{.identity = {.instance_id = kInstanceId, .region = kRegion, .incarnation = kIncarnation},
                            .pid = getpid(),
                            .address = {},
                            .borders = {},
                            .standalone = worker::StandaloneRules{}};
  setup.address.set_region(kRegion.value());
  setup.address.set_incarnation(kIncarnation.value());
  setup.address.set_host(kAddress);
  setup.address.set_game_port(clients.port().port());
  setup.key = key.verification_key();
  setup.standalone->make_player = &LocalPlayer;
  setup.movement = movement;
  return setup;
}

worker::Order LocalWorld::Impl::FirstOrder(const LocalWorldOptions& options) const {
  worker::Order order;
  order.revision = 1;
  order.map = map;
  order.certified = certified;
  order.snapshot_rate_hz = snapshot_rate_hz;
  // There is no backend: events for it are dropped as they come.
  order.backend.published_up_to = std::numeric_limits<std::uint64_t>::max();
  if (!game.empty()) {
    order.game = {.path = options.game_name, .hash = {}, .name = options.game_name, .number = 0, .failure = {}};
  }
  return order;
}

net::EndpointIdentity LocalWorld::Impl::Self() const {
  return {.instance_id = kInstanceId,
          .region = kRegion,
          .incarnation = kIncarnation,
          .instance_key = certified.instance_key,
          .certificate = certified.certificate,
          .key = key};
}

absl::Status LocalWorld::Advance(worker::TimePoint now) {
  impl_->Advance(now);
  const worker::WorkerCore& core = impl_->core;
  if (!core.stopping()) return absl::OkStatus();
  return absl::FailedPreconditionError(core.failure().empty() ? core.stop_reason() : core.failure());
}

void LocalWorld::Impl::Advance(worker::TimePoint time) {
  now = std::max(now, time);
  clients.Service(core, now);
  while (core.Advance(now)) {
    CarryOut();
    core.Step(now);
    CarryOut();
    KeepLines();
    core.StepEnded(now, worker::Duration(0));
  }
  CarryOut();
  if (core.run() != nullptr) clients.GreetInPause(*core.run());
  clients.port().Flush();
}

absl::StatusOr<std::vector<std::uint8_t>> LocalWorld::Grant() {
  Impl& me = *impl_;
  if (!me.scene->player) return absl::FailedPreconditionError("the scene has no player");
  if (me.players == kUsualPlayers) {
    return absl::ResourceExhaustedError(absl::StrCat("there were ", kUsualPlayers, " players"));
  }
  const PlayerNumber player(++me.players);
  return net::EncodeJoinGrant(
      {.player = player,
       .credentials = net::IssuePlayer(kInstanceId, player, net::Generation(1), me.instance_key),
       .map = me.map,
       .regions = {{kRegion, kAddress, me.clients.port().port(), kIncarnation}},
       .scene_hash = me.scene_hash,
       .tick_rate_hz = me.scene->tick_rate_hz,
       .snapshot_rate_hz = me.snapshot_rate_hz,
       .expected_players = 0});
}

const std::vector<std::uint8_t>& LocalWorld::packed_scene() const { return impl_->packed_scene; }

Tick LocalWorld::tick() const {
  const worker::RegionRun* run = impl_->core.run();
  return run == nullptr ? Tick() : run->region().tick();
}

const region::Region& LocalWorld::region() const { return impl_->core.run()->region(); }

std::optional<LocalGameLine> LocalWorld::TakeLine() {
  if (impl_->lines.empty()) return std::nullopt;
  LocalGameLine line = std::move(impl_->lines.front());
  impl_->lines.pop_front();
  return line;
}

// --- The core's actions. A world of one region without an agent has no others.

void LocalWorld::Impl::CarryOut() {
  for (worker::Actions* actions = &core.TakeActions(); !actions->empty(); actions = &core.TakeActions()) {
    for (const worker::Action& action : *actions) {
      std::visit([this](const auto& what) { Do(what); }, action);
    }
  }
}

template <class Action>
void LocalWorld::Impl::Do(const Action& action) {
  if constexpr (std::is_same_v<Action, worker::RequestGame>) {
    core.GameLoaded(game, now);
  } else if constexpr (std::is_same_v<Action, worker::OpenPorts>) {
    clients.Open(action, Self(), core, scene_hash, /*quiet=*/true);
  } else if constexpr (std::is_same_v<Action, worker::PublishMap>) {
    clients.port().SetMap(action.map);
  } else if constexpr (std::is_same_v<Action, worker::PublishStart>) {
    clients.port().SendStarted(action.tick);
  } else if constexpr (std::is_same_v<Action, worker::PublishClock>) {
    clients.Publish(action);
  } else if constexpr (std::is_same_v<Action, worker::PublishStep>) {
    clients.Publish(action, *core.run());
  } else if constexpr (std::is_same_v<Action, worker::ExpelPlayer>) {
    clients.port().Expel(action.player, action.ended_because);
  } else if constexpr (std::is_same_v<Action, worker::ReplacePlayer>) {
    clients.port().Replace(action.player, action.generation);
  }
}

// The log repeats its newest lines; more than it keeps are left out.
void LocalWorld::Impl::KeepLines() {
  v1::WorkerReport report;
  core.run()->game_log().Report(report);
  for (const v1::GameLine& line : report.game_lines()) {
    if (line.number() <= last_line) continue;
    last_line = line.number();
    lines.push_back({.tick = Tick(line.tick()), .error = line.error(), .text = line.text()});
  }
  while (lines.size() > kMaxLines) lines.pop_front();
}

}  // namespace tessera::local
