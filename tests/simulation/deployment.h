// Deployment: a whole Tessera in one process, from one seed, in virtual time: one control plane or several on one
// store, hosts with agents, the workers of one instance, and what goes wrong with them: processes that are killed and
// come back, machines that are cut off or crash, a control plane that dies between storing and sending.
//
//   Deployment deployment(scene, {.hosts = 2, .regions = 4});
//   deployment.AwaitCalm();                        // it runs, and every region is protected
//   deployment.Cut(2, true);                       // nobody hears the second machine any more
//   deployment.RunFor(Milliseconds(3000));
//   deployment.Cut(2, false);
//   deployment.Settle();                           // all must come right
//   EXPECT_THAT(deployment.problems(), IsEmpty());
//
// Checked after each step, beside the invariant checker: nobody steps a life whose place has been taken; never do
// two lives of a region move at one time; no two that move own one body at one tick.
//
// It has over 40 methods: each is a fault that a scenario may cause, a request that it may make, or a figure that it
// reads. Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tests/simulation/false_words.h"
#include "tests/simulation/invariant_checker.h"
#include "tests/simulation/simulated_host.h"

namespace tessera::simulation {

struct DeploymentOptions {
  std::uint64_t seed = 1;
  std::uint32_t hosts = 2, regions = 4;
  std::uint32_t capacity = 16;  // workers a host
  std::uint32_t controls = 1;   // control planes; several hold an election
  region::RegionSettings settings = {};
  std::chrono::milliseconds checkpoint_interval{0};  // 0: none by themselves
  std::string game = {};                             // Lua; empty: the world runs none
  std::set<RegionId> damaged_games = {};             // regions on whose hosts it is not what it was
};

struct DeploymentTotals {
  std::uint64_t steps = 0, handovers = 0;
  std::uint64_t takeovers = 0;   // lives declared dead whose place was taken
  std::uint64_t fenced = 0;      // lives among those that ended thereafter
  Micros first_takeover_at = 0;  // 0: there was none
  std::uint64_t two_owners = 0;  // lives that stepped, or moved, beside the one that has their place
};

class Deployment {
 public:
  Deployment(std::shared_ptr<const Scene> scene, const DeploymentOptions& options);
  ~Deployment();

