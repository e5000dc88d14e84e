#include "control_plane/testing/state_rig.h"

#include <algorithm>

#include "control_plane/instance_record.h"
#include "control_plane/standbys.h"
#include "control_plane/testing/test_plan.h"

namespace tessera::control {

StateRig::StateRig() : state(*ClusterState::Load(store)) {}

HostEntry& StateRig::AddHost(const std::string& name, std::uint32_t capacity) {
  records::Host record;
  record.set_name(name);
  record.set_secret_hash("hash");
  record.mutable_resources()->set_region_capacity(capacity);
  HostEntry& host = **state->AddHost(record);
  host.last_heard = now.steady;
  return host;
}

InstanceEntry& StateRig::AddRunning(const std::vector<HostEntry*>& hosts) {
  const InstancePlan plan = TestPlan(static_cast<std::uint32_t>(hosts.size()));
  PlacementPlan placed;
  for (std::size_t i = 0; i < hosts.size(); ++i) {
    placed.regions.push_back({plan.map.regions()[i].id, hosts[i]->record.id()});
  }
  const auto host_of = [&](RegionId region) { return hosts[region.value() - 1]->record.id(); };
  placed.map = *WithStandbys(plan.map, host_of, [](RegionId, RegionId) { return false; });
  records::Instance record = NewInstance(plan, placed, now);
  record.set_state(v1::INSTANCE_STATE_RUNNING);
  record.set_run(true);
  record.set_signing_seed(std::string(32, 'k'));
  InstanceEntry& instance = **state->AddInstance(record, plan.contents);
  for (WorkerEntry& worker : instance.workers) {
    worker.reported = true;
    worker.reported_at = now.steady;
    worker.report.set_phase(v1::WORKER_PHASE_RUNNING);
    worker.report.set_map_version(record.map().version());
    worker.report.set_tick(100);
    worker.report.mutable_address()->set_game_port(20000 + worker.region);
    WorkerEntry& standby = WorkerOf(instance, StandbyOf(instance.record, worker.region));
    v1::StandbyStatus& copy = *standby.report.add_standby_copies();
    copy.set_region(worker.region);
    copy.set_incarnation(worker.incarnation);
    copy.set_tick(100);
  }
  return instance;
}

void StateRig::Pass(std::chrono::milliseconds span) {
  now.steady += span;
  now.unix_time += span;
  for (HostEntry& host : state->EachHost()) host.last_heard = now.steady;
}

// The first worker if there is none of that region.
WorkerEntry& StateRig::WorkerOf(InstanceEntry& instance, std::uint32_t region) {
  const auto found = std::find_if(instance.workers.begin(), instance.workers.end(),
                                  [region](const WorkerEntry& worker) { return worker.region == region; });
  return found == instance.workers.end() ? instance.workers.front() : *found;
}

v1::WorkerIdentity StateRig::IdentityOf(const InstanceEntry& instance, const WorkerEntry& worker) {
  v1::WorkerIdentity identity;
  identity.set_instance_id(instance.record.id());
  identity.set_region(worker.region);
  identity.set_incarnation(worker.incarnation);
  return identity;
}

}  // namespace tessera::control
