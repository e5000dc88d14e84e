// Questions about the cluster that change nothing: what clients, watchers, metrics and Prometheus ask. Pure.
//
//   const auto page = ListHosts(cluster.state(), request);
//
// Errors name the field of the request.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "tessera/v1/host.pb.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

absl::StatusOr<v1::ListHostsResponse> ListHosts(const ClusterState& state, const v1::ListHostsRequest& request);
absl::StatusOr<v1::GetHostResponse> GetHost(const ClusterState& state, const v1::GetHostRequest& request);

absl::StatusOr<v1::Instance> GetInstance(const ClusterState& state, const std::string& id);
// The instance that this request id made before.
absl::StatusOr<v1::Instance> GetByRequestId(const ClusterState& state, const std::string& request_id);
// Those whose ids `is_shown` accepts; null: all.
absl::StatusOr<v1::ListInstancesResponse> ListInstances(
    const ClusterState& state, const v1::ListInstancesRequest& request,
    const std::function<bool(const std::string&)>& is_shown = nullptr);
// Whether an instance that is shown uses the scene.
bool ShowsScene(const ClusterState& state, const std::string& hash,
                const std::function<bool(const std::string&)>& is_shown);
// Whether an instance that is shown is drawn with the file.
bool ShowsVisual(const ClusterState& state, const std::string& sha256,
                 const std::function<bool(const std::string&)>& is_shown);
absl::StatusOr<v1::ListCheckpointsResponse> ListCheckpoints(const ClusterState& state,
                                                            const v1::ListCheckpointsRequest& request);
// As GetInstance has it; nothing if there is no such instance.
std::optional<v1::InstanceState> StateOf(const ClusterState& state, const std::string& id);

// How a RUNNING instance fares.
struct InstanceHealth {
  std::string id;
  bool degraded = false, taken_back = false;                            // its last change was taken back
  bool lacks_room = false;                                              // a change waits for room
  int unprotected = 0;                                                  // regions
  std::size_t uncovered_regions = 0, still_regions = 0, cut_links = 0;  // that degrade it
  std::uint64_t moved_regions = 0;
  std::chrono::nanoseconds last_checkpoint{0};  // wall clock; 0: none
  double imbalance = 0;                         // 0: not known
  std::uint64_t lost_bodies = 0, lost_ticks = 0;
  std::chrono::nanoseconds last_loss{0};  // wall clock; 0: it never lost any
  std::uint64_t published_events = 0;
  std::size_t game_messages_waiting = 0;
  bool checkpoints_expected = false;
};

// How many hosts and instances are in each state, for the metrics.
struct ClusterSummary {
  std::map<v1::HostState, int> hosts;
  std::map<v1::InstanceState, int> instances;
  std::map<std::string, double> clocks_ahead_s;    // by name of a host that is attached: its wall clock against ours
  std::map<std::string, bool> behind_revocations;  // likewise: it does not keep the newest list of revocations
  std::vector<InstanceHealth> health;
  std::map<std::string, v1::InstanceState> under_way;  // by id of an instance that is to start or stop, and has not yet
  bool store_failing = false;                          // the last write failed
  bool checkpoints_stopped = false;                    // there is no room for them
  int over_checkpoint_quota = 0;                       // instances whose last one was too large
  std::size_t records_set_aside = 0;                   // that cannot be read
  std::size_t stray_checkpoints = 0;  // worlds that the store does not know, and of which checkpoints are kept
  std::uint64_t failed_writes = 0;
  std::uint64_t visual_bytes = 0;  // that files of meshes take
};
// `newest_revocations`: the number of the newest list.
ClusterSummary Summarise(const ClusterState& state, std::uint64_t newest_revocations = 0);

// A process that serves metrics.
struct ScrapeTarget {
  std::string address;      // "10.0.0.5:9101"
  std::string host;         // name
  std::string instance_id;  // empty for an agent
  std::uint32_t region = 0;
};
std::vector<ScrapeTarget> ScrapeTargets(const ClusterState& state);

}  // namespace tessera::control
