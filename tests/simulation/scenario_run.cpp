#include <algorithm>
#include <limits>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/region/testing/kept_bodies.h"
#include "tests/simulation/player_client.h"
#include "tests/simulation/scenario.h"

namespace tessera::simulation {
namespace {

constexpr Micros kAftermath = Milliseconds(300);    // after a fault that strikes once
constexpr Micros kLookInterval = Milliseconds(10);  // between looks at a death or a change under way
constexpr Micros kChangePatience = 10'000'000;      // until all of them must have ended
constexpr std::size_t kFewest = 2;                  // regions that deaths leave
constexpr double kMostDrift = 1e-5;                 // in momentum, share of the sum of all
constexpr std::size_t kTicksWeighed = 8;            // at both ends: what contacts exchange is a tick under way
constexpr double kTicksPerSecond = 60;

// One run: puts faults on and takes them off, plays the players, counts.
class ScenarioRunner {
 public:
  ScenarioRunner(const Scenario& scenario, std::uint64_t network_seed)
      : scenario_(scenario),
        simulation_(scenario.scene, scenario.map,
                    {.seed = network_seed,
                     .settings = scenario.settings,
                     .weigh = scenario.closed,
                     .attach = [this](Simulation& simulation) { Attach(simulation); }}) {}

  ScenarioOutcome Run();

 private:
  void Attach(Simulation& simulation);
  void PlanFaults();
  void PlanPlayers();
  void Begin(const ScheduledFault& fault);
  void End(const ScheduledFault& fault);
  void ApplyConditions();
  static bool Strikes(const ScheduledFault& fault, RegionId from, RegionId to);
  void TellPlayers(SimulatedRegion& worker);
  void WeighClosed(ScenarioOutcome& outcome);
  bool HasDeaths() const;
  void TryKill(const ScheduledFault& fault);
  void TryRestart(const ScheduledFault& fault);
  void WatchUntilOver(const ScheduledFault& fault);
  bool MayDie(RegionId region) const;
  std::uint64_t HandoversUnderWay(RegionId region) const;
  void AwaitControl();

