#include "control_plane/cluster/queries.h"

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/views.h"
#include "control_plane/pages.h"

namespace tessera::control {

absl::StatusOr<v1::ListHostsResponse> ListHosts(const ClusterState& state, const v1::ListHostsRequest& request) {
  const auto page = ReadPage(request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  v1::ListHostsResponse response;
  for (auto it = state.hosts().upper_bound(page->after); it != state.hosts().end(); ++it) {
    if (response.hosts_size() == page->size) {
      response.set_next_page_token(PageToken(std::prev(it)->first));
      break;
    }
    *response.add_hosts() = ViewOf(it->second);
  }
  return response;
}

absl::StatusOr<v1::GetHostResponse> GetHost(const ClusterState& state, const v1::GetHostRequest& request) {
  const HostEntry* host = FindHostByName(state, request.name());
  if (host == nullptr) return NoHost(request.name());
  v1::GetHostResponse response;
  *response.mutable_host() = ViewOf(*host);
  for (const auto& [number, index] : host->workers) {
    const WorkerEntry& worker = state.instances().at(number).workers[index];
    if (worker.reported) *response.add_workers() = worker.report;
  }
  return response;
}

absl::StatusOr<v1::Instance> GetInstance(const ClusterState& state, const std::string& id) {
  const InstanceEntry* instance = state.FindInstance(id);
  if (instance == nullptr) return NoInstance("id", id);
  return ViewOf(state, *instance);
}

absl::StatusOr<v1::Instance> GetByRequestId(const ClusterState& state, const std::string& request_id) {
  const InstanceEntry* instance = state.FindByRequestId(request_id);
  if (instance == nullptr) return absl::NotFoundError("request_id: not seen before");
  return ViewOf(state, *instance);
}

absl::StatusOr<v1::ListInstancesResponse> ListInstances(const ClusterState& state,
                                                        const v1::ListInstancesRequest& request) {
  const auto page = ReadPage(request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  v1::ListInstancesResponse response;
  for (auto it = state.instances().upper_bound(page->after); it != state.instances().end(); ++it) {
    if (response.instances_size() == page->size) {
      response.set_next_page_token(PageToken(std::prev(it)->first));
      break;
    }
    *response.add_instances() = SummaryOf(it->second);
  }
  return response;
}

absl::StatusOr<v1::ListCheckpointsResponse> ListCheckpoints(const ClusterState& state,
                                                            const v1::ListCheckpointsRequest& request) {
  const InstanceEntry* instance = state.FindInstance(request.id());
  if (instance == nullptr) return NoInstance("id", request.id());
  v1::ListCheckpointsResponse response;
  *response.mutable_checkpoints() = instance->record.checkpoints();
  return response;
}

std::optional<v1::InstanceState> StateOf(const ClusterState& state, const std::string& id) {
  const InstanceEntry* instance = state.FindInstance(id);
  if (instance == nullptr) return std::nullopt;
  return StateOf(*instance);
}

ClusterSummary Summarise(const ClusterState& state) {
  ClusterSummary summary;
  for (const auto& [number, host] : state.hosts()) ++summary.hosts[StateOf(host)];
  for (const auto& [number, instance] : state.instances()) {
    ++summary.instances[StateOf(instance)];
    if (instance.record.state() != v1::INSTANCE_STATE_RUNNING) continue;
    const v1::Instance view = ViewOf(state, instance);
    InstanceHealth& health = summary.health.emplace_back();
    health.id = view.id();
    health.unprotected = view.unprotected_regions_size();
    if (!view.checkpoints().empty()) health.last_checkpoint = FromTimestamp(view.checkpoints().rbegin()->create_time());
    health.imbalance = view.imbalance();
    health.lost_bodies = view.lost_bodies();
    health.lost_ticks = view.lost_ticks();
    health.published_events = instance.published_events;
    health.game_messages_waiting = instance.game_messages_waiting;
    health.checkpoints_expected = instance.record.checkpoint_interval_ms() > 0;
  }
  return summary;
}

std::vector<ScrapeTarget> ScrapeTargets(const ClusterState& state) {
  std::vector<ScrapeTarget> targets;
  for (const auto& [number, host] : state.hosts()) {
    if (host.record.secret_hash().empty() || host.record.metrics_port() == 0) continue;
    targets.push_back(
        {absl::StrCat(host.record.advertise_address(), ":", host.record.metrics_port()), host.record.name(), "", 0});
  }
  for (const auto& [number, instance] : state.instances()) {
    for (std::size_t i = 0; i < instance.workers.size(); ++i) {
      const WorkerEntry& worker = instance.workers[i];
      const v1::RegionAddress& address = worker.report.address();
      if (!worker.bound() || address.metrics_port() == 0) continue;
      const HostEntry* host = HostAt(state, instance, i);
      targets.push_back({absl::StrCat(address.host(), ":", address.metrics_port()),
                         host == nullptr ? "" : host->record.name(), instance.record.id(), worker.region});
    }
  }
  return targets;
}

}  // namespace tessera::control
