// WorkerShell: one worker process around its core (core/worker_core.h): it owns the sockets, the files, the threads,
// the clock, the metrics and the log, feeds events to the core and carries out its actions.
//
// Everything but the talk with the agent and the serving of metrics happens in one thread, in one loop: what came, a
// tick if one is due, a report if one is due, wait.
//
//   WorkerShell worker(options, signals);
//   return worker.Run();
//
// Thread rule: one thread, the one that runs it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "region_worker/agent_link.h"
#include "region_worker/checkpoint_writer.h"
#include "region_worker/client_side.h"
#include "region_worker/core/worker_core.h"
#include "region_worker/figures_feed.h"
#include "region_worker/region_links.h"
#include "region_worker/standalone.h"
#include "region_worker/tick_meter.h"
#include "region_worker/wait.h"
#include "region_worker/worker_metrics.h"
#include "region_worker/worker_options.h"
#include "telemetry/metrics_server.h"

namespace tessera::worker {

class WorkerShell {
 public:
  WorkerShell(WorkerOptions options, const SignalWatch& signals);

  // Until it is to end; the exit status of the process. What went wrong has been said in one line on stderr.
  int Run();

 private:
  // Start.
  absl::Status Bind(const StandaloneWorld& world);

  // One round of the loop.
  void TakeFromAgent(TimePoint now);
  void ServiceNetwork();
  void Step(TimePoint now);
  void PrintStatus(TimePoint now);
  void Wait(bool stepped);

  // The core's actions.
  void CarryOut();
  void Do(const SendMessage& action);
  void Do(const FlushLinks& action);
  void Do(const CutLink& action);
  void Do(const RequestScene& action);
  void Do(const RequestGame& action);
  void Do(const RequestModule& action);
  void Do(const RequestMovement& action);
  void Do(const RequestState& action);
  void Do(WriteCheckpoint& action);
  void Do(const OpenPorts& action);
  void Do(const PublishMap& action);
  void Do(const PublishStart& action);
  void Do(const PublishClock& action);
  void Do(const PublishStep& action);
  void Do(const ExpelPlayer& action);
  void Do(const ReplacePlayer& action);
  void Do(SendReport& action);
  void Do(const SendInventory& action);
  void Do(const AskForLease& action);
  void Do(const RaisePriority& action);
  void Do(const AskWholeOrder& action);
  void Do(const Log& action);
  void Do(const PrintFailure& action);

  void SayFarewell();

  WorkerOptions options_;
  const SignalWatch& signals_;
  const net::SigningKey key_ = net::SigningKey::Make();  // this process' own, and nobody else's
  WorkerMetrics metrics_;
  std::unique_ptr<telemetry::MetricsServer> metrics_server_;
  std::optional<RegionLinks> links_;
  std::optional<ClientSide> clients_;
  std::unique_ptr<AgentLink> agent_;  // null when standalone
  std::optional<WorkerCore> core_;    // once the ports are bound
  std::string scene_hash_;            // that the order gave; empty when standalone
  FiguresFeed figures_{metrics_};
  TickMeter meter_{metrics_};
  CheckpointWriter checkpoint_writer_;
  TimePoint next_status_{};
};

}  // namespace tessera::worker