  const Scenario& scenario_;
  std::array<std::uint64_t, kFaultKinds> handovers_under_{};
  std::vector<const ScheduledFault*> active_;
  std::map<BodyId, std::pair<Epoch, std::uint32_t>> last_inputs_;
  std::map<std::pair<RegionId, BodyId>, RegionId> granted_to_;  // by whom and what: the last time
  std::uint64_t cut_short_ = 0;
  std::unique_ptr<ControlModel> control_;  // where workers die
  Simulation simulation_;
  std::vector<std::unique_ptr<PlayerClient>> clients_;  // end before their network
};

// Whether a frame was refused because it was on its way when a failover's map came into force.
bool IsOfAnotherMap(const std::string& why) {
  return absl::StartsWith(why, "map version") || absl::EndsWith(why, "is not a neighbour");
}

// The last frame before an offer, said again on a new connection: the one before it is kept no more.
bool IsOfAClosedBorder(const std::string& why) { return absl::StrContains(why, "came before its time"); }

bool ScenarioRunner::HasDeaths() const {
  return std::ranges::any_of(scenario_.faults,
                             [](const ScheduledFault& fault) { return fault.kind == FaultKind::kKill; });
}

void ScenarioRunner::Attach(Simulation& simulation) {
  if (HasDeaths()) control_ = std::make_unique<ControlModel>(simulation, scenario_.map);
  simulation.on_step = [this, before = simulation.on_step](SimulatedRegion& worker, const region::StepResult& result) {
    if (before) before(worker, result);
    for (const region::Departure& departure : result.departures) {
      // A failover lets go of bodies as well.
      if (departure.reason != region::DepartureReason::kHandedOver || result.handed_out == 0) continue;
      granted_to_[{worker.id(), departure.body}] = departure.to;
      for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
        const bool struck = std::any_of(active_.begin(), active_.end(), [&](const ScheduledFault* fault) {
          return static_cast<std::size_t>(fault->kind) == kind && Strikes(*fault, worker.id(), departure.to);
        });
        handovers_under_[kind] += struck ? 1 : 0;
      }
    }
    TellPlayers(worker);
  };
  simulation.on_datagram = [](SimulatedRegion& worker, Node from, const Bytes& bytes) {
    const PlayerNumber player(from - ClientNode(PlayerNumber(0)));
    for (const PlayerInput& input : PlayerClient::Read(player, bytes)) (void)worker.region().QueueInput(input);
  };
}

// Regions in step wait for each other, so what holds one of them up is felt by all; only a broken connection is not.
bool ScenarioRunner::Strikes(const ScheduledFault& fault, RegionId from, RegionId to) {
  return fault.kind != FaultKind::kBreak || std::minmax(from, to) == std::minmax(fault.a, fault.b);
}

void ScenarioRunner::PlanFaults() {
  for (const ScheduledFault& fault : scenario_.faults) {
    const bool once =
        fault.kind == FaultKind::kBreak || fault.kind == FaultKind::kPartition || fault.kind == FaultKind::kStall;
    if (fault.kind == FaultKind::kKill || fault.kind == FaultKind::kRestart) {
      simulation_.timeline().At(
          fault.from, [this, &fault] { fault.kind == FaultKind::kKill ? TryKill(fault) : TryRestart(fault); });
      continue;
    }
    simulation_.timeline().At(fault.from, [this, &fault] { Begin(fault); });
    simulation_.timeline().At(fault.until, [this, &fault] { End(fault); });
    simulation_.timeline().At(fault.until + (once ? kAftermath : 0), [this, &fault] { std::erase(active_, &fault); });
  }
}

void ScenarioRunner::Begin(const ScheduledFault& fault) {
  active_.push_back(&fault);
  VirtualNetwork& network = simulation_.network();
  switch (fault.kind) {
    case FaultKind::kBreak:
      return network.Break(fault.a.value(), fault.b.value());
    case FaultKind::kPartition:
      for (const MapRegion& one : scenario_.map.regions()) {
        for (const MapRegion& other : scenario_.map.regions()) {
          if (one.id <= fault.a && other.id > fault.a) network.Cut(one.id.value(), other.id.value(), true);
        }
      }
      return;
    case FaultKind::kStall:
      return network.SetStalled(fault.a.value(), true);
    case FaultKind::kSlow:
      if (simulation_.Alive(fault.a)) {
        simulation_.worker(fault.a.value()).set_step_time(static_cast<Micros>(fault.strength));
      }
      return;
    default:
      return ApplyConditions();
  }
}

void ScenarioRunner::End(const ScheduledFault& fault) {
  VirtualNetwork& network = simulation_.network();
  switch (fault.kind) {
    case FaultKind::kBreak:
      return;
    case FaultKind::kPartition:
      return network.ClearCuts();
    case FaultKind::kStall:
      return network.SetStalled(fault.a.value(), false);
    case FaultKind::kSlow:
      if (simulation_.Alive(fault.a)) simulation_.worker(fault.a.value()).set_step_time(0);
      return;
    default:
      std::erase(active_, &fault);
      return ApplyConditions();
  }
}

// One that dies before its standby has a copy, or while others are dying, is lost rightly: failover_test has those.
bool ScenarioRunner::MayDie(RegionId region) const {
  const auto& workers = simulation_.workers();
  return simulation_.Alive(region) && workers.size() > kFewest && !control_->failing_over() &&
         std::ranges::all_of(workers, [](const auto& entry) { return entry.second->region().acknowledged() > Tick(); });
}

// That it keeps as granter, or others keep for it.
std::uint64_t ScenarioRunner::HandoversUnderWay(RegionId region) const {
  std::uint64_t count = 0;
  for (const auto& [id, worker] : simulation_.workers()) {
    for (const BodyId body : region::KeptBodies(worker->region())) {
      const auto to = granted_to_.find({id, body});
      count += id == region || (to != granted_to_.end() && to->second == region) ? 1 : 0;
    }
  }
  return count;
}

void ScenarioRunner::TryKill(const ScheduledFault& fault) {
  if (simulation_.timeline().now() > fault.until) return;
  if (!MayDie(fault.a)) return simulation_.timeline().In(kLookInterval, [this, &fault] { TryKill(fault); });
  cut_short_ += HandoversUnderWay(fault.a);
  simulation_.Kill(fault.a);
  active_.push_back(&fault);
  WatchUntilOver(fault);
}

void ScenarioRunner::TryRestart(const ScheduledFault& fault) {
  if (simulation_.timeline().now() > fault.until) return;
  const bool some_dead = simulation_.workers().size() < scenario_.map.regions().size();
  if (!control_->idle() || !some_dead) {
    return simulation_.timeline().In(kLookInterval, [this, &fault] { TryRestart(fault); });
  }
  control_->Plan(scenario_.map);
  active_.push_back(&fault);
  WatchUntilOver(fault);
}

void ScenarioRunner::WatchUntilOver(const ScheduledFault& fault) {
  simulation_.timeline().In(kLookInterval, [this, &fault] {
    const bool over = fault.kind == FaultKind::kKill ? !control_->failing_over() : control_->idle();
    if (!over) return WatchUntilOver(fault);
    simulation_.timeline().In(kAftermath, [this, &fault] { std::erase(active_, &fault); });
  });
}

// Deaths and changes that began are dealt with.
void ScenarioRunner::AwaitControl() {
  const Micros end = simulation_.timeline().now() + kChangePatience;
  while (!control_->idle() && simulation_.timeline().now() < end) simulation_.RunFor(kLookInterval);
  if (!control_->idle())
    simulation_.invariants().Problem(simulation_.tick(), "a failover or a planned map does not end");
  if (control_->totals().lost > 0) {
    simulation_.invariants().Problem(simulation_.tick(),
                                     absl::StrCat(control_->totals().lost, " bodies lost by failovers"));
  }
}

void ScenarioRunner::ApplyConditions() {
  PacketConditions conditions;
  for (const ScheduledFault* fault : active_) {
    const auto stronger = [&](auto& what) {
      what = std::max(what, static_cast<std::remove_reference_t<decltype(what)>>(fault->strength));
    };
    switch (fault->kind) {
      case FaultKind::kLoss:
        stronger(conditions.loss);
        break;
      case FaultKind::kDelay:
        stronger(conditions.delay);
        break;
      case FaultKind::kJitter:
        stronger(conditions.jitter);
        break;
      case FaultKind::kReorder:
        stronger(conditions.reorder);
        break;
      case FaultKind::kDuplicate:
        stronger(conditions.duplicate);
        break;
      default:
        break;
    }
  }
  simulation_.network().conditions() = conditions;
}

void ScenarioRunner::PlanPlayers() {
  for (std::uint32_t n = 1; n <= scenario_.players; ++n) {
    const PlayerNumber player(n);
    const Micros joins = Milliseconds(200) * n;
    simulation_.timeline().At(joins, [this, player] {
      const Vec3d place = scenario_.scene->player->spawn_points[(player.value() - 1) % 6];
      // Every third one where its place is somebody else's: it has to be handed over at once.
      const RegionId any = scenario_.map.regions()[player.value() % scenario_.map.regions().size()].id;
      simulation_.SpawnPlayer(player, player.value() % 3 == 0 ? any : scenario_.map.OwnerOf(place));
      clients_.push_back(std::make_unique<PlayerClient>(simulation_.timeline(), simulation_.network(),
                                                        ClientNode(player), scenario_.seed + player.value(),
                                                        scenario_.scene->player->max_force_n * 1.5));
    });
    if (n % 2 == 0) {
      simulation_.timeline().At(joins + Milliseconds(1700), [this, player] { simulation_.RemovePlayer(player); });
    }
  }
}

void ScenarioRunner::TellPlayers(SimulatedRegion& worker) {
  if (scenario_.players == 0) return;
  for (const region::OwnedBody& body : worker.region().owned()) {
    const BodyId id = body.def->id;
    if (!IsPlayerBody(id)) continue;
    const std::uint32_t last = worker.region().LastInput(PlayerOf(id));
    auto& [epoch, before] = last_inputs_[id];
    if (body.epoch >= epoch && last < before) {
      simulation_.invariants().Problem(worker.region().tick(),
                                       absl::StrCat("body ", id.value(), ": last input ", last, " after ", before));
    }
    if (body.epoch >= epoch) {
      epoch = body.epoch;
      before = last;
    }
    simulation_.network().SendDatagram(worker.node(), ClientNode(PlayerOf(id)),
                                       PlayerClient::Tell(worker.id(), body.epoch, last));
  }
}

// Between the first ticks and the last ones, at the best of each: an impulse may be settled a tick later on one side.
void ScenarioRunner::WeighClosed(ScenarioOutcome& outcome) {
  const std::size_t regions = scenario_.map.regions().size();
  std::vector<Motions> whole;
  for (const auto& [tick, motions] : simulation_.invariants().motions()) {
    if (motions.regions == regions && motions.bodies > 0) whole.push_back(motions);
  }
  if (whole.size() < 2 * kTicksWeighed) return;
  double drift = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kTicksWeighed; ++i) {
    const Vec3d change = whole[whole.size() - 1 - i].momentum - whole.front().momentum;
    drift = std::min(drift, Length(change) / whole.front().size);
  }
  outcome.momentum_drift = drift;
  if (drift > kMostDrift) {
    simulation_.invariants().Problem(simulation_.tick(), absl::StrCat("momentum drifted by ", drift));
  }
  if (whole.back().energy_j > whole.front().energy_j * 1.02 + 1e-3) {
    simulation_.invariants().Problem(simulation_.tick(), absl::StrCat("energy grew from ", whole.front().energy_j,
                                                                      " to ", whole.back().energy_j, " J"));
  }
}

