#include "tests/simulation/leader_scenario.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/simulation/scene_builder.h"
#include "tests/simulation/world_watch.h"

namespace tessera::simulation {
namespace {

constexpr double kLeadersHalf_m = 20;  // half the ground's side
constexpr Micros kShortestFault = Milliseconds(50), kLongestFault = Milliseconds(4000);
constexpr Micros kStopAtMost = Milliseconds(8000);       // twice the leader's lease, so that some come back deposed
constexpr Micros kQuietPatience = Milliseconds(12'000);  // until another region may be taken from the world
constexpr Micros kSlowestWrite = Milliseconds(2000);
constexpr Micros kLostAtMost = Milliseconds(6000);        // beyond etcd's patience its author never knows
constexpr Micros kBetweenChanges = Milliseconds(250);     // that are asked for
constexpr Micros kLeaderPatience = Milliseconds(20'000);  // in the end
constexpr Micros kRelapse = Milliseconds(3000);           // after a fault, in which a leader may still speak of it
constexpr std::uint32_t kMostLeaderRegions = 5;

constexpr std::uint64_t kKindsWithoutClocks = static_cast<std::uint64_t>(LeaderFaultKind::kLeaderClockMoved);
constexpr double kClockAtMost_h = 48;
constexpr double kClockMoves = 0.25;  // share of the seeds in which one does

bool MovesAClock(LeaderFaultKind kind) { return kind >= LeaderFaultKind::kLeaderClockMoved; }
bool OneAtATime(LeaderFaultKind kind) { return kind >= LeaderFaultKind::kLeaderCutFromHosts && !MovesAClock(kind); }
bool TakesARegion(LeaderFaultKind kind) { return kind >= LeaderFaultKind::kLeaderCutOffWithHost && !MovesAClock(kind); }

void StartAgain(SimulatedControl& control) {
  if (!control.running()) control.Start();
}

class LeaderRunner {
 public:
  explicit LeaderRunner(const LeaderScenario& scenario);
  LeaderOutcome Run();

 private:
  bool Begin(const LeaderFault& fault);
  bool BeginAtControls(const LeaderFault& fault);
  bool BeginAtStore(const LeaderFault& fault);
  bool BeginBetween(const LeaderFault& fault);
  bool MoveClock(const LeaderFault& fault);
  bool BeginAtWorld(const LeaderFault& fault);
  bool Safe(const LeaderFault& fault);
  void AtEnd(Micros lasts, std::function<void()> action);
  void PutBackBackup();
  void EndFaults();
  void RunFor(Micros span);
  void AskForChange();
  std::set<std::string> Changes() const;
  bool HearsAllHosts(const SimulatedControl& control);
  bool Sees(const SimulatedControl& control);
  void Conclude(LeaderOutcome& outcome);

  const LeaderScenario& scenario_;
  Deployment deployment_;
  WorldWatch watch_;
  LeaderOutcome outcome_;
  bool ended_ = false;  // all that faults had still to end is ended
  int active_ = 0;      // faults of which there is one at a time
  std::string backup_;
  std::set<std::string> in_backup_;
  bool restored_ = false;
  std::uint64_t asked_ = 0;
  Micros ask_at_ = 0, amiss_at_ = 0;
};

std::shared_ptr<const Scene> SceneOf(const LeaderScenario& scenario) {
  return Swarm(kLeadersHalf_m, scenario.balls).Build();
}

LeaderRunner::LeaderRunner(const LeaderScenario& scenario)
    : scenario_(scenario), deployment_(SceneOf(scenario), scenario.options), watch_(deployment_, kLeaderBounds) {
  watch_.sees = [this](const SimulatedControl& control) { return Sees(control); };
}

// --- What is asked of the control planes, and what they can know.

void LeaderRunner::RunFor(Micros span) {
  const Micros end = deployment_.timeline().now() + span;
  while (deployment_.timeline().now() < end) {
    watch_.RunFor(std::min(WorldWatch::kLook, end - deployment_.timeline().now()));
    if (deployment_.timeline().now() < ask_at_) continue;
    ask_at_ = deployment_.timeline().now() + kBetweenChanges;
    AskForChange();
  }
}

// Whoever answers is asked, also one that was deposed and does not know it yet.
void LeaderRunner::AskForChange() {
  for (const auto& asked : deployment_.controls()) {
    if (!asked->answers()) continue;
    v1::CreateTokenRequest request;
    request.set_name(absl::StrCat("token-", ++asked_));
    request.set_role(v1::ROLE_VIEWER);
    const bool taken = asked->Call([&](control::Cluster& cluster, control::Now now) {
      return !cluster.state().recovering() && cluster.CreateToken(now, request).ok();
    });
    if (!taken) continue;
    ++outcome_.acknowledged;
    watch_.words().Acknowledged(request.name());
  }
}

std::set<std::string> LeaderRunner::Changes() const {
  std::set<std::string> names;
  if (!deployment_.control().alive()) return names;
  const v1::ListTokensResponse tokens = deployment_.control().cluster().tokens().List();
  for (const v1::AccessToken& token : tokens.tokens()) names.insert(token.name());
  return names;
}

bool LeaderRunner::HearsAllHosts(const SimulatedControl& control) {
  for (std::uint32_t host = 1; host <= scenario_.options.hosts; ++host) {
    if (deployment_.HostAt(host).attached_to() != control.number()) return false;
  }
  return true;
}

// Whether nothing is amiss but what it says, for a while.
bool LeaderRunner::Sees(const SimulatedControl& control) {
  const Micros now = deployment_.timeline().now();
  bool well = active_ == 0 && !deployment_.store().full() && deployment_.store().write_time() == 0;
  well = well && HearsAllHosts(control);
  for (const SimulatedWorker* worker : deployment_.Workers()) well = well && worker->Protected();
  if (!well) amiss_at_ = now;
  return now - amiss_at_ > kRelapse;
}

// --- Faults.

void LeaderRunner::AtEnd(Micros lasts, std::function<void()> action) {
  deployment_.timeline().In(lasts, [this, action = std::move(action)] {
    if (!ended_) action();
  });
}

// Everybody moves, and has a standby with a copy that the fault does not strike as well. A leader that does not hear a
// host yet would take a death elsewhere for the second of two.
bool LeaderRunner::Safe(const LeaderFault& fault) {
  if (active_ > 0 || !deployment_.Still()) return false;
  if (!TakesARegion(fault.kind)) return true;
  const SimulatedControl& leader = deployment_.control();
  if (leader.answers() && !HearsAllHosts(leader)) return false;
  return StandbysOutlive(deployment_, fault.kind != LeaderFaultKind::kWorkerDies);
}

// False: there is nobody whom it could strike.
bool LeaderRunner::Begin(const LeaderFault& fault) {
  if (MovesAClock(fault.kind)) return MoveClock(fault);
  if (fault.kind <= LeaderFaultKind::kFollowerKilled) return BeginAtControls(fault);
  if (fault.kind <= LeaderFaultKind::kOldBackup) return BeginAtStore(fault);
  if (fault.kind <= LeaderFaultKind::kScale || fault.kind >= LeaderFaultKind::kWorkerDies) return BeginAtWorld(fault);
  return BeginBetween(fault);
}

bool LeaderRunner::BeginAtControls(const LeaderFault& fault) {
  SimulatedControl* const leader = &deployment_.control();
  VirtualNetwork& network = deployment_.network();
  if (fault.kind == LeaderFaultKind::kFollowerKilled) {
    SimulatedControl* const follower = deployment_.controls()[fault.whom % deployment_.controls().size()].get();
    if (follower == leader || !follower->running()) return false;
    follower->Kill();
    AtEnd(fault.lasts, [follower] { StartAgain(*follower); });
    return true;
  }
  if (!leader->alive() || leader->stopped()) return false;
  if (fault.kind == LeaderFaultKind::kLeaderKilled) {
    leader->Kill();
    AtEnd(fault.lasts, [leader] { StartAgain(*leader); });
    return true;
  }
  if (fault.kind == LeaderFaultKind::kLeaderStopped) {
    leader->SetStopped(true);
    AtEnd(std::min(2 * fault.lasts, kStopAtMost), [leader] { leader->SetStopped(false); });
    return true;
  }
  network.Cut(leader->node(), kStoreNode, true);
  AtEnd(2 * fault.lasts, [&network, leader] { network.Cut(leader->node(), kStoreNode, false); });
  return true;
}

// One hour to two days, either way. A machine's clock outlives what runs there.
bool LeaderRunner::MoveClock(const LeaderFault& fault) {
  SimulatedControl* control = &deployment_.control();
  if (fault.kind == LeaderFaultKind::kFollowerClockMoved) {
    const auto& controls = deployment_.controls();
    control = controls[(control->number() + fault.whom % (controls.size() - 1)) % controls.size()].get();
  }
  const double share = 2 * fault.strength - 1;
  const int hours = static_cast<int>(share * (kClockAtMost_h - 1)) + (share < 0 ? -1 : 1);
  control->MoveClock(std::chrono::hours(hours));
  AtEnd(fault.lasts, [control, hours] { control->MoveClock(std::chrono::hours(-hours)); });
  return true;
}

bool LeaderRunner::BeginAtStore(const LeaderFault& fault) {
  SimulatedStore& store = deployment_.store();
  switch (fault.kind) {
    case LeaderFaultKind::kStoreSlow:
      store.SetWriteTime(1 + static_cast<Micros>(fault.strength * static_cast<double>(kSlowestWrite)));
      AtEnd(fault.lasts, [&store] { store.SetWriteTime(0); });
      return true;
    case LeaderFaultKind::kStoreFull:
      store.SetFull(true);
      AtEnd(fault.lasts, [&store] { store.SetFull(false); });
      return true;
    case LeaderFaultKind::kAnswerLost:
      store.LoseAnswer(fault.whom % 2 == 0, static_cast<Micros>(fault.strength * static_cast<double>(kLostAtMost)));
      return true;
    case LeaderFaultKind::kLeaseRevoked:
      if (store.token() == 0) return false;
      store.RevokeEarly();
      return true;
    default:
      PutBackBackup();
      return true;
  }
}

void LeaderRunner::PutBackBackup() {
  restored_ = true;
  watch_.words().PutBack(in_backup_);
  deployment_.BeginFrom(backup_);
}

bool LeaderRunner::BeginBetween(const LeaderFault& fault) {
  SimulatedControl* const leader = &deployment_.control();
  VirtualNetwork& network = deployment_.network();
  const std::uint32_t chosen = fault.whom % scenario_.options.hosts + 1;
  const Node self = leader->node();
  std::uint32_t first = 1, last = scenario_.options.hosts;  // range of hosts
  std::vector<std::pair<Node, Node>> cut;                   // from, to
  if (!leader->alive()) return false;
  if (TakesARegion(fault.kind)) {
    const std::uint32_t place = PlaceOfControl(leader->number());
    network.MovePlace(place, 1);
    network.MovePlace(chosen, 1);
    if (fault.kind == LeaderFaultKind::kRevokedAndCutOff) deployment_.store().RevokeEarly();
    // Beyond the end of its lease, and of the worker's.
    AtEnd(kLongestFault + fault.lasts, [this, &network, place, chosen] {
      network.MovePlace(place, 0);
      network.MovePlace(chosen, 0);
      --active_;
    });
    return true;
  }
  if (fault.kind == LeaderFaultKind::kLeaderCutFromHost) first = last = chosen;
  Node other = self;
  if (fault.kind == LeaderFaultKind::kHostCutFromFollower) {
    first = last = chosen;
    other = ControlNode(leader->number() % scenario_.options.controls + 1);
  }
  for (std::uint32_t host = first; host <= last; ++host) {
    if (fault.kind != LeaderFaultKind::kLeaderMute) cut.emplace_back(AgentNode(host), other);
    if (fault.kind != LeaderFaultKind::kLeaderDeaf) cut.emplace_back(other, AgentNode(host));
  }
  for (const auto& [from, to] : cut) network.CutOneWay(from, to, true);
  AtEnd(fault.lasts, [this, &network, cut] {
    for (const auto& [from, to] : cut) network.CutOneWay(from, to, false);
    --active_;
  });
  return true;
}

bool LeaderRunner::BeginAtWorld(const LeaderFault& fault) {
  const std::uint32_t host = fault.whom % scenario_.options.hosts + 1;
  const auto start_agent = [this, host] {
    if (!deployment_.host(host).agent_alive()) deployment_.host(host).StartAgent();
  };
  switch (fault.kind) {
    case LeaderFaultKind::kAgentDies:
      deployment_.host(host).KillAgent();
      AtEnd(fault.lasts, start_agent);
      return true;
    case LeaderFaultKind::kScale:
      return deployment_.control().answers() && deployment_.Scale(1 + fault.whom % kMostLeaderRegions);
    case LeaderFaultKind::kWorkerDies: {
      const std::vector<SimulatedWorker*> workers = deployment_.Workers();
      deployment_.Kill(workers[fault.whom % workers.size()]->identity().region);
      AtEnd(fault.lasts, [this] { --active_; });
      return true;
    }
    case LeaderFaultKind::kHostCrashes:
      deployment_.host(host).Crash();
      AtEnd(fault.lasts, [this, start_agent] { start_agent(), --active_; });
      return true;
    default:
      deployment_.Cut(host, true);
      AtEnd(fault.lasts, [this, host] { deployment_.Cut(host, false), --active_; });
      return true;
  }
}

void LeaderRunner::EndFaults() {
  ended_ = true;
  active_ = 0;
  deployment_.network().ClearCuts();
  deployment_.store().SetFull(false);
  deployment_.store().SetWriteTime(0);
  for (const auto& control : deployment_.controls()) control->SetStopped(false);
  deployment_.StartControls();
  for (std::uint32_t host = 1; host <= scenario_.options.hosts; ++host) {
    if (!deployment_.host(host).agent_alive()) deployment_.host(host).StartAgent();
  }
}

// --- The run.

LeaderOutcome LeaderRunner::Run() {
  if (!deployment_.AwaitCalm()) {
    outcome_.problems = {"it does not start:" + deployment_.Standing()};
    return outcome_;
  }
  RunFor(Milliseconds(1000));
  backup_ = deployment_.store().Backup();
  in_backup_ = Changes();
  const std::uint64_t first_elections = deployment_.store().elections();
  for (const LeaderFault& fault : scenario_.faults) {
    RunFor(fault.after);
    if (OneAtATime(fault.kind)) {
      const Micros patience_ends = deployment_.timeline().now() + kQuietPatience;
      while (!Safe(fault) && deployment_.timeline().now() < patience_ends) RunFor(WorldWatch::kLook);
      if (!Safe(fault)) continue;
      ++active_;
    }
    if (Begin(fault)) {
      ++outcome_.faults[static_cast<std::size_t>(fault.kind)];
    } else if (OneAtATime(fault.kind)) {
      --active_;
    }
  }
  RunFor(kLongestFault);
  EndFaults();
  const Micros patience_ends = deployment_.timeline().now() + kLeaderPatience;
  while (!deployment_.Calm() && deployment_.timeline().now() < patience_ends) {
    RunFor(kBetweenChanges);
    // Nobody knows of a replacement that no agent had heard of when the backup was put back.
    if (restored_ && deployment_.control().answers()) (void)deployment_.Scale(deployment_.regions());
  }
  RunFor(Milliseconds(1000));
  outcome_.elections = deployment_.store().elections() - first_elections;
  if (deployment_.control().alive()) watch_.words().CheckKept(deployment_.timeline().now(), Changes());
  deployment_.Settle();
  Conclude(outcome_);
  return outcome_;
}

void LeaderRunner::Conclude(LeaderOutcome& outcome) {
  FalseWords& words = watch_.words();
  outcome.lost_bodies = deployment_.instance().lost_bodies();
  if (outcome.lost_bodies > 0) {
    deployment_.invariants().Problem(deployment_.tick(), absl::StrCat(outcome.lost_bodies, " bodies lost"));
  }
  outcome.problems = deployment_.problems();
  outcome.problems.insert(outcome.problems.end(), words.problems().begin(), words.problems().end());
  if (!outcome.problems.empty()) outcome.problems.push_back("in the end:" + deployment_.Standing());
  outcome.steps = deployment_.totals().steps;
  outcome.takeovers = deployment_.totals().takeovers;
  outcome.gaps = watch_.leader_gaps();
  outcome.stood = words.stood();
  outcome.two_owners = words.two_owners() + deployment_.totals().two_owners + deployment_.invariants().doubled();
  outcome.lies = words.lies();
  outcome.ended = words.ended();
  outcome.lost_changes = words.lost_changes();
  outcome.hash = deployment_.hash();
}

// From numbers of its own and between the other faults, so that a seed has those that it had before there was this one.
void DrawClock(LeaderScenario& scenario) {
  Chance chance(scenario.seed ^ 0xc10c);
  if (!chance.Happens(kClockMoves)) return;
  const std::size_t at = chance.Below(scenario.faults.size());
  LeaderFault& next = scenario.faults[at];
  LeaderFault fault;
  fault.kind = chance.Happens(0.5) ? LeaderFaultKind::kLeaderClockMoved : LeaderFaultKind::kFollowerClockMoved;
  fault.after = chance.Below(next.after + 1);
  fault.lasts = kShortestFault + chance.Below(kLongestFault - kShortestFault);
  fault.whom = static_cast<std::uint32_t>(chance.Below(1000));
  fault.strength = chance.Unit();
  next.after -= fault.after;
  scenario.faults.insert(scenario.faults.begin() + static_cast<std::ptrdiff_t>(at), fault);
}

}  // namespace

LeaderScenario DrawLeaders(std::uint64_t seed) {
  Chance chance(seed ^ 0x1eade25);
  LeaderScenario scenario;
  scenario.seed = seed;
  scenario.options.seed = seed;
  scenario.options.controls = static_cast<std::uint32_t>(2 + chance.Below(2));
  scenario.options.hosts = static_cast<std::uint32_t>(2 + chance.Below(2));
  scenario.options.regions = static_cast<std::uint32_t>(2 + chance.Below(3));
  scenario.balls = static_cast<int>(12 + chance.Below(20));
  const std::uint64_t faults = 2 + chance.Below(4);
  for (std::uint64_t i = 0; i < faults; ++i) {
    LeaderFault& fault = scenario.faults.emplace_back();
    fault.kind = static_cast<LeaderFaultKind>(chance.Below(kKindsWithoutClocks));
    fault.after = chance.Happens(0.3) ? chance.Below(Milliseconds(20)) : chance.Below(Milliseconds(2000));
    fault.lasts = kShortestFault + chance.Below(kLongestFault - kShortestFault);
    fault.whom = static_cast<std::uint32_t>(chance.Below(1000));
    fault.strength = chance.Unit();
  }
  DrawClock(scenario);
  return scenario;
}

std::string Describe(const LeaderScenario& scenario) {
  return absl::StrCat(scenario.options.controls, " control planes, ", scenario.balls, " bodies, ",
                      scenario.options.regions, " regions on ", scenario.options.hosts,
                      " hosts:", FaultsText(scenario.faults, kLeaderFaultNames));
}

LeaderOutcome Run(const LeaderScenario& scenario) { return LeaderRunner(scenario).Run(); }

}  // namespace tessera::simulation
