// ClusterHarness: a Cluster with its agents under a virtual clock, for tests. The control plane can be killed and
// loaded again at any call.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "control_plane/cluster/cluster.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/memory_store.h"
#include "control_plane/testing/fake_workers.h"
#include "control_plane/testing/test_plan.h"

namespace tessera::control {

// A host with its agent, as the control plane sees it.
struct FakeHost {
  std::string host_id, secret;
  std::uint32_t capacity = 0;
  StreamId stream = 0;                // 0: not attached
  bool silent = false;                // sends nothing and hears nothing
  std::string version;                // its agent's, from the next time that it attaches
  std::vector<std::string> releases;  // likewise: of which it says that it has the worker's program
  // The list of revocations on its disk, and whether that takes a newer one.
  v1::SignedRevocations revocations;
  bool keeps_revocations = true;
  FakeWorkers fake;
};

class ClusterHarness {
 public:
  explicit ClusterHarness(ControlSettings settings = {}) : settings_(settings) { Load(); }

  // As if the process had been killed: only the store is left. Agents attach again when pumped.
  void Restart();
  // As if the machine of the control plane had been lost, and another begun from this backup.
  std::string Backup() const;
  void BeginFrom(const std::string& backup);
  // The cluster; it dies first if `calls_until_death` says so.
  Cluster& cluster();

  // A host named `name` with its agent attached.
  FakeHost& AddHost(const std::string& name, std::uint32_t capacity);
  static v1::AgentHello Hello(std::uint32_t capacity);
  void Attach(FakeHost& agent);
  // The number of the list that the agent keeps; 0: none.
  static std::uint64_t KeptBy(const FakeHost& agent);
  void Send(FakeHost& agent, const v1::AgentMessage& message);

  // One round of messages; false if nobody had anything to say.
  bool Exchange();
  // Messages go to and fro until nobody has anything to say; then everybody sends one heartbeat.
  void Pump();
  // Time passes in steps of a heartbeat.
  void Run(std::chrono::milliseconds span);

  // All bodies that live workers own, with how many own each.
  std::map<std::uint64_t, int> Bodies() const;
  std::size_t Workers() const;
  // The host that runs the region.
  FakeHost& AgentOf(const std::string& id, std::uint32_t region);

  v1::Instance Get(const std::string& id) { return *GetInstance(cluster().state(), id); }
  v1::HostState HostState(const std::string& name);

  MemoryStore store;
  Now now{std::chrono::hours(1), std::chrono::hours(24 * 365 * 50)};
  std::map<std::string, FakeHost> agents;
  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();
  int calls_until_death = -1;  // the control plane dies before this call of many; below 0: it does not

 private:
  void Load();
  void Keep(FakeHost& agent, const v1::SignedRevocations& list);
  // Different bytes each time, the same in each run.
  std::string Random(std::size_t n);

  ControlSettings settings_;
  std::unique_ptr<Cluster> cluster_;
  std::uint64_t random_ = 1;
};

// Creates an instance and gives its id.
std::string Create(ClusterHarness& harness, const InstancePlan& plan);
// Creates one of so many regions and waits until it runs.
std::string Start(ClusterHarness& harness, std::uint32_t regions, bool balance = false);
absl::StatusOr<v1::Instance> Scale(ClusterHarness& harness, const std::string& id, std::uint32_t regions,
                                   bool dry_run = false);
v1::JoinInstanceRequest JoinRequest(const std::string& id, const std::string& name = "ann");
// The region's standby, or 0.
std::uint32_t StandbyOf(const v1::Instance& instance, std::uint32_t region);

// The instance runs by a map of so many regions, each with its worker, and nothing of it is to be changed any more.
void ExpectSettled(ClusterHarness& harness, const std::string& id, int regions);
// Live workers own all bodies of that many regions' begin, each of them once.
void ExpectEachBodyOnce(const ClusterHarness& harness, std::uint64_t regions);
// No worker was started twice under one incarnation.
void ExpectNoIncarnationTwice(const ClusterHarness& harness);

}  // namespace tessera::control
