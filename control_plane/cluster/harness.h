// ClusterHarness: a Cluster with its agents under a virtual clock, for tests. The control plane can be killed and
// loaded again at any call.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>

#include "control_plane/cluster/cluster.h"
#include "control_plane/cluster/fake_workers.h"
#include "control_plane/memory_store.h"

namespace tessera::control {

class ClusterHarness {
 public:
  struct Agent {
    std::string host_id, secret;
    std::uint32_t capacity = 0;
    SessionId session = 0;
    bool silent = false;  // sends nothing and hears nothing
    FakeWorkers fake;
  };

  explicit ClusterHarness(Settings settings = {}) : settings_(settings) { Load(); }

  // As if the process had been killed: what is not in the store is gone. Agents attach again when pumped.
  void Restart() {
    cluster_.reset();
    for (auto& [name, agent] : agents) agent.session = 0;
    Load();
  }

  Cluster& cluster() {
    // Dies before this call of many, if it is to.
    if (calls_until_death >= 0 && calls_until_death-- == 0) Restart();
    return *cluster_;
  }

  // A host named `name` with its agent attached.
  Agent& AddHost(const std::string& name, std::uint32_t capacity) {
    v1::AddHostRequest request;
    request.set_name(name);
    const auto added = cluster().AddHost(now, request);
    EXPECT_TRUE(added.ok()) << added.status();
    v1::AgentHello hello = Hello(capacity);
    hello.set_join_token(added->join_token());
    const auto admission = cluster().HandleHello(now, hello);
    EXPECT_TRUE(admission.ok()) << admission.status();
    Agent& agent = agents[name];
    agent.fake.world = world;
    agent.host_id = admission->admitted.host_id();
    agent.secret = admission->admitted.host_secret();
    agent.capacity = capacity;
    agent.session = admission->session;
    return agent;
  }

  static v1::AgentHello Hello(std::uint32_t capacity) {
    v1::AgentHello hello;
    hello.set_advertise_address("10.0.0.1");
    hello.set_metrics_port(9100);
    hello.mutable_resources()->set_region_capacity(capacity);
    return hello;
  }

  void Attach(Agent& agent) {
    v1::AgentHello hello = Hello(agent.capacity);
    hello.set_host_id(agent.host_id);
    hello.set_host_secret(agent.secret);
    for (const auto& [key, worker] : agent.fake.workers) *hello.add_workers() = worker.report;
    const auto admission = cluster().HandleHello(now, hello);
    ASSERT_TRUE(admission.ok()) << admission.status();
    agent.session = admission->session;
    for (const v1::AgentMessage& message : agent.fake.Inventories()) Send(agent, message);
  }

  void Send(Agent& agent, const v1::AgentMessage& message) {
    // Aborted: the control plane was restarted meanwhile, and the agent attaches again with the next pump.
    const absl::Status status = cluster().HandleAgentMessage(now, agent.session, message);
    if (!status.ok()) agent.session = 0;
  }

  // One round of messages; false if nobody had anything to say.
  bool Exchange() {
    bool any = false;
    for (auto& [name, agent] : agents) {
      if (agent.silent) continue;
      if (agent.session == 0) Attach(agent);
      const std::optional<v1::DesiredSet> desired = cluster().TakeDesired(now, agent.session);
      if (!desired) continue;
      any = true;
      for (const v1::AgentMessage& message : agent.fake.Apply(*desired)) Send(agent, message);
    }
    cluster_->TakeEffects();
    return any;
  }

  // Messages go to and fro until nobody has anything to say; then one heartbeat of everybody.
  void Pump() {
    for (int rounds = 0; rounds < 50 && Exchange(); ++rounds) continue;
    for (auto& [name, agent] : agents) {
      if (!agent.silent && agent.session != 0) Send(agent, agent.fake.Heartbeat());
    }
    for (int rounds = 0; rounds < 50 && Exchange(); ++rounds) continue;
  }

  // Time passes in steps of a heartbeat.
  void Run(std::chrono::milliseconds span) {
    for (const Steady end = now.steady + span; now.steady < end;) {
      now.steady += settings_.heartbeat_interval;
      now.unix_time += settings_.heartbeat_interval;
      cluster().HandleTimer(now);
      Pump();
    }
  }

  // All bodies that live workers own, with how many own each.
  std::map<std::uint64_t, int> Bodies() const {
    std::map<std::uint64_t, int> bodies;
    for (const auto& [name, agent] : agents) {
      for (const auto& [key, worker] : agent.fake.workers) {
        const auto owned = world->owned.find(worker.report.identity().incarnation());
        if (owned == world->owned.end()) continue;
        for (const auto& [body, epoch] : owned->second) ++bodies[body];
      }
    }
    return bodies;
  }
  std::size_t Workers() const {
    std::size_t n = 0;
    for (const auto& [name, agent] : agents) n += agent.fake.workers.size();
    return n;
  }
  // The host that runs the region.
  Agent& AgentOf(const std::string& id, std::uint32_t region) {
    for (auto& [name, agent] : agents) {
      if (agent.fake.workers.contains({id, region})) return agent;
    }
    ADD_FAILURE() << "region " << region << " runs nowhere";
    return agents.begin()->second;
  }

  v1::Instance Get(const std::string& id) { return *cluster().GetInstance(id); }
  v1::HostState HostState(const std::string& name) {
    v1::GetHostRequest request;
    request.set_name(name);
    return cluster().GetHost(request)->host().state();
  }

  MemoryStore store;
  Moment now{std::chrono::hours(1), std::chrono::hours(24 * 365 * 50)};
  std::map<std::string, Agent> agents;
  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();
  int calls_until_death = -1;

 private:
  void Load() {
    auto loaded = Cluster::Load(
        store, settings_, [this](std::size_t n) { return Random(n); }, now);
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    cluster_ = *std::move(loaded);
  }

  // Different each time, the same in each run.
  std::string Random(std::size_t n) {
    std::string bytes(n, '\0');
    for (char& byte : bytes)
      byte = static_cast<char>((random_ = random_ * 6364136223846793005u + 1442695040888963407u) >> 56);
    return bytes;
  }

  Settings settings_;
  std::unique_ptr<Cluster> cluster_;
  std::uint64_t random_ = 1;
};

// A plan of `regions` regions on 100 m x 100 m whose scene lets players in.
inline InstancePlan TestPlan(std::uint32_t regions, std::uint32_t expected_players = 0) {
  InstancePlan plan;
  plan.scene_name = "test";
  plan.scene_hash = "0123";
  plan.scene_bytes = "scene";
  plan.tick_rate_hz = 60;
  plan.snapshot_rate_hz = 30;
  plan.expected_players = expected_players;
  plan.start_deadline = std::chrono::seconds(30);
  plan.map = *MakeGridMap({0, 0, 100, 100}, regions);
  plan.spawn_points = {{10, 0, 10}, {90, 0, 90}};
  return plan;
}

}  // namespace tessera::control
