#include "tests/simulation/deployed_worker.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/region/failover_io.h"
#include "core/region/log.h"

namespace tessera::simulation {
namespace {

bool HasRegion(const PartitionMap& map, RegionId id) {
  return std::ranges::find(map.regions(), id, &MapRegion::id) != map.regions().end();
}

}  // namespace

DeployedWorker::DeployedWorker(Surroundings& around, worker::Identity identity, std::int64_t pid,
                               v1::RegionAddress address, std::uint32_t place)
    : around_(around), identity_(std::move(identity)), pid_(pid), address_(std::move(address)), place_(place) {
  around_.network.SetPlace(node(), place_);
  around_.timeline.In(kRound, [this, alive = alive_] {
    if (*alive) Round();
  });
}

DeployedWorker::~DeployedWorker() { *alive_ = false; }

// --- One round of its loop.

void DeployedWorker::Round() {
  const auto round = [this, alive = alive_] {
    if (!*alive || over_) return;
    Progress();
    if (worker_ && !over_) {
      heir_log_->Follow(around_.Now());
      FollowMaps();
      KeepLease();
      KeepCheckpoint();
      Relink();
      worker_->Advance();
    }
    if (!over_) Report();
  };
  if (around_.network.Joined(node())) {
    around_.network.InProcess(node(), round);
  } else {
    round();
  }
  if (over_) return;
  around_.timeline.In(kRound, [this, alive = alive_] {
    if (*alive) Round();
  });
}

void DeployedWorker::Progress() {
  const bool can_build =
      order_.map && order_.key && !order_.scene_path.empty() && (!order_.joins_running || order_.planned);
  if (phase_ == v1::WORKER_PHASE_LOADING && can_build) {
    Build();
    if (over_) return;
    Apply();
    phase_ = v1::WORKER_PHASE_BOUND;
  }
  const auto linked = [this](RegionId partner) { return LinkTo(partner) != net::PeerHandle(); };
  if (phase_ == v1::WORKER_PHASE_BOUND && std::ranges::all_of(partners_, linked)) phase_ = v1::WORKER_PHASE_LINKED;
  if (phase_ == v1::WORKER_PHASE_LINKED && order_.run) phase_ = v1::WORKER_PHASE_RUNNING;
}

// --- Start.

void DeployedWorker::Build() {
  absl::StatusOr<region::Config> config = MakeConfig();
  if (!config.ok()) return Fail(config.status());
  follower_.reset();
  wards_.reset();
  heir_log_.reset();
  worker_.reset();
  lease_ = {};
  worker_.emplace(around_.timeline, around_.network, *std::move(config),
                  static_cast<Node>(identity_.incarnation.value()));
  heir_log_.emplace(*this, worker_->region(), lease_, metrics_);
  wards_.emplace(*this, worker_->region().catalog(), metrics_);
  follower_.emplace(identity_, worker_->region(), *this, *wards_,
                    [this](const region::Resolution& resolution, std::span<const region::Standby* const> dead) {
                      return Resume(resolution, dead);
                    });
  WireWorker();
  worker_->Start();
}

absl::StatusOr<region::Config> DeployedWorker::MakeConfig() const {
  region::Config config{identity_.region, identity_.incarnation,
                        around_.scene,    order_.joins_running ? order_.planned->map : *order_.map,
                        around_.settings, nullptr};
  if (!HasRegion(config.map, identity_.region)) return absl::InvalidArgumentError("it is not in the map");
  if (order_.joins_running) {
    auto nothing = std::make_shared<region::RegionState>();
    nothing->region = identity_.region;
    nothing->incarnation = identity_.incarnation;
    nothing->tick = Tick(order_.planned->effective.value() - 1);
    config.initial = std::move(nothing);
  } else if (order_.initial_state) {
    const auto file = around_.files.find(order_.initial_state->path);
    if (file == around_.files.end()) return absl::NotFoundError(order_.initial_state->path);
    const region::Catalog catalog(around_.scene);
    absl::StatusOr<region::RegionState> state = region::DecodeState(file->second, catalog);
    if (!state.ok()) return state.status();
    config.initial = std::make_shared<region::RegionState>(*std::move(state));
  }
  return config;
}

void DeployedWorker::WireWorker() {
  worker_->on_step = [this](Worker&, const region::StepResult& result) {
    stepped_ = true;
    Publish(result);
  };
  worker_->on_other = [this](Worker&, Node from, std::uint8_t kind, std::span<const std::uint8_t> bytes) {
    OnLinkMessage(from, kind, bytes);
  };
  worker_->may_step = [this] { return !over_ && running() && !left_out_ && lease_.Held(around_.Now()); };
  worker_->may_care = [this] { return !over_ && running() && !left_out_ && !paused(); };
  worker_->admits = [this](Node from) { return !over_ && Admits(from); };
  // A body may be on its way here when its player leaves.
  worker_->before_step = [this] {
    for (const PlayerNumber player : left_) {
      if (worker_->region().Owns(PlayerBodyId(player))) worker_->region().RemovePlayer(player);
    }
    property_orders_.Apply(worker_->region());
  };
}

// A region that is to join, and was not asked to step yet, joins by another map or at another tick.
bool DeployedWorker::MustRebuild() const {
  if (!order_.joins_running || !order_.planned) return false;
  const region::Region& region = worker_->region();
  const MapVersion version = order_.planned->map.version();
  if (stepped_ || region.map().version() > version) return false;
  return region.map().version() != version || region.tick() + 1 != order_.planned->effective;
}

// --- Orders.

void DeployedWorker::Take(const v1::WorkerOrder& message) {
  if (over_) return;
  absl::StatusOr<worker::Order> order = worker::CheckOrder(message, identity_);
  if (!order.ok()) return around_.on_failure(*this, "order refused: " + std::string(order.status().message()));
  if (order->revision <= order_.revision) return;
  order_ = *std::move(order);
  if (order_.stop) return End(worker::kExitOk);
  Apply();
  if (!over_) Report();
}

void DeployedWorker::Apply() {
  if (!worker_) return;
  if (MustRebuild()) Build();
  if (over_) return;
  for (const worker::PeerAddress& peer : order_.peers) {
    Incarnation& known = addresses_[peer.region];
    if (known < peer.incarnation && known != Incarnation()) worker_->DropKept(peer.region);
    known = std::max(known, peer.incarnation);
    worker_->SetAddress(peer.region, NodeOf(peer.region, static_cast<Node>(known.value())));
  }
  SetPlayers();
  property_orders_.Set(order_.properties);
  if (const absl::Status followed = follower_->Follow(order_); !followed.ok()) return Fail(followed);
  if (follower_->outranked()) return End(worker::kExitOk);
  wards_->Set(order_.wards);
  heir_log_->SetHeir(order_.heir);
  const std::vector<RegionId> partners = follower_->Partners(order_);
  partners_ = {partners.begin(), partners.end()};
  Relink();
  TellInventory();
}

absl::Status DeployedWorker::Resume(const region::Resolution& resolution,
                                    std::span<const region::Standby* const> dead) {
  absl::StatusOr<region::StepResult> result = worker_->region().Resume(resolution, dead);
  if (!result.ok()) return result.status();
  if (order_.failover) around_.on_takeover(*this, *order_.failover);
  worker_->Send(std::move(result->frames));
  Publish(*result);
  return absl::OkStatus();
}

void DeployedWorker::SetPlayers() {
  region::Region& region = worker_->region();
  for (const worker::OrderedPlayer& player : order_.players) {
    region.ParkPlayer(player.number, player.parked);
    if (player.left) {
      left_.insert(player.number);
    } else if (player.spawn_region == identity_.region && asked_to_spawn_.insert(player.number).second) {
      order_.joins_running ? region.MarkSpawned(player.number) : region.SpawnPlayer(player.number);
    }
  }
}

void DeployedWorker::FollowMaps() {
  if (!follower_->MapInForce()) return;
  const std::vector<RegionId> partners = follower_->Partners(order_);
  partners_ = {partners.begin(), partners.end()};
}

// --- Steps.

void DeployedWorker::Publish(const region::StepResult& result) {
  left_out_ = !HasRegion(worker_->region().map(), identity_.region);
  heir_log_->Send(result.log, result.tick, around_.Now());
  around_.on_step(*this, result);
  KeepCheckpoint();
}

bool DeployedWorker::Moves() const {
  return worker_ && !over_ && running() && !left_out_ && lease_.Held(around_.Now()) && !worker_->region().halted();
}

bool DeployedWorker::whole() const {
  return heir_log_ && !heir_log_->unprotected() && (heir_log_->heir() == RegionId() || lease_.Held(around_.Now()));
}

// --- Links.

// As RegionLinks: of a life that is known, or not known yet, and has not ended.
bool DeployedWorker::Admits(Node other) const {
  const RegionId region = RegionAt(other);
  const Incarnation life(other / kNodesOfALife);
  const auto over = outranked_.find(region);
  if (over != outranked_.end() && life <= over->second) return false;
  const auto known = addresses_.find(region);
  if (known == addresses_.end()) return partners_.contains(region);
  return life >= known->second;
}

net::PeerHandle DeployedWorker::LinkTo(RegionId region) const {
  const Node other = worker_->AddressOf(region);
  return Admits(other) ? net::PeerHandle(around_.network.Session(node(), other)) : net::PeerHandle();
}

bool DeployedWorker::SendNow(RegionId to, std::span<const std::uint8_t> message) {
  if (LinkTo(to) == net::PeerHandle()) return false;
  return around_.network.Send(node(), worker_->AddressOf(to), Bytes(message.begin(), message.end()));
}

void DeployedWorker::Outrank(RegionId region, Incarnation incarnation) {
  Incarnation& highest = outranked_[region];
  highest = std::max(highest, incarnation);
  const auto known = addresses_.find(region);
  if (known != addresses_.end() && incarnation < known->second) return;
  worker_->DropKept(region);
  around_.network.Break(node(), worker_->AddressOf(region));
}

void DeployedWorker::OnLinkMessage(Node from, std::uint8_t kind, std::span<const std::uint8_t> bytes) {
  Bytes whole = {kind};
  whole.insert(whole.end(), bytes.begin(), bytes.end());
  const std::optional<worker::LinkMessage> message = worker::ReadLinkMessage(whole);
  if (!message) return around_.on_failure(*this, "a message of no known form");
  const RegionId region = RegionAt(from);
  const auto now = around_.Now();
  switch (message->kind) {
    case worker::LinkMessageKind::kLog:
      return wards_->OnLog(region, *message, now);
    case worker::LinkMessageKind::kLogTaken:
      return heir_log_->OnTaken(region, Tick(message->number));
    case worker::LinkMessageKind::kLogAgain:
      return heir_log_->OnAgain(region);
    case worker::LinkMessageKind::kLeaseAsk:
      return wards_->OnLeaseAsk(region, message->number, now);
    case worker::LinkMessageKind::kLeaseGiven:
      if (region == heir_log_->heir()) lease_.Answered(message->number, worker::Lease::kTtl);
      return;
    default:
      return;
  }
}

// A link is dialled by the lower region, to a partner; both know of it as soon as both have joined.
void DeployedWorker::Relink() {
  for (const RegionId partner : partners_) {
    const Node other = worker_->AddressOf(partner);
    if (addresses_.contains(partner) && Admits(other)) around_.network.Link(node(), other);
  }
}

// --- Lease, checkpoints, reports.

void DeployedWorker::KeepLease() {
  const std::optional<std::uint64_t> number = lease_.Ask(around_.Now());
  if (!number) return;
  SendNow(heir_log_->heir(), worker::Numbered(worker::LinkMessageKind::kLeaseAsk, *number));
  v1::WorkerMessage message;
  *message.mutable_lease()->mutable_identity() = Self();
  message.mutable_lease()->set_number(*number);
  if (tell) tell(message);
}

void DeployedWorker::TakeLease(const v1::LeaseRenewal& renewal) {
  if (over_ || renewal.identity().incarnation() != identity_.incarnation.value()) return;
  lease_.Answered(renewal.number(), std::chrono::milliseconds(renewal.ttl_ms()));
}

void DeployedWorker::KeepCheckpoint() {
  if (!order_.checkpoint || saving_ != order_.checkpoint->tick) checkpoint_failure_.clear();
  if (!order_.checkpoint || order_.checkpoint->path.empty() || saving_ == order_.checkpoint->tick) return;
  const Tick tick = worker_->region().tick(), wanted = order_.checkpoint->tick;
  if (tick < wanted) return;
  saving_ = wanted;
  const region::Region& region = worker_->region();
  const auto open = [&](RegionId neighbor) { return region.IsOpen(neighbor); };
  if (tick == wanted && !region.halted() && std::ranges::all_of(region.neighbors(), open)) {
    around_.files[order_.checkpoint->path] = region.SaveState();
    checkpoint_tick_ = tick;
  } else {
    checkpoint_failure_ = "its tick has passed, a failover is under way, or a border is closed";
  }
}

v1::WorkerIdentity DeployedWorker::Self() const {
  v1::WorkerIdentity self;
  self.set_instance_id(identity_.instance_id);
  self.set_region(identity_.region.value());
  self.set_incarnation(identity_.incarnation.value());
  self.set_pid(pid_);
  return self;
}

std::optional<v1::InventoryReport> DeployedWorker::Inventory() const {
  if (!follower_) return std::nullopt;
  const std::optional<v1::Inventory> inventory = follower_->InventoryAt(around_.Now());
  if (!inventory) return std::nullopt;
  v1::InventoryReport report;
  *report.mutable_identity() = Self();
  *report.mutable_inventory() = *inventory;
  return report;
}

void DeployedWorker::TellInventory() {
  const std::optional<v1::InventoryReport> inventory = Inventory();
  if (!inventory || !tell) return;
  v1::WorkerMessage message;
  *message.mutable_inventory() = *inventory;
  tell(message);
}

worker::ReportedState DeployedWorker::State() const {
  worker::ReportedState state = {.phase = phase_,
                                 .order_revision = order_.revision,
                                 .linked = {},
                                 .players = {},
                                 .failure = failure_,
                                 .checkpoint_tick = checkpoint_tick_,
                                 .checkpoint_failure = checkpoint_failure_};
  if (worker_) {
    state.map = worker_->region().map().version();
    state.planned = follower_->planned();
    state.refused = follower_->refused();
    state.paused = paused();
    state.unprotected = heir_log_->unprotected();
    state.property_answers = property_orders_.Answers(worker_->region(), heir_log_->heir() != RegionId());
  }
  return state;
}

v1::WorkerReport DeployedWorker::MakeReport() const {
  const worker::ReportedState state = State();
  v1::WorkerReport report;
  *report.mutable_identity() = Self();
  report.set_phase(phase_);
  *report.mutable_address() = address_;
  report.set_order_revision(state.order_revision);
  report.set_failure(failure_);
  report.set_checkpoint_tick(checkpoint_tick_.value());
  report.set_checkpoint_failure(checkpoint_failure_);
  for (const worker::PropertyAnswer& answer : state.property_answers) {
    v1::PropertyAnswer& out = *report.add_property_answers();
    out.set_number(answer.number);
    out.set_refused(answer.refused);
  }
  if (!worker_) return report;
  const region::Region& region = worker_->region();
  report.set_tick(region.tick().value());
  report.set_tick_rate_hz(around_.scene->tick_rate_hz);
  report.mutable_step()->set_p50_seconds(1e-3);
  report.set_owned(region.owned_count());
  report.set_map_version(state.map.value());
  report.set_planned_version(state.planned.value());
  report.set_refused_version(state.refused.value());
  report.set_bodies_outside(region.away_count());
  report.set_paused(state.paused);
  report.set_unprotected(state.unprotected);
  report.set_acknowledged_tick(heir_log_->acknowledged().value());
  wards_->Report(report);
  return report;
}

v1::WorkerMessage DeployedWorker::FirstWords() {
  v1::WorkerMessage message;
  *message.mutable_report() = MakeReport();
  if (const auto inventory = Inventory()) *message.mutable_inventory() = *inventory;
  return message;
}

void DeployedWorker::Report() {
  const worker::ReportedState state = State();
  if (!tell || !gate_.Due(around_.Now(), state)) return;
  gate_.Sent(around_.Now(), state);
  v1::WorkerMessage message;
  *message.mutable_report() = MakeReport();
  tell(message);
}

// --- End.

void DeployedWorker::Stop() {
  if (!over_) End(worker::kExitOk);
}

void DeployedWorker::Fail(const absl::Status& status) {
  failure_ = std::string(status.message());
  around_.on_failure(*this, failure_);
  End(worker::kExitFailure);
}

void DeployedWorker::End(int code) {
  over_ = true;
  phase_ = v1::WORKER_PHASE_STOPPING;
  gate_ = {};
  Report();
  ended(code);
}

}  // namespace tessera::simulation