  void RunFor(Micros time);
  template <class Condition>
  bool RunUntil(Micros patience, Condition condition) {
    const Micros end = around_.timeline.now() + patience;
    while (!condition() && around_.timeline.now() < end) RunFor(Milliseconds(1));
    return condition();
  }
  // Runs, by a map that all run by, and each region's standby has a copy.
  bool Calm() const;
  // The same, as far as workers go.
  bool Still() const;
  bool AwaitCalm(Micros patience = Milliseconds(20'000));
  // Ends all faults, brings back what is dead, waits until all is calm and checks that each body has one owner.
  void Settle();

  // --- Faults. Hosts from 1.
  void Cut(std::uint32_t host, bool cut) { around_.network.CutPlace(host, cut); }
  SimulatedHost& host(std::uint32_t number) { return *hosts_.at(number - 1); }
  const SimulatedHost& HostAt(std::uint32_t number) const { return *hosts_.at(number - 1); }
  // The control plane that leads; while there is none, any. One alone is always meant.
  SimulatedControl& control() const;
  const SimulatedHost::Controls& controls() const { return controls_; }
  SimulatedStore& store() { return store_; }
  void StartControls();  // those that do not run
  void KillControls();
  // All control planes are lost with their store, and begin anew from the backup.
  void BeginFrom(const std::string& backup);
  VirtualNetwork& network() { return around_.network; }
  Timeline& timeline() { return around_.timeline; }
  const Timeline& timeline() const { return around_.timeline; }
  // The life of the region that is in the control plane's orders; null if none runs.
  SimulatedWorker* Find(RegionId region);
  void Kill(RegionId region);
  void Kill(const SimulatedWorker& worker);
  // The life that came while the world ran and whose map is not known to be in force; null if there is none.
  SimulatedWorker* Newcomer() const;
  // Whether the control plane takes it on.
  bool Scale(std::uint32_t regions);
  std::vector<SimulatedWorker*> Workers() const;

  // --- The world's time and its game, as operators ask for them. Requires that the control plane is alive.
  absl::Status Pause(bool paused = true);
  absl::Status MakeTicks(std::uint32_t ticks);  // in a paused world
  absl::Status SetPace(double ticks_per_second);
  // Unchecked, as if the control plane's Lua host found nothing. On the hosts of `damaged` it is not what it was.
  absl::Status SetGame(const std::string& game, const std::set<RegionId>& damaged = {});

  v1::Instance instance() const;                       // as the control plane told it last
  Said SaidBy(const SimulatedControl& control) const;  // about the world; requires that it is alive
  // A step of any worker, a resumption included.
  std::function<void(const SimulatedWorker&, const region::StepResult&)> on_step;
  const PartitionMap& map() const { return map_; }    // the first
  std::uint32_t regions() const { return regions_; }  // wanted
  RegionId OwnerOf(BodyId id) const;
  std::size_t bodies() const;  // that somebody who counts owns
  // All bodies are lost rightly: a region and its standby are.
  void ExcuseAll();
  // The world is to begin again from a checkpoint: what was before counts no more.
  void Restored();

  // --- Players, by the control plane's Join and Leave.
  std::optional<std::uint32_t> Join(const std::string& name);
  void Leave(std::uint32_t player);

  // --- Properties. Has the "health" of a body set, which the scene declares, as a number; told anew by nobody if the
  // control plane dies before it is answered. False: not taken.
  bool SetHealth(BodyId body, std::int64_t health);
  // A change that was answered, and nothing that was ordered before it, is the body's value in the end.
  std::size_t healths_answered() const { return healths_answered_; }

  InvariantChecker& invariants() { return *invariants_; }
  std::vector<std::string> problems() const;
  const DeploymentTotals& totals() const { return totals_; }
  Tick tick() const;  // the newest of any
  std::uint64_t hash() const { return invariants_->hash(); }
  std::string Standing() const;

 private:
  void Begin(const DeploymentOptions& options);
  void Stepped(SimulatedWorker& worker, const region::StepResult& result);
  void TakenOver(SimulatedWorker& worker, const worker::OrderedFailover& failover);
  void Ending(SimulatedWorker& worker);
  void TwoOwners(const SimulatedWorker& worker, const std::string& what);
  void CheckOthers(SimulatedWorker& worker);
  void CheckCopies();
  bool Freeze();
  void TakeAnswers();
  void CheckHealths(Tick end);
  bool Counts(const SimulatedWorker& worker) const {
    return !taken_over_.contains(worker.node()) && !before_.contains(worker.node());
  }

  Surroundings around_;
  SimulatedStore store_;
  SimulatedHost::Controls controls_;
  std::vector<std::unique_ptr<SimulatedHost>> hosts_;
  PartitionMap map_;
  std::unique_ptr<InvariantChecker> invariants_;
  std::vector<std::string> problems_;  // in the worlds before
  std::string id_;
  v1::Instance last_seen_;
  std::set<Node> taken_over_;
  std::set<Node> before_;  // lives of a world that was lost
  std::map<Node, Tick> last_step_;
  std::set<Node> doubled_;                                    // counted in totals_.two_owners
  std::map<std::uint32_t, v1::JoinInstanceResponse> tokens_;  // by player
  std::uint32_t regions_ = 0;
  std::uint32_t perhaps_ = 0;  // asked for since, and nobody knows whether it was taken; 0: nothing is unknown
  DeploymentTotals totals_;
  struct HealthOrder {
    std::uint64_t number = 0;
    std::int64_t health = 0;
    bool answered = false, given_up = false;
  };
  std::map<BodyId, std::vector<HealthOrder>> healths_;  // since the last that was answered
  std::size_t healths_answered_ = 0;
};

}  // namespace tessera::simulation
