#include "control_plane/control_metrics.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "control_plane/retry_after.h"

namespace tessera::control {
namespace {

// Seconds. They reach from an answer out of memory to one that waits for a disk or for workers.
const prometheus::Histogram::BucketBoundaries kRpcBuckets{0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05,
                                                          0.1,    0.25,  0.5,    1,     2.5,  10};

// "INSTANCE_STATE_RUNNING" is "running".
std::string Label(const std::string& name, std::size_t prefix) { return absl::AsciiStrToLower(name.substr(prefix)); }

// All methods whose answers are timed, so that each is there from the start.
constexpr const char* kMethods[] = {"HostService/AddHost",
                                    "HostService/ListHosts",
                                    "HostService/GetHost",
                                    "HostService/DrainHost",
                                    "HostService/RemoveHost",
                                    "InstanceService/CreateInstance",
                                    "InstanceService/GetInstance",
                                    "InstanceService/ListInstances",
                                    "InstanceService/DeleteInstance",
                                    "SessionService/JoinInstance",
                                    "SessionService/GetScene",
                                    "SessionService/LeaveInstance",
                                    "VisualService/FindMissingVisuals",
                                    "VisualService/PutVisual",
                                    "VisualService/GetVisual",
                                    "AgentLinkService/FetchScene",
                                    "AgentLinkService/FetchGame",
                                    "InstanceService/ScaleInstance",
                                    "InstanceService/RestartWorkers",
                                    "InstanceService/PauseInstance",
                                    "InstanceService/ResumeInstance",
                                    "InstanceService/SetPace",
                                    "InstanceService/SetGame",
                                    "InstanceService/ListGameLines",
                                    "InstanceService/SendToGame",
                                    "InstanceService/CheckpointInstance",
                                    "InstanceService/ListCheckpoints",
                                    "InstanceService/RestoreInstance",
                                    "InstanceService/UpgradeInstance",
                                    "InstanceService/ExportCheckpoint",
                                    "InstanceService/ImportCheckpoint",
                                    "InstanceService/PutScene",
                                    "SessionService/StreamScene",
                                    "AgentLinkService/StreamScene",
                                    "AgentLinkService/FetchState",
                                    "AgentLinkService/UploadCheckpoint"};

void AddGauge(prometheus::MetricFamily& family, std::string state, int value) {
  prometheus::ClientMetric metric;
  metric.label.push_back({"state", std::move(state)});
  metric.gauge.value = value;
  family.metric.push_back(std::move(metric));
}

// Adds families with one value for each running instance.
void AddHealth(const std::vector<InstanceHealth>& all, std::vector<prometheus::MetricFamily>& families) {
  struct HealthMetric {
    prometheus::MetricType type;
    const char *name, *help;
    double (*value)(const InstanceHealth&);
    bool (*known)(const InstanceHealth&);
  };
  const auto always = [](const InstanceHealth&) { return true; };
  using enum prometheus::MetricType;
  const HealthMetric metrics[] = {
      {Gauge, "tessera_control_degraded", "1 while the instance is not what RUNNING promises, else 0",
       [](const InstanceHealth& health) { return health.degraded ? 1.0 : 0.0; }, always},
      {Gauge, "tessera_control_change_taken_back",
       "1 while the instance's last change of who runs what is taken back, since new workers got no links, else 0",
       [](const InstanceHealth& health) { return health.taken_back ? 1.0 : 0.0; }, always},
      {Gauge, "tessera_control_change_waits", "1 while a change of who runs what waits for a host with room, else 0",
       [](const InstanceHealth& health) { return health.lacks_room ? 1.0 : 0.0; }, always},
      {Gauge, "tessera_control_unprotected_regions", "regions whose death now would cost time or bodies",
       [](const InstanceHealth& health) { return static_cast<double>(health.unprotected); }, always},
      {Gauge, "tessera_control_uncovered_regions",
       "regions without a whole copy elsewhere for so long that it degrades them",
       [](const InstanceHealth& health) { return static_cast<double>(health.uncovered_regions); }, always},
      {Gauge, "tessera_control_still_regions", "regions that are not known to step",
       [](const InstanceHealth& health) { return static_cast<double>(health.still_regions); }, always},
      {Gauge, "tessera_control_cut_links",
       "pairs of neighbours that have had no link for so long that it degrades them",
       [](const InstanceHealth& health) { return static_cast<double>(health.cut_links); }, always},
      {Gauge, "tessera_control_checkpoint_timestamp_seconds",
       "when the newest checkpoint was made; 0: there is none yet",
       [](const InstanceHealth& health) { return std::chrono::duration<double>(health.last_checkpoint).count(); },
       [](const InstanceHealth& health) { return health.checkpoints_expected || health.last_checkpoint.count() > 0; }},
      {Gauge, "tessera_control_imbalance", "step time of the busiest region by the mean of all",
       [](const InstanceHealth& health) { return health.imbalance; },
       [](const InstanceHealth& health) { return health.imbalance > 0; }},
      {Counter, "tessera_control_moved_regions_total", "regions moved away from slow hosts and cut links",
       [](const InstanceHealth& health) { return static_cast<double>(health.moved_regions); }, always},
      {Counter, "tessera_control_lost_bodies_total", "bodies lost by failovers",
       [](const InstanceHealth& health) { return static_cast<double>(health.lost_bodies); }, always},
      {Counter, "tessera_control_lost_ticks_total", "ticks lost by restoring from checkpoints",
       [](const InstanceHealth& health) { return static_cast<double>(health.lost_ticks); }, always},
      {Gauge, "tessera_control_lost_timestamp_seconds",
       "when the instance last lost bodies or time, also where nobody knows how much; 0: never",
       [](const InstanceHealth& health) { return std::chrono::duration<double>(health.last_loss).count(); }, always},
      {Gauge, "tessera_control_game_events", "events that the game published for its backend",
       [](const InstanceHealth& health) { return static_cast<double>(health.published_events); }, always},
      {Gauge, "tessera_control_game_messages_waiting", "messages of the game's backend that no region has answered",
       [](const InstanceHealth& health) { return static_cast<double>(health.game_messages_waiting); }, always},
  };
  for (const HealthMetric& entry : metrics) {
    prometheus::MetricFamily family{entry.name, entry.help, entry.type, {}};
    for (const InstanceHealth& health : all) {
      if (!entry.known(health)) continue;
      prometheus::ClientMetric metric;
      metric.label.push_back({"instance_id", health.id});
      (entry.type == Counter ? metric.counter.value : metric.gauge.value) = entry.value(health);
      family.metric.push_back(std::move(metric));
    }
    families.push_back(std::move(family));
  }
}

}  // namespace

ControlMetrics::ControlMetrics()
    : registry_(std::make_shared<prometheus::Registry>()),
      placements_(prometheus::BuildCounter()
                      .Name("tessera_control_placements_total")
                      .Help("placements tried, by result")
                      .Register(*registry_)),
      sessions_(prometheus::BuildCounter()
                    .Name("tessera_control_sessions_total")
                    .Help("joins, by result")
                    .Register(*registry_)),
      connections_(prometheus::BuildGauge()
                       .Name("tessera_control_connections")
                       .Help("connections that are open, by the door")
                       .Register(*registry_)),
      refused_connections_(prometheus::BuildCounter()
                               .Name("tessera_control_refused_connections_total")
                               .Help("connections that were closed at once, by the door and what was full")
                               .Register(*registry_)),
      rpc_seconds_(prometheus::BuildHistogram()
                       .Name("tessera_control_rpc_seconds")
                       .Help("time to answer a call")
                       .Register(*registry_)),
      failover_seconds_(prometheus::BuildHistogram()
                            .Name("tessera_control_failover_seconds")
                            .Help("from the failover map to the last region that runs by it")
                            .Register(*registry_)
                            .Add({}, kRpcBuckets)),
      write_seconds_(prometheus::BuildHistogram()
                         .Name("tessera_control_store_write_seconds")
                         .Help("time of a write to the store, for which all decisions wait")
                         .Register(*registry_)
                         .Add({}, kRpcBuckets)),
      leads_(prometheus::BuildGauge()
                 .Name("tessera_control_leads")
                 .Help("1: this control plane leads, as one without others does; 0: it follows")
                 .Register(*registry_)
                 .Add({})) {
  for (const char* result : {"placed", "no_room", "failed"}) placements_.Add({{"result", result}});
  for (const char* result : {"joined", "refused", "limited", "gave_up"}) sessions_.Add({{"result", result}});
  for (const char* door : {"operators", "players"}) {
    connections_.Add({{"door", door}});
    for (const char* reason : {"address", "door"}) refused_connections_.Add({{"door", door}, {"reason", reason}});
  }
  for (const char* method : kMethods) rpc_seconds_.Add({{"method", method}}, kRpcBuckets);
}

void ControlMetrics::CountPlacement(const absl::Status& status) {
  const char* result = status.ok() ? "placed" : absl::IsResourceExhausted(status) ? "no_room" : "failed";
  placements_.Add({{"result", result}}).Increment();
}

void ControlMetrics::CountSession(const absl::Status& status) {
  const bool gave_up = absl::IsCancelled(status) || absl::IsDeadlineExceeded(status);
  const bool limited = RetryAfterOf(status).has_value();
  const char* result = status.ok() ? "joined" : gave_up ? "gave_up" : limited ? "limited" : "refused";
  sessions_.Add({{"result", result}}).Increment();
}

void ControlMetrics::SetConnections(const std::string& door, std::size_t open) {
  connections_.Add({{"door", door}}).Set(static_cast<double>(open));
}

void ControlMetrics::CountRefusedConnection(const std::string& door, const std::string& reason) {
  refused_connections_.Add({{"door", door}, {"reason", reason}}).Increment();
}

void ControlMetrics::ObserveFailover(std::chrono::nanoseconds took) {
  failover_seconds_.Observe(std::chrono::duration<double>(took).count());
}

void ControlMetrics::ObserveWrite(std::chrono::nanoseconds took) {
  write_seconds_.Observe(std::chrono::duration<double>(took).count());
}

void ControlMetrics::ObserveRpc(const std::string& method, std::chrono::nanoseconds took) {
  rpc_seconds_.Add({{"method", method}}, kRpcBuckets).Observe(std::chrono::duration<double>(took).count());
}

std::vector<prometheus::MetricFamily> SummaryMetrics::Collect() const {
  const ClusterSummary summary = count_.Get(std::chrono::steady_clock::now());
  prometheus::MetricFamily hosts{"tessera_control_hosts", "hosts by state", prometheus::MetricType::Gauge, {}};
  for (int state = v1::HOST_STATE_EXPECTED; state <= v1::HOST_STATE_DRAINING; ++state) {
    const auto found = summary.hosts.find(static_cast<v1::HostState>(state));
    AddGauge(hosts, Label(v1::HostState_Name(state), sizeof("HOST_STATE_") - 1),
             found == summary.hosts.end() ? 0 : found->second);
  }
  prometheus::MetricFamily instances{
      "tessera_control_instances", "instances by state", prometheus::MetricType::Gauge, {}};
  for (int state = v1::INSTANCE_STATE_PENDING; state <= v1::InstanceState_MAX; ++state) {
    const auto found = summary.instances.find(static_cast<v1::InstanceState>(state));
    AddGauge(instances, Label(v1::InstanceState_Name(state), sizeof("INSTANCE_STATE_") - 1),
             found == summary.instances.end() ? 0 : found->second);
  }
  prometheus::MetricFamily under_way{"tessera_control_under_way",
                                     "1 for an instance that is to start or stop, and has not yet",
                                     prometheus::MetricType::Gauge,
                                     {}};
  for (const auto& [id, state] : summary.under_way) {
    prometheus::ClientMetric& metric = under_way.metric.emplace_back();
    metric.label.push_back({"instance_id", id});
    metric.label.push_back({"state", Label(v1::InstanceState_Name(state), sizeof("INSTANCE_STATE_") - 1)});
    metric.gauge.value = 1;
  }
  prometheus::MetricFamily writes{
      "tessera_control_store_writes_total", "writes to the store", prometheus::MetricType::Counter, {}};
  prometheus::ClientMetric written;
  written.counter.value = static_cast<double>(std::max<Revision>(0, revision_() - first_revision_));
  writes.metric.push_back(written);
  prometheus::MetricFamily failures{
      "tessera_control_store_failures_total", "writes to the store that failed", prometheus::MetricType::Counter, {}};
  failures.metric.emplace_back().counter.value = static_cast<double>(summary.failed_writes);
  prometheus::MetricFamily failing{"tessera_control_store_failing",
                                   "1 if the last write to the store failed, else 0",
                                   prometheus::MetricType::Gauge,
                                   {}};
  failing.metric.emplace_back().gauge.value = summary.store_failing ? 1 : 0;
  prometheus::MetricFamily stopped{"tessera_control_checkpoints_stopped",
                                   "1 while no checkpoint is made, for want of room, else 0",
                                   prometheus::MetricType::Gauge,
                                   {}};
  stopped.metric.emplace_back().gauge.value = summary.checkpoints_stopped ? 1 : 0;
  prometheus::MetricFamily too_large{"tessera_control_checkpoints_too_large",
                                     "instances whose last checkpoint was larger than the quota, and not made",
                                     prometheus::MetricType::Gauge,
                                     {}};
  too_large.metric.emplace_back().gauge.value = summary.over_checkpoint_quota;
  prometheus::MetricFamily set_aside{"tessera_control_records_set_aside",
                                     "records of the store that cannot be read, and without which the cluster goes on",
                                     prometheus::MetricType::Gauge,
                                     {}};
  set_aside.metric.emplace_back().gauge.value = static_cast<double>(summary.records_set_aside);
  prometheus::MetricFamily strays{"tessera_control_stray_checkpoints",
                                  "worlds of which checkpoints are kept, and which the store did not know at the start",
                                  prometheus::MetricType::Gauge,
                                  {}};
  strays.metric.emplace_back().gauge.value = static_cast<double>(summary.stray_checkpoints);
  prometheus::MetricFamily visuals{"tessera_control_visual_bytes",
                                   "bytes that files of meshes take in the store",
                                   prometheus::MetricType::Gauge,
                                   {}};
  visuals.metric.emplace_back().gauge.value = static_cast<double>(summary.visual_bytes);
  prometheus::MetricFamily clocks{"tessera_control_host_clock_ahead_seconds",
                                  "the host's wall clock against the control plane's; below 0: behind it",
                                  prometheus::MetricType::Gauge,
                                  {}};
  for (const auto& [name, ahead_s] : summary.clocks_ahead_s) {
    prometheus::ClientMetric& metric = clocks.metric.emplace_back();
    metric.label.push_back({"host", name});
    metric.gauge.value = ahead_s;
  }
  prometheus::MetricFamily behind{"tessera_control_host_revocations_behind",
                                  "1 while the host does not keep the newest list of revocations, else 0",
                                  prometheus::MetricType::Gauge,
                                  {}};
  for (const auto& [name, is_behind] : summary.behind_revocations) {
    prometheus::ClientMetric& metric = behind.metric.emplace_back();
    metric.label.push_back({"host", name});
    metric.gauge.value = is_behind ? 1 : 0;
  }
  std::vector<prometheus::MetricFamily> families{hosts,     instances, under_way, writes,  failures, failing, stopped,
                                                 too_large, set_aside, strays,    visuals, clocks,   behind};
  AddHealth(summary.health, families);
  return families;
}

}  // namespace tessera::control
