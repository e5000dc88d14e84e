#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "tests/simulation/player_client.h"
#include "tests/simulation/scenario.h"

namespace tessera::simulation {
namespace {

constexpr Micros kAftermath = Milliseconds(300);  // of a fault that strikes once
constexpr double kMostDrift = 1e-5;               // of momentum, share of the sum of all
constexpr std::size_t kTicksWeighed = 8;          // at both ends: what contacts exchange is a tick under way
constexpr double kTicksPerSecond = 60;

// One run: puts faults on and takes them off, plays the players, counts.
class Runner {
 public:
  Runner(const Scenario& scenario, std::uint64_t network_seed)
      : scenario_(scenario),
        simulation_(scenario.scene, scenario.map,
                    {.seed = network_seed,
                     .settings = scenario.settings,
                     .weigh = scenario.closed,
                     .attach = [this](Simulation& simulation) { Attach(simulation); }}) {}

  Outcome Run();

 private:
  void Attach(Simulation& simulation);
  void PlanFaults();
  void PlanPlayers();
  void Begin(const Fault& fault);
  void End(const Fault& fault);
  void MakeWeather();
  bool Strikes(const Fault& fault, RegionId from, RegionId to) const;
  void TellPlayers(Worker& worker);
  void WeighClosed(Outcome& outcome);

  const Scenario& scenario_;
  std::array<std::uint64_t, kFaultKinds> handovers_under_{};
  std::vector<const Fault*> active_;
  std::map<BodyId, std::pair<Epoch, std::uint32_t>> last_inputs_;
  Simulation simulation_;
  std::vector<std::unique_ptr<PlayerClient>> clients_;  // end before their network
};

void Runner::Attach(Simulation& simulation) {
  simulation.on_step = [this](Worker& worker, const region::StepResult& result) {
    for (const region::Departure& departure : result.departures) {
      if (departure.reason != region::DepartureReason::kHandedOver) continue;
      for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
        const bool struck = std::any_of(active_.begin(), active_.end(), [&](const Fault* fault) {
          return static_cast<std::size_t>(fault->kind) == kind && Strikes(*fault, worker.id(), departure.to);
        });
        handovers_under_[kind] += struck ? 1 : 0;
      }
    }
    TellPlayers(worker);
  };
  simulation.on_datagram = [](Worker& worker, Node from, const Bytes& bytes) {
    const PlayerNumber player(from - ClientNode(PlayerNumber(0)));
    for (const region::PlayerInput& input : PlayerClient::Read(player, bytes)) (void)worker.region().QueueInput(input);
  };
}

bool Runner::Strikes(const Fault& fault, RegionId from, RegionId to) const {
  switch (fault.kind) {
    case FaultKind::kBreak:
      return std::minmax(from, to) == std::minmax(fault.a, fault.b);
    case FaultKind::kPartition:
      return (from <= fault.a) != (to <= fault.a);
    case FaultKind::kStall:
    case FaultKind::kSlow:
      return from == fault.a || to == fault.a;
    default:
      return true;
  }
}

void Runner::PlanFaults() {
  for (const Fault& fault : scenario_.faults) {
    const bool once =
        fault.kind == FaultKind::kBreak || fault.kind == FaultKind::kPartition || fault.kind == FaultKind::kStall;
    simulation_.timeline().At(fault.from, [this, &fault] { Begin(fault); });
    simulation_.timeline().At(fault.until, [this, &fault] { End(fault); });
    simulation_.timeline().At(fault.until + (once ? kAftermath : 0), [this, &fault] { std::erase(active_, &fault); });
  }
}

void Runner::Begin(const Fault& fault) {
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
      return MakeWeather();
  }
}

void Runner::End(const Fault& fault) {
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
      return MakeWeather();
  }
}

void Runner::MakeWeather() {
  Weather weather;
  for (const Fault* fault : active_) {
    const auto stronger = [&](auto& what) {
      what = std::max(what, static_cast<std::remove_reference_t<decltype(what)>>(fault->strength));
    };
    switch (fault->kind) {
      case FaultKind::kLoss:
        stronger(weather.loss);
        break;
      case FaultKind::kDelay:
        stronger(weather.delay);
        break;
      case FaultKind::kJitter:
        stronger(weather.jitter);
        break;
      case FaultKind::kReorder:
        stronger(weather.reorder);
        break;
      case FaultKind::kDuplicate:
        stronger(weather.duplicate);
        break;
      default:
        break;
    }
  }
  simulation_.network().weather() = weather;
}

void Runner::PlanPlayers() {
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

void Runner::TellPlayers(Worker& worker) {
  if (scenario_.players == 0) return;
  for (const region::OwnedBody& body : worker.region().owned()) {
    const BodyId id = body.def->id;
    if (!IsPlayerBody(id)) continue;
    const std::uint32_t last = worker.region().LastInput(PlayerOf(id));
    auto& [epoch, before] = last_inputs_[id];
    if (body.epoch >= epoch && last < before) {
      simulation_.ledger().Problem(worker.region().tick(),
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
void Runner::WeighClosed(Outcome& outcome) {
  const std::size_t regions = scenario_.map.regions().size();
  std::vector<Motions> whole;
  for (const auto& [tick, motions] : simulation_.ledger().motions()) {
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
    simulation_.ledger().Problem(simulation_.tick(), absl::StrCat("momentum drifted by ", drift));
  }
  if (whole.back().energy_j > whole.front().energy_j * 1.02 + 1e-3) {
    simulation_.ledger().Problem(simulation_.tick(), absl::StrCat("energy grew from ", whole.front().energy_j, " to ",
                                                                  whole.back().energy_j, " J"));
  }
}

Outcome Runner::Run() {
  PlanFaults();
  PlanPlayers();
  if (scenario_.faults.empty()) {
    for (auto& [id, worker] : simulation_.workers()) worker->set_target(Tick(scenario_.ticks));
    simulation_.RunTo(Tick(scenario_.ticks));
  } else {
    simulation_.RunFor(static_cast<Micros>(static_cast<double>(scenario_.ticks) * 1e6 / kTicksPerSecond));
    Micros last = 0;
    for (const Fault& fault : scenario_.faults) last = std::max(last, fault.until);
    if (last > simulation_.timeline().now()) simulation_.RunFor(last - simulation_.timeline().now());
    simulation_.Settle();
  }
  Outcome outcome;
  for (const auto& [id, worker] : simulation_.workers()) {
    outcome.closings += worker->totals().closings;
    outcome.openings += worker->totals().openings;
    for (const auto& [why, count] : worker->totals().refused) {
      simulation_.ledger().Problem(worker->region().tick(), absl::StrCat(count, " frames were refused: ", why));
    }
  }
  if (scenario_.closed && outcome.closings == 0) WeighClosed(outcome);
  if (simulation_.totals().nonfinite > 0) {
    simulation_.ledger().Problem(simulation_.tick(), "bodies were taken out because they were not finite");
  }
  outcome.problems = simulation_.problems();
  outcome.totals = simulation_.totals();
  outcome.network = simulation_.network().totals();
  outcome.handovers_under = handovers_under_;
  outcome.lost = simulation_.ledger().lost();
  outcome.doubled = simulation_.ledger().doubled();
  outcome.hash = simulation_.hash();
  return outcome;
}

}  // namespace

Outcome Run(const Scenario& scenario, std::optional<std::uint64_t> network_seed) {
  return Runner(scenario, network_seed.value_or(scenario.seed)).Run();
}

}  // namespace tessera::simulation
