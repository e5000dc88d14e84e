// ControlModel: what a control plane, agents and the shells of workers do about deaths and planned maps, in a
// Simulation.
//
// Each worker streams its log to its standby, which acknowledges it. When a worker dies, a failover map goes to those
// that live, their inventories come back, one resolution goes out. A planned map is announced, committed, and settled
// when nobody owns bodies in another's cells. All messages take times drawn from the simulation's seed.
//
//   std::unique_ptr<ControlModel> control;
//   Simulation simulation(scene, map, {.attach = [&](Simulation& s) { control = std::make_unique<ControlModel>(s, map);
//   }}); simulation.RunTo(Tick(60)); simulation.Kill(RegionId(2)); simulation.RunTo(Tick(120));
//   EXPECT_EQ(control->totals().lost, 0U);
//
// Thread rule: one thread at a time.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "core/region/resolve.h"
#include "core/region/standby_copy.h"
#include "core/world/limits.h"
#include "tests/simulation/simulation.h"

namespace tessera::simulation {

struct ControlOptions {
  Micros detection = 2000;        // from a death to when it is known
  Micros max_message = 4000;      // between control plane and worker, one way; drawn
  std::uint64_t lead_ticks = 60;  // to a planned map
};

struct ControlTotals {
  std::uint64_t deaths = 0;     // workers'; those that a map has left no region are ended, and have not died
  std::uint64_t failovers = 0;  // that were carried out
  std::uint64_t adopted = 0, from_grant = 0, pending = 0;  // bodies
  std::uint64_t lost = 0;                                  // bodies that nobody had
  std::uint64_t without_copy = 0;                          // dead regions
  std::int64_t max_age_ticks = 0;                          // for states out of standbys, at the death of their region
  Micros max_gap = 0;                                      // from a death until all have resumed
  std::uint64_t whole_logs = 0, log_messages = 0, log_bytes = 0;
  std::uint64_t planned = 0, refused = 0;  // maps that came into force; commits that came too late
};

class ControlModel {
 public:
  ControlModel(Simulation& simulation, const PartitionMap& map, const ControlOptions& options = {});

  // Leads to `wanted`, by a map in transition and a settled one. Regions that it names anew are started, those that it
  // does not name are ended. One at a time: requires idle().
  void Plan(const PartitionMap& wanted);
  bool idle() const { return !plan_ && !failover_begun_; }
  // True while a death is being dealt with.
  bool failing_over() const { return failover_begun_.has_value(); }
  const PartitionMap& map() const { return map_; }
  const ControlTotals& totals() const { return totals_; }
  // Ticks that the standby of a region has; none if nobody has any.
  std::optional<Tick> StandbyTick(RegionId region) const;
  // Its log does not reach its standby any more, or does again.
  void HoldLog(RegionId region, bool held);

 private:
  struct PlanState {
    PartitionMap wanted, next;
    Tick effective;
    std::set<RegionId> knows;
    bool committed = false, settling = false;
    std::uint64_t answers = 0;
  };

  void After(Micros time, std::function<void()> action);
  void Message(std::function<void()> action);  // between control plane and worker, either way
  template <class Action>
  void ToWorker(RegionId region, Action action);

  void Stepped(SimulatedRegion& worker, const region::StepResult& result);
  void SendLog(SimulatedRegion& worker, const region::StepResult& result);
  void OnMessage(SimulatedRegion& worker, Node from, std::uint8_t kind, std::span<const std::uint8_t> bytes);
  RegionId StandbyOf(RegionId region) const;
  void Protect(SimulatedRegion& worker);
  void Killed(RegionId region);
  std::vector<const region::StandbyCopy*> PrimariesOf(RegionId holder) const;

  void BeginFailover();
  void TakeInventory(const region::Inventory& inventory);
  void Resolved();
  void Resume(SimulatedRegion& worker, const region::Resolution& resolution);
  void AssignStandbys();

  void SendPlan();
  void SendCommit();
  void WatchPlan();
  void StartJoining();

  Simulation& simulation_;
  ControlOptions options_;
  PartitionMap map_;  // the newest that was ordered
  ControlTotals totals_;
  std::uint64_t versions_ = 0, incarnations_ = kMaxRegions;  // the first ones have those of their regions
  std::map<RegionId, std::map<RegionId, region::StandbyCopy>> standby_copies_;  // by holder, by whose they are
  std::map<RegionId, Tick> asked_;                                              // for a whole state, by whose
  std::map<RegionId, Tick> last_tick_;
  std::map<RegionId, std::vector<BodyId>> last_owned_;
  std::set<RegionId> held_logs_, retired_;
  std::set<RegionId> dead_;  // in the failover under way
  std::map<RegionId, Tick> died_at_;
  std::optional<Micros> failover_begun_;
  std::map<RegionId, region::Inventory> inventories_;
  std::set<RegionId> resumed_;
  std::optional<PlanState> plan_;
};

}  // namespace tessera::simulation
