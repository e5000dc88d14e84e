#include "tests/simulation/deployment_scenario.h"

#include "absl/strings/str_cat.h"

namespace tessera::simulation {
namespace {

constexpr Micros kLongest = Milliseconds(4000);        // that a fault lasts
constexpr Micros kEndPatience = Milliseconds(12'000);  // until another region may be taken from the world
constexpr double kNewcomersYouth = Milliseconds(600);  // in which it may be struck; its map is in force then
constexpr std::uint32_t kMostRegions = 7;
constexpr std::uint32_t kChangedAtOnce = 6;  // properties
constexpr Micros kCutTimes = 3;  // as long as other faults is a cut from a standby, so that some are given another

bool TakesRegions(DeploymentFaultKind kind) { return kind >= DeploymentFaultKind::kWorkerDies; }

class DeploymentRunner {
 public:
  explicit DeploymentRunner(const DeploymentScenario& scenario)
      : scenario_(scenario), deployment_(scenario.scene, scenario.options), hosts_(scenario.options.hosts) {}

  ScenarioOutcome Run();

 private:
  void Begin(const DeploymentFault& fault);
  void AtEnd(const DeploymentFault& fault, std::function<void()> action);
  bool Safe(const DeploymentFault& fault);
  void SetStalled(std::uint32_t host, bool stalled);
  void PlayerComesOrLeaves(std::uint32_t number);
  void ChangeProperties(std::uint32_t number);
  void CutOffStandby(const DeploymentFault& fault);

  const DeploymentScenario& scenario_;
  Deployment deployment_;
  std::uint32_t hosts_;
  bool settling_ = false;  // it is stopped and started as the deployment's own checks need
  int active_ = 0;         // faults that take regions
  std::vector<std::uint32_t> players_;
  std::int64_t last_health_ = 1;
};

// Everybody moves, and has a standby with a copy that the fault does not strike as well.
bool DeploymentRunner::Safe(const DeploymentFault& fault) {
  if (fault.kind == DeploymentFaultKind::kNewcomerDies) return active_ == 0 && deployment_.control().alive();
  // In the middle of a change a newcomer's standby may have no copy yet.
  if (active_ > 0 || !deployment_.Still()) return false;
  return StandbysOutlive(deployment_, fault.kind != DeploymentFaultKind::kWorkerDies);
}

void DeploymentRunner::AtEnd(const DeploymentFault& fault, std::function<void()> action) {
  deployment_.timeline().In(fault.lasts, std::move(action));
}

void DeploymentRunner::SetStalled(std::uint32_t host, bool stalled) {
  deployment_.network().SetStalled(AgentNode(host), stalled);
  for (SimulatedWorker* worker : deployment_.host(host).workers()) {
    deployment_.network().SetStalled(worker->node(), stalled);
  }
}

void DeploymentRunner::PlayerComesOrLeaves(std::uint32_t number) {
  if (scenario_.scene->player == std::nullopt) return;
  if (!players_.empty() && number % 3 == 0) {
    deployment_.Leave(players_.back());
    players_.pop_back();
  } else if (const auto joined = deployment_.Join(absl::StrCat("player ", number))) {
    players_.push_back(*joined);
  }
}

// Changes a property of some bodies, and of one of them twice.
void DeploymentRunner::ChangeProperties(std::uint32_t number) {
  const std::vector<BodyDef>& bodies = scenario_.scene->bodies;
  for (std::uint32_t i = 0; i < kChangedAtOnce; ++i) {
    const BodyDef& body = bodies[(number + i / 2 * 7) % bodies.size()];
    if (body.motion == Motion::kDynamic) (void)deployment_.SetHealth(body.id, ++last_health_);
  }
}

void DeploymentRunner::CutOffStandby(const DeploymentFault& fault) {
  const std::vector<SimulatedWorker*> workers = deployment_.Workers();
  if (workers.empty()) return;
  const SimulatedWorker* worker = workers[fault.whom % workers.size()];
  const SimulatedWorker* standby = deployment_.Find(worker->order().standby);
  if (standby == nullptr) return;
  const Node a = worker->node(), b = standby->node();
  deployment_.network().Cut(a, b, true);
  deployment_.timeline().In(kCutTimes * fault.lasts, [this, a, b] { deployment_.network().Cut(a, b, false); });
}

void DeploymentRunner::Begin(const DeploymentFault& fault) {
  const std::uint32_t host = fault.whom % hosts_ + 1;
  SimulatedControl& control = deployment_.control();
  const auto start_control = [this] {
    if (!settling_ && !deployment_.control().alive()) deployment_.control().Start();
  };
  const auto start_agent = [this, host] {
    if (!deployment_.host(host).agent_alive()) deployment_.host(host).StartAgent();
  };
  const auto over = [this] { --active_; };
  if (TakesRegions(fault.kind)) ++active_;
  switch (fault.kind) {
    case DeploymentFaultKind::kAgentDies:
      deployment_.host(host).KillAgent();
      return AtEnd(fault, start_agent);
    case DeploymentFaultKind::kControlDies:
      if (control.alive()) control.Kill();
      return AtEnd(fault, start_control);
    case DeploymentFaultKind::kControlDiesStored:
      control.on_died = [this, start_control, lasts = fault.lasts] { deployment_.timeline().In(lasts, start_control); };
      // The eighths say at which write, and the halves of each whether it is still written.
      if (static_cast<int>(fault.strength * 16) % 2 != 0) {
        return control.DieBeforeStore(1 + static_cast<int>(fault.strength * 8));
      }
      return control.DieAfterStores(1 + static_cast<int>(fault.strength * 8));
    case DeploymentFaultKind::kControlStandsStill:
      deployment_.network().SetStalled(kControlNode, true);
      return AtEnd(fault, [this] { deployment_.network().SetStalled(kControlNode, false); });
    case DeploymentFaultKind::kWeather:
      deployment_.network().conditions() = {.loss = fault.strength * 0.06,
                                            .delay = 300 + static_cast<Micros>(fault.strength * 3000),
                                            .jitter = static_cast<Micros>(fault.strength * 4000),
                                            .reorder = fault.strength * 0.05,
                                            .duplicate = fault.strength * 0.05};
      return AtEnd(fault, [this] { deployment_.network().conditions() = {}; });
    case DeploymentFaultKind::kPlayer:
      return PlayerComesOrLeaves(fault.whom);
    case DeploymentFaultKind::kScale:
      deployment_.Scale(1 + fault.whom % kMostRegions);
      return;
    case DeploymentFaultKind::kProperty:
      return ChangeProperties(fault.whom);
    case DeploymentFaultKind::kStandbyCutOff:
      return CutOffStandby(fault);
    case DeploymentFaultKind::kNewcomerDies:
      deployment_.Scale(deployment_.regions() % kMostRegions + 1);
      if (deployment_.RunUntil(kEndPatience, [this] { return deployment_.Newcomer() != nullptr; })) {
        deployment_.RunFor(static_cast<Micros>(fault.strength * kNewcomersYouth));
        if (const SimulatedWorker* newcomer = deployment_.Newcomer()) deployment_.Kill(*newcomer);
      }
      return AtEnd(fault, over);
    case DeploymentFaultKind::kWorkerDies: {
      const std::vector<SimulatedWorker*> workers = deployment_.Workers();
      deployment_.Kill(workers[fault.whom % workers.size()]->identity().region);
      return AtEnd(fault, over);
    }
    case DeploymentFaultKind::kHostCrashes:
      deployment_.host(host).Crash();
      return AtEnd(fault, [start_agent, over] { start_agent(), over(); });
    case DeploymentFaultKind::kHostCutOff:
      deployment_.Cut(host, true);
      return AtEnd(fault, [this, host, over] { deployment_.Cut(host, false), over(); });
    case DeploymentFaultKind::kHostStandsStill:
      SetStalled(host, true);
      return AtEnd(fault, [this, host, over] { SetStalled(host, false), over(); });
  }
}

ScenarioOutcome DeploymentRunner::Run() {
  ScenarioOutcome outcome;
  if (!deployment_.AwaitCalm()) {
    outcome.problems = {"it does not start:" + deployment_.Standing()};
    return outcome;
  }
  for (const DeploymentFault& fault : scenario_.faults) {
    deployment_.RunFor(fault.after);
    if (TakesRegions(fault.kind) && !deployment_.RunUntil(kEndPatience, [&] { return Safe(fault); })) continue;
    Begin(fault);
  }
  deployment_.RunFor(kLongest);
  deployment_.control().on_died = {};
  deployment_.control().DieAfterStores(0);
  settling_ = true;
  deployment_.Settle();
  if (deployment_.instance().lost_bodies() > 0) {
    deployment_.invariants().Problem(deployment_.tick(),
                                     absl::StrCat(deployment_.instance().lost_bodies(), " bodies lost"));
  }
  outcome.problems = deployment_.problems();
  if (!outcome.problems.empty()) outcome.problems.push_back("in the end:" + deployment_.Standing());
  outcome.totals.steps = deployment_.totals().steps;
  outcome.totals.handovers = deployment_.totals().handovers;
  outcome.totals.kills = deployment_.totals().takeovers;
  outcome.network = deployment_.network().totals();
  outcome.lost = deployment_.invariants().lost();
  outcome.doubled = deployment_.invariants().doubled();
  outcome.hash = deployment_.hash();
  return outcome;
}

}  // namespace

DeploymentScenario DrawDeployment(std::uint64_t seed) {
  const Scenario world = DrawScenario(seed, {.world = {}, .faults = false});
  Chance chance(seed ^ 0xdeb107);
  DeploymentScenario scenario;
  scenario.seed = seed;
  auto scene = std::make_shared<Scene>(*world.scene);
  scene->properties = {{"health", std::int64_t{100}}};
  scenario.scene = std::move(scene);
  scenario.options.seed = seed;
  scenario.options.settings = world.settings;
  scenario.options.hosts = static_cast<std::uint32_t>(2 + chance.Below(3));
  scenario.options.regions = static_cast<std::uint32_t>(2 + chance.Below(5));
  const std::uint64_t faults = 1 + chance.Below(5);
  for (std::uint64_t i = 0; i < faults; ++i) {
    DeploymentFault& fault = scenario.faults.emplace_back();
    fault.kind = static_cast<DeploymentFaultKind>(chance.Below(kDeploymentFaultKinds));
    fault.after = chance.Happens(0.3) ? chance.Below(Milliseconds(20)) : chance.Below(Milliseconds(1500));
    fault.lasts = chance.Happens(0.5) ? chance.Below(Milliseconds(800)) : chance.Below(kLongest);
    fault.whom = static_cast<std::uint32_t>(chance.Below(1000));
    fault.strength = chance.Unit();
  }
  return scenario;
}

std::string Describe(const DeploymentScenario& scenario) {
  return absl::StrCat("deployment of ", scenario.scene->bodies.size(), " bodies, ", scenario.options.regions,
                      " regions on ", scenario.options.hosts,
                      " hosts:", FaultsText(scenario.faults, kDeploymentFaultNames));
}

ScenarioOutcome Run(const DeploymentScenario& scenario) { return DeploymentRunner(scenario).Run(); }

}  // namespace tessera::simulation
