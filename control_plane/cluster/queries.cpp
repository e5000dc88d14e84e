#include "control_plane/cluster/queries.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "control_plane/branches.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/views.h"
#include "control_plane/life.h"
#include "control_plane/pages.h"

namespace tessera::control {

absl::StatusOr<v1::ListHostsResponse> ListHosts(const ClusterState& state, const v1::ListHostsRequest& request) {
  const auto page = ReadPage(request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  v1::ListHostsResponse response;
  const bool reaches = ReachesOtherMachines(state);
  for (auto it = state.hosts().upper_bound(page->after); it != state.hosts().end(); ++it) {
    if (response.hosts_size() == page->size) {
      response.set_next_page_token(PageToken(std::prev(it)->first));
      break;
    }
    v1::Host& view = *response.add_hosts() = ViewOf(it->second);
    AddNotes(it->second, reaches, view);
  }
  return response;
}

absl::StatusOr<v1::GetHostResponse> GetHost(const ClusterState& state, const v1::GetHostRequest& request) {
  const HostEntry* host = FindHostByName(state, request.name());
  if (host == nullptr) return NoHost(request.name());
  v1::GetHostResponse response;
  *response.mutable_host() = ViewOf(*host);
  AddNotes(*host, ReachesOtherMachines(state), *response.mutable_host());
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
                                                        const v1::ListInstancesRequest& request,
                                                        const std::function<bool(const std::string&)>& is_shown) {
  const auto page = ReadPage(request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  v1::ListInstancesResponse response;
  std::uint64_t last = page->after;
  for (auto it = state.instances().upper_bound(page->after); it != state.instances().end(); ++it) {
    if (is_shown && !is_shown(it->second.record.id())) continue;
    if (response.instances_size() == page->size) {
      response.set_next_page_token(PageToken(last));
      break;
    }
    *response.add_instances() = SummaryOf(it->second);
    last = it->first;
  }
  return response;
}

bool ShowsScene(const ClusterState& state, const std::string& hash,
                const std::function<bool(const std::string&)>& is_shown) {
  return std::any_of(state.instances().begin(), state.instances().end(), [&](const auto& entry) {
    const records::Instance& record = entry.second.record;
    return record.scene_hash() == hash && is_shown(record.id());
  });
}

bool ShowsVisual(const ClusterState& state, const std::string& sha256,
                 const std::function<bool(const std::string&)>& is_shown) {
  return std::any_of(state.instances().begin(), state.instances().end(), [&](const auto& entry) {
    const records::Instance& record = entry.second.record;
    const auto& visuals = record.visuals();
    return std::find(visuals.begin(), visuals.end(), sha256) != visuals.end() && is_shown(record.id());
  });
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

// It looks at what it needs alone: this runs under the lock, and an instance's view has its whole map and every report.
namespace {

// One that waits for players may wait for as long as it likes.
bool IsUnderWay(v1::InstanceState state) {
  return state == v1::INSTANCE_STATE_PENDING || state == v1::INSTANCE_STATE_PLACING ||
         state == v1::INSTANCE_STATE_STARTING || state == v1::INSTANCE_STATE_STOPPING;
}

}  // namespace

ClusterSummary Summarise(const ClusterState& state, std::uint64_t newest_revocations) {
  ClusterSummary summary;
  summary.store_failing = !state.store_trouble().empty();
  summary.checkpoints_stopped = !state.checkpoint_trouble().empty();
  summary.failed_writes = state.failed_writes();
  summary.records_set_aside = state.set_aside().size();
  for (const auto& [number, host] : state.hosts()) {
    ++summary.hosts[StateOf(host)];
    if (host.stream == 0) continue;
    if (host.clock_ahead_s) summary.clocks_ahead_s[host.record.name()] = *host.clock_ahead_s;
    summary.behind_revocations[host.record.name()] = host.kept_revocations < newest_revocations;
  }
  for (const auto& numbered : state.instances()) {
    const InstanceEntry& instance = numbered.second;
    const v1::InstanceState state_now = StateOf(instance);
    ++summary.instances[state_now];
    if (IsUnderWay(state_now)) summary.under_way[instance.record.id()] = state_now;
    if (instance.over_checkpoint_quota && WantsWorkers(instance.record.state())) ++summary.over_checkpoint_quota;
    const records::Instance& record = instance.record;
    if (record.state() != v1::INSTANCE_STATE_RUNNING) continue;
    InstanceHealth& health = summary.health.emplace_back();
    health.id = record.id();
    health.unprotected =
        static_cast<int>(std::count_if(instance.workers.begin(), instance.workers.end(),
                                       [&](const auto& worker) { return IsUnprotected(instance, worker); }));
    health.uncovered_regions = instance.uncovered_regions;
    health.still_regions = instance.still_regions;
    health.degraded = !instance.degraded.empty();
    health.taken_back = !instance.taken_back.empty();
    health.lacks_room = !instance.lacks_room.empty();
    health.cut_links = instance.cut_links.size();
    health.moved_regions = instance.moved_regions;
    if (const v1::Checkpoint* newest = NewestKept(record.checkpoints())) {
      health.last_checkpoint = FromTimestamp(newest->create_time());
    }
    health.imbalance = ImbalanceOf(instance);
    health.lost_bodies = record.lost_bodies();
    health.lost_ticks = record.lost_ticks();
    if (record.has_lost_time()) health.last_loss = FromTimestamp(record.lost_time());
    health.published_events = instance.published_events;
    health.game_messages_waiting = instance.game_messages_waiting;
    health.checkpoints_expected = record.checkpoint_interval_ms() > 0;
  }
  return summary;
}

namespace {

// Where a process of the host serves its metrics.
std::string MetricsAt(const HostEntry& host, std::uint32_t port) {
  const std::string& own = host.record.metrics_address();
  const std::string& address = own.empty() ? host.record.advertise_address() : own;
  return absl::StrContains(address, ':') ? absl::StrCat("[", address, "]:", port) : absl::StrCat(address, ":", port);
}

}  // namespace

std::vector<ScrapeTarget> ScrapeTargets(const ClusterState& state) {
  std::vector<ScrapeTarget> targets;
  for (const auto& [number, host] : state.hosts()) {
    if (host.record.secret_hash().empty() || host.record.metrics_port() == 0) continue;
    targets.push_back({MetricsAt(host, host.record.metrics_port()), host.record.name(), "", 0});
  }
  for (const auto& [number, instance] : state.instances()) {
    for (std::size_t i = 0; i < instance.workers.size(); ++i) {
      const WorkerEntry& worker = instance.workers[i];
      const std::uint32_t port = worker.report.address().metrics_port();
      const HostEntry* host = HostAt(state, instance, i);
      if (!worker.bound() || port == 0 || host == nullptr) continue;
      targets.push_back({MetricsAt(*host, port), host->record.name(), instance.record.id(), worker.region});
    }
  }
  return targets;
}

}  // namespace tessera::control
