#include "tests/simulation/simulation.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/region/testing/kept_bodies.h"

namespace tessera::simulation {
namespace {

constexpr Micros kStepPatience = 5'000'000;  // in RunTo
constexpr Micros kSettling = Milliseconds(400);
constexpr Micros kSettlingPatience = 20'000'000;
constexpr std::uint64_t kTicksSettling = 10;
constexpr std::uint64_t kStepsBetweenChecks = 64;
constexpr double kCornerReach_m = 1;  // as far as a body is shown

// Points where three cells or more meet.
std::vector<Vec3d> CornersOf(const PartitionMap& map) {
  std::vector<Vec3d> corners;
  for (const Cell& cell : map.cells()) {
    for (const double x : {cell.area.min_x, cell.area.max_x}) {
      for (const double z : {cell.area.min_z, cell.area.max_z}) {
        const auto holds = [&](const Cell& other) {
          return other.area.min_x <= x && x <= other.area.max_x && other.area.min_z <= z && z <= other.area.max_z;
        };
        const auto cells = std::count_if(map.cells().begin(), map.cells().end(), holds);
        if (cells >= 3) corners.push_back({x, 0, z});
      }
    }
  }
  return corners;
}

}  // namespace

Simulation::Simulation(std::shared_ptr<const Scene> scene, const PartitionMap& map, const SimulationOptions& options)
    : scene_(std::move(scene)),
      map_(map),
      options_(options),
      chance_(options.seed),
      network_(timeline_, chance_.Next()),
      invariants_(*scene_),
      corners_(CornersOf(map)) {
  network_.conditions() = options.conditions;
  invariants_.set_weighs(options.weigh);
  std::uint64_t most = 0;
  for (const BodyDef& def : scene_->bodies) most = std::max(most, def.id.value());
  jointed_.resize(most + 1);
  for (const JointDef& joint : scene_->joints) {
    if (joint.body_b == BodyId()) continue;
    jointed_[joint.body_a.value()] = jointed_[joint.body_b.value()] = 1;
  }
  if (options_.attach) options_.attach(*this);
  for (const MapRegion& region : map.regions()) {
    StartWorker({region.id, Incarnation(region.id.value()), scene_, map, options.settings});
  }
}

Simulation::~Simulation() = default;

SimulatedRegion& Simulation::StartWorker(region::Config config) {
  auto& worker = workers_[config.self];
  if (options_.game) config.game = options_.game(scene_);
  worker = std::make_unique<SimulatedRegion>(timeline_, network_, std::move(config));
  worker->on_step = [this](SimulatedRegion& of, const region::StepResult& result) { Stepped(of, result); };
  worker->on_other = [this](SimulatedRegion& of, Node from, std::uint8_t kind, std::span<const std::uint8_t> bytes) {
    if (on_message) on_message(of, from, kind, bytes);
  };
  worker->on_datagram = [this, of = worker.get()](Node from, const Bytes& bytes) {
    if (on_datagram) on_datagram(*of, from, bytes);
  };
  if (on_worker_started) on_worker_started(*worker);
  worker->Start();
  return *worker;
}

void Simulation::RunFor(Micros time) {
  const Micros end = timeline_.now() + time;
  while (!timeline_.empty() && timeline_.next() <= end) timeline_.RunNext();
  timeline_.AdvanceTo(end);
}

Tick Simulation::tick() const {
  Tick lowest{~Tick::rep{0}};
  for (const auto& [id, worker] : workers_) lowest = std::min(lowest, worker->region().tick());
  return lowest;
}

std::uint64_t Simulation::Closings() const {
  std::uint64_t closings = closings_of_ended_;
  for (const auto& [id, worker] : workers_) closings += worker->totals().closings;
  return closings;
}

// Borders that closed or opened, and ticks that were adopted rather than stepped.
std::uint64_t Simulation::Unrest() const {
  std::uint64_t unrest = 0;
  for (const auto& [id, worker] : workers_) {
    const RegionTotals& totals = worker->totals();
    unrest += totals.closings + totals.openings + worker->region().tick().value() - totals.steps;
  }
  return unrest;
}

// Says who waits for whom.
std::string Simulation::Standstill() const {
  std::string text;
  for (const auto& [id, worker] : workers_) {
    const region::Region& region = worker->region();
    absl::StrAppend(&text, " region ", id.value(), " at ", region.tick().value(), " waits for");
    for (const RegionId missing : region.WaitingFor()) absl::StrAppend(&text, " ", missing.value());
    absl::StrAppend(&text, ", closed to");
    for (const RegionId neighbor : region.neighbors()) {
      if (!region.IsLinkUp(neighbor)) absl::StrAppend(&text, " ", neighbor.value());
    }
    absl::StrAppend(&text, ";");
  }
  return text;
}

void Simulation::RunTo(Tick target) {
  Tick reached = tick();
  Micros since = timeline_.now();
  while (tick() < target && timeline_.RunNext()) {
    if (tick() > reached) {
      reached = tick();
      since = timeline_.now();
    } else if (timeline_.now() - since > kStepPatience) {
      return invariants_.Problem(reached, absl::StrCat("no step for five seconds:", Standstill()));
    }
  }
}

bool Simulation::AllOpen() const {
  return std::all_of(workers_.begin(), workers_.end(), [](const auto& entry) {
    const region::Region& region = entry.second->region();
    return std::all_of(region.neighbors().begin(), region.neighbors().end(),
                       [&](RegionId neighbor) { return region.IsLinkUp(neighbor); });
  });
}

void Simulation::Settle() {
  network_.conditions() = {};
  network_.ClearCuts();
  for (const auto& [id, worker] : workers_) {
    network_.SetStalled(worker->node(), false);
    worker->set_step_time(0);
  }
  // Ticks are one again when all borders are open and no tick was adopted for a while.
  const Micros end = timeline_.now() + kSettlingPatience;
  bool calm = false;
  while (!calm && timeline_.now() < end) {
    const std::uint64_t unrest = Unrest();
    const bool open = AllOpen();
    RunFor(kSettling);
    calm = open && AllOpen() && Unrest() == unrest;
  }
  if (!calm) invariants_.Problem(tick(), absl::StrCat("borders do not come to rest:", Standstill()));
  Tick most;
  for (const auto& [id, worker] : workers_) most = std::max(most, worker->region().tick());
  for (const auto& [id, worker] : workers_) worker->set_target(most + kTicksSettling);
  RunTo(most + kTicksSettling);
  std::vector<BodyId> owned;
  for (const auto& [id, worker] : workers_) {
    if (worker->region().tick() != most + kTicksSettling) invariants_.Problem(tick(), "ticks differ at the end");
    worker->set_target(Tick(~Tick::rep{0} >> 1));
    for (const region::OwnedBody& body : worker->region().owned()) owned.push_back(body.def->id);
  }
  invariants_.CheckOwners(tick(), owned);
  CheckCopies();
}

void Simulation::Kill(RegionId region) {
  const auto worker = workers_.find(region);
  if (worker == workers_.end()) return;
  closings_of_ended_ += worker->second->totals().closings;
  workers_.erase(worker);
  ++totals_.kills;
  invariants_.Died(region);
  if (on_killed) on_killed(region);
}

void Simulation::Stall(RegionId region, Micros time) {
  network_.SetStalled(region.value(), true);
  timeline_.In(time, [this, region] { network_.SetStalled(region.value(), false); });
}

void Simulation::CutBetween(RegionId a, RegionId b, Micros time) {
  network_.Cut(a.value(), b.value(), true);
  timeline_.In(time, [this, a, b] { network_.Cut(a.value(), b.value(), false); });
}

void Simulation::SpawnPlayer(PlayerNumber player, RegionId region) {
  invariants_.Spawned(PlayerBodyId(player));
  workers_.at(region)->region().SpawnPlayer(player);
}

void Simulation::RemovePlayer(PlayerNumber player) {
  invariants_.Removing(PlayerBodyId(player));
  for (const auto& [id, worker] : workers_) worker->region().RemovePlayer(player);
}

void Simulation::Stepped(SimulatedRegion& worker, const region::StepResult& result) {
  ++totals_.steps;
  totals_.nonfinite += result.nonfinite.size();
  invariants_.Stepped(worker.id(), result.tick, worker.region().owned(), result);
  if (options_.game) invariants_.Told(worker.region());
  CountHandovers(worker, result);
  if (on_step) on_step(worker, result);
  if (totals_.steps % kStepsBetweenChecks == 0) CheckCopies();
}

void Simulation::CountHandovers(SimulatedRegion& worker, const region::StepResult& result) {
  if (result.handed_out == 0) return;
  for (const region::Departure& departure : result.departures) {
    if (departure.reason != region::DepartureReason::kHandedOver) continue;
    ++totals_.handovers;
    const std::uint64_t id = departure.body.value();
    if (id < jointed_.size() && jointed_[id] != 0) ++totals_.assembly_handovers;
    if (!worker.region().world().Has(departure.body)) continue;
    const Vec3d place = worker.region().world().StateOf(departure.body).position;
    const auto near = [&](Vec3d corner) {
      return std::max(std::abs(place.x - corner.x), std::abs(place.z - corner.z)) < kCornerReach_m;
    };
    if (std::any_of(corners_.begin(), corners_.end(), near)) ++totals_.corner_handovers;
  }
}

void Simulation::CheckCopies() {
  std::vector<BodyId> held;
  for (const auto& [id, worker] : workers_) {
    for (const region::OwnedBody& body : worker->region().owned()) held.push_back(body.def->id);
    for (const BodyId kept : region::KeptBodies(worker->region())) held.push_back(kept);
  }
  if (more_copies) more_copies(held);
  invariants_.CheckCopies(tick(), held);
}

RegionId Simulation::OwnerOf(BodyId id) const {
  for (const auto& [region, worker] : workers_) {
    if (worker->region().Owns(id)) return region;
  }
  return RegionId();
}

std::map<BodyId, BodyState> Simulation::States() const {
  std::map<BodyId, BodyState> states;
  for (const auto& [region, worker] : workers_) {
    for (const region::OwnedBody& body : worker->region().owned()) states[body.def->id] = body.state;
  }
  return states;
}

}  // namespace tessera::simulation
