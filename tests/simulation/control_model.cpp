#include "tests/simulation/control_model.h"

#include <algorithm>

#include "core/region/log.h"
#include "core/world/partition_change.h"

namespace tessera::simulation {
namespace {

constexpr std::uint8_t kLog = SimulatedRegion::kFirstOtherKind, kAcknowledgement = kLog + 1, kAskWhole = kLog + 2;
constexpr Micros kLook = Milliseconds(50);  // between looks at a planned map

Bytes Packed(Tick tick) {
  Bytes bytes;
  for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<std::uint8_t>(tick.value() >> (8 * i)));
  return bytes;
}

Tick Unpacked(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
  return Tick(value);
}

}  // namespace

ControlModel::ControlModel(Simulation& simulation, const PartitionMap& map, const ControlOptions& options)
    : simulation_(simulation), options_(options), map_(map), versions_(map.version().value()) {
  simulation.on_worker_started = [this](SimulatedRegion& worker) { Protect(worker); };
  simulation.on_step = [this](SimulatedRegion& worker, const region::StepResult& result) { Stepped(worker, result); };
  simulation.on_message = [this](SimulatedRegion& worker, Node from, std::uint8_t kind,
                                 std::span<const std::uint8_t> bytes) { OnMessage(worker, from, kind, bytes); };
  simulation.on_killed = [this](RegionId region) { Killed(region); };
  simulation.more_copies = [this](std::vector<BodyId>& held) {
    for (const auto& [holder, primaries] : standby_copies_) {
      for (const auto& [region, standby_copy] : primaries) {
        for (const region::StateBody& body : standby_copy.state().bodies) held.push_back(body.id);
        for (const auto& [key, grant] : standby_copy.state().grants) held.push_back(key.first);
      }
    }
  };
}

void ControlModel::After(Micros time, std::function<void()> action) {
  simulation_.timeline().In(time, std::move(action));
}

void ControlModel::Message(std::function<void()> action) {
  After(200 + simulation_.chance().Next() % options_.max_message, std::move(action));
}

template <class Action>
void ControlModel::ToWorker(RegionId region, Action action) {
  Message([this, region, action] {
    simulation_.network().InProcess(region.value(), [this, region, action] {
      if (simulation_.Alive(region)) action(simulation_.worker(region.value()));
    });
  });
}

// --- Logs.

// One that joins is in the next map only.
RegionId ControlModel::StandbyOf(RegionId region) const {
  const MapRegion* entry = map_.Find(region);
  if (entry == nullptr && plan_) entry = plan_->next.Find(region);
  return entry == nullptr ? RegionId() : entry->standby;
}

void ControlModel::Protect(SimulatedRegion& worker) {
  const RegionId standby = StandbyOf(worker.id());
  worker.region().SetStandby(standby != RegionId());
  if (standby != RegionId()) simulation_.network().Link(worker.node(), standby.value());
}

void ControlModel::Stepped(SimulatedRegion& worker, const region::StepResult& result) {
  last_tick_[worker.id()] = result.tick;
  std::vector<BodyId>& owned = last_owned_[worker.id()];
  owned.clear();
  for (const region::OwnedBody& body : worker.region().owned()) owned.push_back(body.def->id);
  SendLog(worker, result);
}

void ControlModel::SendLog(SimulatedRegion& worker, const region::StepResult& result) {
  const RegionId standby = StandbyOf(worker.id());
  if (result.log.empty() || standby == RegionId() || held_logs_.contains(worker.id())) return;
  ++totals_.log_messages;
  totals_.log_bytes += result.log.size();
  (void)worker.SendOther(standby.value(), kLog, result.log);
}

void ControlModel::OnMessage(SimulatedRegion& worker, Node from, std::uint8_t kind,
                             std::span<const std::uint8_t> bytes) {
  const RegionId sender(from);
  if (kind == kLog) {
    if (dead_.contains(sender) || retired_.contains(sender)) return;  // the promise: nothing more is acknowledged
    region::StandbyCopy& standby_copy =
        standby_copies_[worker.id()].try_emplace(sender, sender, worker.region().catalog()).first->second;
    if (standby_copy.Receive(bytes).ok()) {
      asked_.erase(sender);
      (void)worker.SendOther(from, kAcknowledgement, Packed(standby_copy.tick()));
    } else if (!asked_.contains(sender) || last_tick_[sender] - asked_[sender] > 20) {
      asked_[sender] = last_tick_[sender];
      (void)worker.SendOther(from, kAskWhole, {});
    }
  } else if (kind == kAcknowledgement) {
    if (StandbyOf(worker.id()) != sender) return;
    worker.region().LogAcknowledged(Unpacked(bytes));
    for (auto& [holder, primaries] : standby_copies_) {
      if (holder != sender) primaries.erase(worker.id());
    }
  } else if (kind == kAskWhole) {
    ++totals_.whole_logs;
    worker.region().SetStandby(true);
  }
}

