#include "control_plane/testing/cluster_harness.h"

#include <algorithm>

#include "control_plane/backup.h"
#include "core/world/limits.h"

namespace tessera::control {

void ClusterHarness::Restart() {
  cluster_.reset();
  for (auto& [name, agent] : agents) agent.stream = 0;
  Load();
}

std::string ClusterHarness::Backup() const {
  std::string file;
  const absl::Status status = WriteBackup(store, [&file](std::string_view bytes) {
    file.append(bytes);
    return absl::OkStatus();
  });
  EXPECT_TRUE(status.ok()) << status;
  return file;
}

void ClusterHarness::BeginFrom(const std::string& backup) {
  cluster_.reset();
  for (auto& [name, agent] : agents) agent.stream = 0;
  std::vector<StoreOp> all;
  const auto stored = store.List("");
  for (const StoreEntry& entry : *stored) all.push_back(DeleteOp(entry.key, entry.revision));
  ASSERT_TRUE(store.Txn(all).ok());
  ASSERT_TRUE(RestoreBackup(backup, store, [](std::size_t n) { return std::string(n, '\0'); }).ok());
  Load();
}

Cluster& ClusterHarness::cluster() {
  if (calls_until_death >= 0 && calls_until_death-- == 0) Restart();
  return *cluster_;
}

FakeHost& ClusterHarness::AddHost(const std::string& name, std::uint32_t capacity) {
  v1::AddHostRequest request;
  request.set_name(name);
  request.set_max_regions(std::min(capacity, kMaxRegions));
  const auto added = cluster().AddHost(now, request);
  EXPECT_TRUE(added.ok()) << added.status();
  v1::AgentHello hello = Hello(capacity);
  hello.set_join_token(added->join_token());
  const auto admission = cluster().HandleHello(now, hello);
  EXPECT_TRUE(admission.ok()) << admission.status();
  FakeHost& agent = agents[name];
  agent.fake.world = world;
  agent.host_id = admission->admitted.host_id();
  agent.secret = admission->admitted.host_secret();
  agent.capacity = capacity;
  agent.stream = admission->stream;
  return agent;
}

v1::AgentHello ClusterHarness::Hello(std::uint32_t capacity) {
  v1::AgentHello hello;
  hello.set_advertise_address("10.0.0.1");
  hello.set_metrics_port(9100);
  hello.mutable_resources()->set_region_capacity(capacity);
  hello.set_takes_player_changes(true);
  return hello;
}

void ClusterHarness::Attach(FakeHost& agent) {
  v1::AgentHello hello = Hello(agent.capacity);
  hello.set_host_id(agent.host_id);
  hello.set_host_secret(agent.secret);
  hello.set_revocations_number(KeptBy(agent));
  hello.set_version(agent.version);
  *hello.mutable_releases() = {agent.releases.begin(), agent.releases.end()};
  for (const auto& [key, worker] : agent.fake.workers) *hello.add_workers() = worker.report;
  const auto admission = cluster().HandleHello(now, hello);
  // One that was revoked is left alone from then on.
  if (absl::IsPermissionDenied(admission.status())) agent.silent = true;
  if (agent.silent) return;
  ASSERT_TRUE(admission.ok()) << admission.status();
  agent.stream = admission->stream;
  if (admission->admitted.report_revocations()) {
    v1::AgentMessage message;
    *message.mutable_revocations() = agent.revocations;
    Send(agent, message);
  }
  for (const v1::AgentMessage& message : agent.fake.Inventories()) Send(agent, message);
  if (!admission->admitted.report_orders()) return;
  v1::AgentMessage held;
  held.mutable_held_orders();
  for (const auto& [key, worker] : agent.fake.workers) *held.mutable_held_orders()->add_orders() = worker.order;
  Send(agent, held);
}

std::uint64_t ClusterHarness::KeptBy(const FakeHost& agent) {
  v1::Revocations content;
  return content.ParseFromString(agent.revocations.list()) ? content.number() : 0;
}

void ClusterHarness::Keep(FakeHost& agent, const v1::SignedRevocations& list) {
  if (!agent.keeps_revocations) return;
  agent.revocations = list;
  v1::AgentMessage message;
  message.set_kept_revocations(KeptBy(agent));
  Send(agent, message);
}

void ClusterHarness::Send(FakeHost& agent, const v1::AgentMessage& message) {
  // It is aborted when the control plane was restarted meanwhile; the agent attaches again with the next pump.
  const absl::Status status = cluster().HandleAgentMessage(now, agent.stream, message);
  if (!status.ok()) agent.stream = 0;
}

bool ClusterHarness::Exchange() {
  bool any = false;
  for (auto& [name, agent] : agents) {
    if (agent.silent) continue;
    if (agent.stream == 0) Attach(agent);
    if (agent.silent) continue;
    const std::optional<v1::DesiredSet> desired = cluster().TakeDesired(agent.stream);
    if (!desired) continue;
    any = true;
    if (desired->has_revocations()) Keep(agent, desired->revocations());
    for (const v1::AgentMessage& message : agent.fake.Apply(*desired)) Send(agent, message);
  }
  cluster_->TakeEffects();
  return any;
}

void ClusterHarness::Pump() {
  for (int rounds = 0; rounds < 50 && Exchange(); ++rounds) continue;
  for (auto& [name, agent] : agents) {
    if (!agent.silent && agent.stream != 0) Send(agent, agent.fake.Heartbeat());
  }
  for (int rounds = 0; rounds < 50 && Exchange(); ++rounds) continue;
}

void ClusterHarness::Run(std::chrono::milliseconds span) {
  for (const Steady end = now.steady + span; now.steady < end;) {
    now.steady += settings_.heartbeat_interval;
    now.unix_time += settings_.heartbeat_interval;
    cluster().HandleTimer(now);
    Pump();
  }
}

std::map<std::uint64_t, int> ClusterHarness::Bodies() const {
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

std::size_t ClusterHarness::Workers() const {
  std::size_t n = 0;
  for (const auto& [name, agent] : agents) n += agent.fake.workers.size();
  return n;
}

FakeHost& ClusterHarness::AgentOf(const std::string& id, std::uint32_t region) {
  for (auto& [name, agent] : agents) {
    if (agent.fake.workers.contains({id, region})) return agent;
  }
  ADD_FAILURE() << "region " << region << " runs nowhere";
  return agents.begin()->second;
}

v1::HostState ClusterHarness::HostState(const std::string& name) {
  v1::GetHostRequest request;
  request.set_name(name);
  return control::GetHost(cluster().state(), request)->host().state();
}

void ClusterHarness::Load() {
  auto loaded = Cluster::Load(
      store, settings_, [this](std::size_t n) { return Random(n); }, now);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  cluster_ = *std::move(loaded);
}

std::string ClusterHarness::Random(std::size_t n) {
  std::string bytes(n, '\0');
  for (char& byte : bytes)
    byte = static_cast<char>((random_ = random_ * 6364136223846793005u + 1442695040888963407u) >> 56);
  return bytes;
}

std::string Create(ClusterHarness& harness, const InstancePlan& plan) {
  const auto made = harness.cluster().CreateInstance(harness.now, plan, false);
  EXPECT_TRUE(made.ok()) << made.status();
  return made->id();
}

std::string Start(ClusterHarness& harness, std::uint32_t regions, bool balance) {
  InstancePlan plan = TestPlan(regions);
  plan.balance = balance;
  const std::string id = Create(harness, plan);
  harness.Pump();
  harness.Pump();
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  return id;
}

absl::StatusOr<v1::Instance> Scale(ClusterHarness& harness, const std::string& id, std::uint32_t regions,
                                   bool dry_run) {
  v1::ScaleInstanceRequest request;
  request.set_id(id);
  request.set_regions(regions);
  request.set_validate_only(dry_run);
  return harness.cluster().ScaleInstance(harness.now, request);
}

v1::JoinInstanceRequest JoinRequest(const std::string& id, const std::string& name) {
  v1::JoinInstanceRequest request;
  request.set_instance_id(id);
  request.set_player_name(name);
  return request;
}

std::uint32_t StandbyOf(const v1::Instance& instance, std::uint32_t region) {
  for (const v1::MapRegion& entry : instance.map().regions()) {
    if (entry.id() == region) return entry.standby();
  }
  return 0;
}

void ExpectSettled(ClusterHarness& harness, const std::string& id, int regions) {
  const v1::Instance instance = harness.Get(id);
  EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_RUNNING) << instance.reason();
  EXPECT_EQ(instance.map().regions_size(), regions);
  EXPECT_EQ(harness.Workers(), static_cast<std::size_t>(regions));
  EXPECT_TRUE(instance.changes().empty()) << instance.changes(0).text();
  for (const v1::Cell& cell : instance.map().cells()) EXPECT_EQ(cell.from(), 0u);
}

void ExpectEachBodyOnce(const ClusterHarness& harness, std::uint64_t regions) {
  const auto bodies = harness.Bodies();
  EXPECT_EQ(bodies.size(), regions * FakeWorld::kBodiesEach);
  for (const auto& [body, owners] : bodies) EXPECT_EQ(owners, 1) << "body " << body;
}

void ExpectNoIncarnationTwice(const ClusterHarness& harness) {
  for (const auto& [name, agent] : harness.agents) {
    for (const auto& [key, times] : agent.fake.starts) EXPECT_EQ(times, 1) << name << " region " << std::get<1>(key);
  }
}

}  // namespace tessera::control
