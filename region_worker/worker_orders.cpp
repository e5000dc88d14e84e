// Worker: what its orders make of it.
#include <malloc.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/world/partition_io.h"
#include "region_worker/scene_file.h"
#include "region_worker/worker.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"

namespace tessera::worker {
namespace {

bool HasRegion(const PartitionMap& map, RegionId id) {
  const auto regions = map.regions();
  return std::any_of(regions.begin(), regions.end(), [&](const MapRegion& region) { return region.id == id; });
}

void AddDoor(const v1::RegionAddress& address, v1::RegionMap& map) {
  v1::RegionDoor& door = *map.add_doors();
  door.set_region(address.region());
  door.set_host(address.host());
  door.set_game_port(address.game_port());
  door.set_incarnation(address.incarnation());
}

}  // namespace

// --- Start -----------------------------------------------------------------------------------------------------------

bool Worker::CanBuild() const {
  return order_.map && order_.key && (scene_ || !order_.scene_path.empty()) &&
         (!order_.joins_running || order_.planned);
}

// Requires CanBuild(). Again: with the newest order's map, for a region that has not stepped yet.
absl::Status Worker::Build() {
  if (scene_ == nullptr) {
    absl::StatusOr<std::shared_ptr<const Scene>> scene = LoadSceneFile(order_.scene_path, order_.scene_hash);
    if (!scene.ok()) return scene.status();
    scene_ = *std::move(scene);
  }
  absl::StatusOr<region::Config> config = MakeConfig();
  if (!config.ok()) return config.status();
  follower_.reset();
  wards_.reset();
  ticks_.emplace(*std::move(config), order_.snapshot_rate_hz, replication::SettingsFor(*scene_), *links_, *game_,
                 metrics_);
  wards_.emplace(*links_, ticks_->region().catalog(), metrics_);
  follower_.emplace(options_.identity, ticks_->region(), *links_, *wards_,
                    [this](const region::Resolution& resolution, std::span<const region::Standby* const> dead) {
                      return ticks_->Resume(resolution, dead);
                    });
  malloc_trim(0);  // what parsing the scene took
  return absl::OkStatus();
}

absl::StatusOr<region::Config> Worker::MakeConfig() const {
  const Identity& self = options_.identity;
  region::Config config = {.self = self.region,
                           .incarnation = self.incarnation,
                           .scene = scene_,
                           .map = order_.joins_running ? order_.planned->map : *order_.map,
                           .settings = order_.borders};
  if (!HasRegion(config.map, self.region)) {
    return absl::InvalidArgumentError(absl::StrCat("region ", self.region.value(), " is not in the map"));
  }
  region::RegionState initial;
  initial.region = self.region;
  initial.incarnation = self.incarnation;
  if (order_.joins_running) {
    initial.tick = Tick(order_.planned->effective.value() - 1);
    config.initial = std::make_shared<region::RegionState>(std::move(initial));
  } else if (order_.initial_state) {
    const region::Catalog catalog(scene_);
    absl::StatusOr<region::RegionState> state =
        LoadStateFile(order_.initial_state->path, order_.initial_state->hash, catalog);
    if (!state.ok()) return state.status();
    if (state->tick != order_.initial_state->tick) {
      return absl::DataLossError(absl::StrCat(order_.initial_state->path, ": it is of tick ", state->tick.value()));
    }
    config.initial = std::make_shared<region::RegionState>(*std::move(state));
  }
  return config;
}

void Worker::OpenPorts() {
  links_->Open({options_.identity, ticks_->region().map().version(), *order_.key, region::RulesOf(order_.borders)});
  game_->Open({.self = options_.identity,
               .key = *order_.key,
               .tick_rate_hz = scene_->tick_rate_hz,
               .snapshot_rate_hz = std::min(order_.snapshot_rate_hz, scene_->tick_rate_hz),
               .map = MapForClients(),
               .replication = replication::SettingsFor(*scene_)},
              [this](PlayerNumber player) { return Admit(player); });
}

// --- Orders ----------------------------------------------------------------------------------------------------------

void Worker::TakeOrder() {
  if (agent_ == nullptr) return;
  if (const std::optional<v1::WorkerOrder> message = agent_->TakeOrder()) {
    absl::StatusOr<Order> order = CheckOrder(*message, options_.identity);
    if (!order.ok()) {
      spdlog::error("order refused from=agent revision={} reason={}", message->revision(),
                    telemetry::LogValue(std::string(order.status().message())));
    } else if (order->revision > order_.revision) {
      Adopt(*std::move(order));
    }
  }
  if (agent_->refused()) Stop("the agent does not know this worker");
}

void Worker::Adopt(Order order) {
  spdlog::info("order from=agent revision={} peers={} players={} map={} planned={} heir={} wards={} run={} stop={}",
               order.revision, order.peers.size(), order.players.size(), order.map ? order.map->version().value() : 0,
               order.planned ? order.planned->map.version().value() : 0, order.heir.value(), order.wards.size(),
               order.run, order.stop);
  order_ = std::move(order);
  if (order_.stop) {
    Stop("the instance ends");
  } else {
    ApplyOrder();
  }
}

// Repeating it does nothing.
void Worker::ApplyOrder() {
  if (!ticks_) return;
  if (MustRebuild()) {
    if (const absl::Status built = Build(); !built.ok()) return Fail(built);
    if (phase_ == v1::WORKER_PHASE_RUNNING) ticks_->Run(Clock::now());
  }
  links_->SetPeers(order_.peers);
  ticks_->SetPlayers(order_.players, order_.joins_running);
  ticks_->SetPropertyOrders(order_.properties);
  // First what is to become of the dead: an order that declares one dead names it a ward no more.
  if (const absl::Status followed = follower_->Follow(order_); !followed.ok()) return Fail(followed);
  if (follower_->outranked()) return Stop("outranked: another region has taken its place");
  wards_->Set(order_.wards);
  ticks_->heir_log().SetHeir(order_.heir);
  links_->SetPartners(follower_->Partners(order_));
  TellInventory(Clock::now());
  if (phase_ != v1::WORKER_PHASE_LOADING) game_->SetMap(MapForClients());
}

// A region that is to join, and was not asked to step yet, joins by another map or at another tick.
bool Worker::MustRebuild() const {
  if (!order_.joins_running || !order_.planned) return false;
  const region::Region& region = ticks_->region();
  const Tick begins(order_.planned->effective.value() - 1);
  if (ticks_->stepped() || region.map().version() > order_.planned->map.version()) return false;
  return region.map().version() != order_.planned->map.version() || region.tick() != begins;
}

// --- What follows from the map ---------------------------------------------------------------------------------------

void Worker::FollowMaps() {
  if (!follower_->MapInForce()) return;
  links_->SetPartners(follower_->Partners(order_));
  game_->SetMap(MapForClients());
}

v1::RegionMap Worker::MapForClients() const {
  v1::RegionMap map;
  *map.mutable_map() = ToProto(ticks_->region().map());
  AddDoor(address_, map);
  for (const PeerAddress& peer : order_.peers) {
    if (peer.game_port == 0 || peer.region == options_.identity.region) continue;
    v1::RegionAddress address;
    address.set_region(peer.region.value());
    address.set_host(peer.host);
    address.set_game_port(peer.game_port);
    address.set_incarnation(peer.incarnation.value());
    AddDoor(address, map);
  }
  return map;
}

namespace {

v1::WorkerIdentity ToProto(const Identity& self) {
  v1::WorkerIdentity identity;
  identity.set_instance_id(self.instance_id);
  identity.set_region(self.region.value());
  identity.set_incarnation(self.incarnation.value());
  return identity;
}

}  // namespace

void Worker::TellInventory(TimePoint now) {
  if (agent_ == nullptr) return;
  std::optional<v1::InventoryReport> report;
  if (std::optional<v1::Inventory> inventory = follower_->InventoryAt(now)) {
    report.emplace();
    *report->mutable_identity() = ToProto(options_.identity);
    *report->mutable_inventory() = *std::move(inventory);
  }
  if (!report && !inventory_told_) return;
  inventory_told_ = report.has_value();
  agent_->SetInventory(report);
}

void Worker::KeepLease(TimePoint now) {
  if (agent_ == nullptr) return;
  Lease& lease = ticks_->lease();
  if (const std::optional<v1::LeaseRenewal> renewal = agent_->TakeLease()) {
    if (renewal->identity().incarnation() == options_.identity.incarnation.value()) {
      lease.Answered(renewal->number(), std::chrono::milliseconds(renewal->ttl_ms()));
    }
  }
  const std::optional<std::uint64_t> number = lease.Ask(now);
  if (!number) return;
  links_->SendNow(ticks_->heir_log().heir(), Numbered(LinkMessageKind::kLeaseAsk, *number));
  v1::LeaseRequest request;
  *request.mutable_identity() = ToProto(options_.identity);
  request.set_number(*number);
  agent_->AskLease(request);
}

void Worker::KeepCheckpoint() {
  if (const std::optional<StateWriter::Written> written = state_writer_.Take()) {
    if (written->status.ok()) {
      checkpoint_tick_ = written->tick;
    } else {
      checkpoint_failure_ = std::string(written->status.message());
      spdlog::error("checkpoint failed tick={} reason={}", written->tick.value(),
                    telemetry::LogValue(checkpoint_failure_));
    }
  }
  // What is ordered no more, or not due yet, has not failed.
  if (!order_.checkpoint || saving_ != order_.checkpoint->tick) checkpoint_failure_.clear();
  if (!order_.checkpoint || order_.checkpoint->path.empty() || saving_ == order_.checkpoint->tick) return;
  const Tick tick = ticks_->region().tick();
  const Tick wanted = order_.checkpoint->tick;
  if (tick < wanted) return;
  saving_ = wanted;
  const region::Region& region = ticks_->region();
  const auto neighbors = region.neighbors();
  const bool all_open =
      std::all_of(neighbors.begin(), neighbors.end(), [&](RegionId neighbor) { return region.IsOpen(neighbor); });
  // Over a closed border a body may be granted and not taken in: in the states of that tick nobody would own it.
  if (tick == wanted && !state_writer_.busy() && !region.halted() && all_open) {
    state_writer_.Begin(tick, order_.checkpoint->path, region.SaveState());
    return;
  }
  checkpoint_failure_ =
      tick > wanted
          ? absl::StrCat("tick ", wanted.value(), " has passed: it is ", tick.value())
          : std::string("the one before is still being written, a failover is under way, or a border is closed");
  spdlog::warn("checkpoint missed tick={} reason={}", wanted.value(), telemetry::LogValue(checkpoint_failure_));
}

}  // namespace tessera::worker
