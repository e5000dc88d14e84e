// Worker: the life of one worker process: LOADING -> BOUND -> LINKED -> RUNNING -> STOPPING.
//
// It compares what it is with the newest order and does the difference; what an order leaves open it waits for.
// Everything but the talk with the agent and the serving of metrics happens in one thread, in one loop: what came, a
// tick if one is due, a report if one is due, wait.
//
//   Worker worker(options, signals);
//   return worker.Run();
//
// Thread rule: one thread, the one that runs it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "region_worker/agent_link.h"
#include "region_worker/game_port.h"
#include "region_worker/map_follower.h"
#include "region_worker/order.h"
#include "region_worker/region_links.h"
#include "region_worker/report.h"
#include "region_worker/state_file.h"
#include "region_worker/tick_loop.h"
#include "region_worker/wait.h"
#include "region_worker/wards.h"
#include "region_worker/worker_metrics.h"
#include "region_worker/worker_options.h"
#include "telemetry/metrics_server.h"

namespace tessera::worker {

class Worker {
 public:
  Worker(WorkerOptions options, const SignalWatch& signals);

  // Until told to end; the exit status of the process. What went wrong has been said in one line on stderr.
  int Run();

 private:
  // Start.
  absl::Status Bind();
  absl::Status PrepareByHand();
  bool CanBuild() const;
  absl::Status Build();
  absl::StatusOr<region::Config> MakeConfig() const;
  void OpenPorts();

  // One round of the loop.
  void TakeOrder();
  void Adopt(Order order);
  void ApplyOrder();
  bool MustRebuild() const;
  void FollowMaps();
  v1::RegionMap MapForClients() const;
  void TellInventory(TimePoint now);
  void ServiceNetwork();
  void OnLinkMessage(RegionId from, const LinkMessage& message, TimePoint now);
  void KeepLease(TimePoint now);
  void KeepCheckpoint();
  void Progress();
  void TakePriority();
  bool StartIsDue() const;
  void Report(TimePoint now);
  void PrintStatus(TimePoint now);
  void Wait(bool stepped);

  // End.
  void Stop(std::string reason);
  void Fail(const absl::Status& status);
  void SayFarewell();

  Admission Admit(PlayerNumber player);
  ReportedState State() const;

  WorkerOptions options_;
  const SignalWatch& signals_;
  WorkerMetrics metrics_;
  std::unique_ptr<telemetry::MetricsServer> metrics_server_;
  std::optional<RegionLinks> links_;
  std::optional<GamePort> game_;
  std::unique_ptr<AgentLink> agent_;  // null by hand
  std::shared_ptr<const Scene> scene_;
  // Once the world is built.
  std::optional<TickLoop> ticks_;
  std::optional<Wards> wards_;
  std::optional<MapFollower> follower_;

  Order order_;
  v1::RegionAddress address_;
  v1::WorkerPhase phase_ = v1::WORKER_PHASE_LOADING;
  std::string stop_reason_, failure_;
  StateWriter state_writer_;
  std::optional<Tick> saving_;  // the newest checkpoint that was begun or given up
  Tick checkpoint_tick_;
  std::string checkpoint_failure_;
  bool inventory_told_ = false;
  ReportGate report_gate_;
  TimePoint running_since_{}, next_status_{};
};

}  // namespace tessera::worker