std::optional<Tick> ControlModel::StandbyTick(RegionId region) const {
  std::optional<Tick> newest;
  for (const auto& [holder, primaries] : standby_copies_) {
    const auto primary = primaries.find(region);
    if (primary == primaries.end() || !primary->second.whole()) continue;
    if (!newest || primary->second.tick() > *newest) newest = primary->second.tick();
  }
  return newest;
}

void ControlModel::HoldLog(RegionId region, bool held) {
  if (held) {
    held_logs_.insert(region);
  } else {
    held_logs_.erase(region);
  }
}

std::vector<const region::StandbyCopy*> ControlModel::PrimariesOf(RegionId holder) const {
  std::vector<const region::StandbyCopy*> primaries;
  const auto found = standby_copies_.find(holder);
  if (found == standby_copies_.end()) return primaries;
  for (const auto& [region, standby_copy] : found->second) {
    if (dead_.contains(region)) primaries.push_back(&standby_copy);
  }
  return primaries;
}

// --- Deaths.

void ControlModel::Killed(RegionId region) {
  standby_copies_.erase(region);
  if (retired_.contains(region)) return;
  ++totals_.deaths;
  if (!StandbyTick(region)) {
    for (const BodyId id : last_owned_[region]) simulation_.invariants().Excuse(id);
  }
  // Copies that it held as a standby and that were not promoted are gone with it.
  for (const RegionId dead : dead_) {
    if (StandbyTick(dead)) continue;
    for (const BodyId id : last_owned_[dead]) simulation_.invariants().Excuse(id);
  }
  dead_.insert(region);
  died_at_[region] = last_tick_[region];
  if (!failover_begun_) failover_begun_ = simulation_.timeline().now();
  After(options_.detection, [this] { BeginFailover(); });
}

void ControlModel::AssignStandbys() {
  std::vector<MapRegion> regions(map_.regions().begin(), map_.regions().end());
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i].standby == RegionId() && regions.size() > 1)
      regions[i].standby = regions[(i + 1) % regions.size()].id;
  }
  map_ = *PartitionMap::Create(map_.version(), map_.bounds(), {map_.cells().begin(), map_.cells().end()},
                               std::move(regions));
}

void ControlModel::BeginFailover() {
  std::vector<RegionId> gone;  // that the map still has
  for (const MapRegion& region : map_.regions()) {
    if (!simulation_.Alive(region.id)) gone.push_back(region.id);
  }
  if (plan_ && plan_->committed) map_ = plan_->next;  // it may be in force somewhere
  plan_.reset();
  gone.clear();
  for (const MapRegion& region : map_.regions()) {
    if (!simulation_.Alive(region.id)) gone.push_back(region.id);
  }
  if (gone.empty() || gone.size() == map_.regions().size()) return;
  map_ = *FailoverMap(map_, gone, MapVersion(++versions_));
  AssignStandbys();
  inventories_.clear();
  resumed_.clear();
  for (const MapRegion& region : map_.regions()) {
    ToWorker(region.id, [this, map = map_](SimulatedRegion& worker) {
      const auto inventory = worker.region().BeginFailover(map, PrimariesOf(worker.id()));
      if (inventory.ok()) Message([this, inventory = *inventory] { TakeInventory(inventory); });
    });
  }
}

void ControlModel::TakeInventory(const region::Inventory& inventory) {
  if (inventory.version != map_.version()) return;
  inventories_[inventory.region] = inventory;
  const bool all = std::all_of(map_.regions().begin(), map_.regions().end(),
                               [this](const MapRegion& region) { return inventories_.contains(region.id); });
  if (all) Resolved();
}

void ControlModel::Resolved() {
  std::vector<region::Inventory> inventories;
  for (const auto& [region, inventory] : inventories_) inventories.push_back(inventory);
  const std::vector<RegionId> dead(dead_.begin(), dead_.end());
  const std::set<BodyId>& expected = simulation_.invariants().expected();
  const std::vector<BodyId> bodies(expected.begin(), expected.end());
  const auto resolution = region::Resolve(map_, dead, inventories, bodies);
  if (!resolution.ok()) {
    return simulation_.invariants().Problem(simulation_.tick(), "no resolution: " + resolution.status().ToString());
  }
  for (const region::Takeover& takeover : resolution->takeovers) {
    ++(takeover.from_grant ? totals_.from_grant : totals_.adopted);
    if (takeover.from == RegionId()) continue;
    const Tick tick = *StandbyTick(takeover.from);
    totals_.max_age_ticks = std::max(totals_.max_age_ticks, died_at_[takeover.from] - tick);
  }
  for (const BodyId id : resolution->lost) simulation_.invariants().Excuse(id);
  totals_.pending += resolution->pending.size();
  totals_.lost += resolution->lost.size();
  totals_.without_copy += resolution->without_copy.size();
  for (const MapRegion& region : map_.regions()) {
    ToWorker(region.id, [this, resolution = *resolution](SimulatedRegion& worker) { Resume(worker, resolution); });
  }
}