ScenarioOutcome ScenarioRunner::Run() {
  PlanFaults();
  PlanPlayers();
  if (scenario_.faults.empty()) {
    for (auto& [id, worker] : simulation_.workers()) worker->set_target(Tick(scenario_.ticks));
    simulation_.RunTo(Tick(scenario_.ticks));
  } else {
    simulation_.RunFor(static_cast<Micros>(static_cast<double>(scenario_.ticks) * 1e6 / kTicksPerSecond));
    Micros last = 0;
    for (const ScheduledFault& fault : scenario_.faults) last = std::max(last, fault.until);
    if (last > simulation_.timeline().now()) simulation_.RunFor(last - simulation_.timeline().now());
    if (control_) AwaitControl();
    simulation_.Settle();
  }
  ScenarioOutcome outcome;
  outcome.totals = simulation_.totals();
  for (const auto& [id, worker] : simulation_.workers()) {
    outcome.closings += worker->totals().closings;
    outcome.openings += worker->totals().openings;
  }
  for (const auto& [id, worker] : simulation_.workers()) {
    for (const auto& [why, count] : worker->totals().refused) {
      if (control_ && IsOfAnotherMap(why)) continue;
      if (outcome.closings > 0 && IsOfAClosedBorder(why)) continue;
      simulation_.invariants().Problem(worker->region().tick(), absl::StrCat(count, " frames were refused: ", why));
    }
  }
  if (control_) outcome.control = control_->totals();
  outcome.cut_short = cut_short_;
  if (scenario_.closed && outcome.closings == 0 && outcome.totals.kills == 0) WeighClosed(outcome);
  if (simulation_.totals().nonfinite > 0) {
    simulation_.invariants().Problem(simulation_.tick(), "bodies were taken out because they were not finite");
  }
  outcome.problems = simulation_.problems();
  outcome.network = simulation_.network().totals();
  outcome.handovers_under = handovers_under_;
  outcome.lost = simulation_.invariants().lost();
  outcome.doubled = simulation_.invariants().doubled();
  outcome.hash = simulation_.hash();
  return outcome;
}

}  // namespace

ScenarioOutcome Run(const Scenario& scenario, std::optional<std::uint64_t> network_seed) {
  return ScenarioRunner(scenario, network_seed.value_or(scenario.seed)).Run();
}

}  // namespace tessera::simulation