void ControlModel::Resume(SimulatedRegion& worker, const region::Resolution& resolution) {
  if (resolution.version != map_.version() || !worker.region().halted()) return;
  Protect(worker);
  absl::StatusOr<region::StepResult> result = worker.region().Resume(resolution, PrimariesOf(worker.id()));
  if (!result.ok()) {
    return simulation_.invariants().Problem(worker.region().tick(), "no resuming: " + result.status().ToString());
  }
  for (const RegionId neighbor : worker.region().neighbors()) {
    simulation_.network().Link(worker.node(), neighbor.value());
  }
  worker.Resumed(*std::move(result));
  resumed_.insert(worker.id());
  if (resumed_.size() < map_.regions().size()) return;
  for (auto& [holder, primaries] : standby_copies_) {
    for (const RegionId dead : dead_) primaries.erase(dead);
  }
  ++totals_.failovers;
  totals_.max_gap = std::max(totals_.max_gap, simulation_.timeline().now() - *failover_begun_);
  failover_begun_.reset();
  dead_.clear();
  if (!InTransition(map_)) return;
  // The death came in the middle of a planned change: what is left of that is carried through.
  plan_ = PlanState{};
  plan_->wanted = plan_->next = map_;
  plan_->committed = true;
  WatchPlan();
}

// --- Planned maps.

void ControlModel::Plan(const PartitionMap& wanted) {
  plan_ = PlanState{};
  plan_->wanted = wanted;
  plan_->next = *TransitionMap(map_, wanted, MapVersion(++versions_));
  SendPlan();
  WatchPlan();
}

void ControlModel::SendPlan() {
  Tick newest;
  for (const auto& [id, worker] : simulation_.workers()) newest = std::max(newest, worker->region().tick());
  plan_->effective = newest + options_.lead_ticks;
  plan_->knows.clear();
  plan_->answers = 0;
  for (const MapRegion& region : map_.regions()) {
    ToWorker(region.id, [this, next = plan_->next, effective = plan_->effective](SimulatedRegion& worker) {
      const absl::Status status = worker.region().Announce(next, effective);
      for (const RegionId neighbor : next.Neighbors(worker.id())) {
        simulation_.network().Link(worker.node(), neighbor.value());
      }
      Message([this, id = worker.id(), ok = status.ok(), version = next.version(), effective] {
        if (!plan_ || plan_->next.version() != version || plan_->effective != effective) return;
        if (ok) plan_->knows.insert(id);
        if (plan_->knows.size() == map_.regions().size()) SendCommit();
      });
    });
  }
}

void ControlModel::SendCommit() {
  for (const MapRegion& region : map_.regions()) {
    ToWorker(region.id, [this, version = plan_->next.version(), effective = plan_->effective](SimulatedRegion& worker) {
      const bool ok = worker.region().Commit(version).ok();
      Message([this, ok, version, effective] {
        if (!plan_ || plan_->next.version() != version || plan_->effective != effective) return;
        ++plan_->answers;
        if (!ok) ++totals_.refused;
        if (ok && !plan_->committed) {
          plan_->committed = true;
          StartJoining();
        }
        if (plan_->answers == map_.regions().size() && !plan_->committed) SendPlan();
      });
    });
  }
}

void ControlModel::StartJoining() {
  for (const MapRegion& region : plan_->next.regions()) {
    // One that has died without anybody knowing yet is no newcomer.
    if (simulation_.Alive(region.id) || map_.HasRegion(region.id)) continue;
    retired_.erase(region.id);
    auto nothing = std::make_shared<region::RegionState>();
    nothing->tick = Tick(plan_->effective.value() - 1);
    region::Config config{region.id,   Incarnation(++incarnations_),   simulation_.scene(),
                          plan_->next, simulation_.options().settings, nothing};
    simulation_.StartWorker(std::move(config));
  }
}

// Until it is in force everywhere and, in transition, everything is where it belongs.
void ControlModel::WatchPlan() {
  After(kLook, [this, version = plan_->next.version()] {
    if (!plan_ || plan_->next.version() != version) return;
    const auto& workers = simulation_.workers();
    const bool in_force = std::all_of(workers.begin(), workers.end(), [&](const auto& entry) {
      return entry.second->region().map().version() == version;
    });
    const bool settled = std::all_of(workers.begin(), workers.end(),
                                     [](const auto& entry) { return entry.second->region().away_count() == 0; });
    if (!plan_->committed || !in_force || (InTransition(plan_->next) && !settled)) return WatchPlan();
    ++totals_.planned;
    map_ = plan_->next;
    if (InTransition(map_)) {
      plan_->next = *SettledMap(map_, MapVersion(++versions_));
      plan_->committed = false;
      SendPlan();
      return WatchPlan();
    }
    plan_.reset();
    std::vector<RegionId> empty;
    for (const auto& [id, worker] : workers) {
      if (!map_.HasRegion(id)) empty.push_back(id);
    }
    for (const RegionId id : empty) {
      retired_.insert(id);
      for (auto& [holder, primaries] : standby_copies_) primaries.erase(id);
      simulation_.Kill(id);
    }
    AssignStandbys();
    for (const auto& [id, worker] : workers) Protect(*worker);
  });
}

}  // namespace tessera::simulation
