// ClientSide: all that a region has to do with its clients: what they ask comes in, what a step made goes out.
//
//   ClientSide clients(*std::move(endpoint), metrics);
//   clients.Open(action, self, core, scene_hash);        // when the core says so
//   loop: clients.Service(core, now);                    // then the core's actions
//         clients.Publish(action.result, *core.run());   // after each step
//
// Nothing that a client sends is trusted. Thread rule: one thread, the core's.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "net/endpoint.h"
#include "region_worker/core/worker_core.h"
#include "region_worker/game_port.h"
#include "region_worker/pair_broadcast.h"
#include "region_worker/player_news.h"
#include "region_worker/scene_desk.h"
#include "region_worker/snapshot_broadcast.h"
#include "region_worker/worker_metrics.h"
#include "region_worker/world_news.h"

namespace tessera::worker {

class ClientSide {
 public:
  ClientSide(std::unique_ptr<net::Endpoint> endpoint, WorkerMetrics& metrics)
      : port_(std::move(endpoint), metrics), metrics_(metrics), news_(metrics) {}

  GamePort& port() { return port_; }
  const GamePort& port() const { return port_; }

  // From now on clients may come in. `core` has a world by now, and outlives this. Once. `quiet`: as in GameRules.
  void Open(const OpenPorts& action, const net::EndpointIdentity& self, WorkerCore& core, const std::string& scene_hash,
            bool quiet = false);
  // Takes in what has come, for the core, without waiting.
  void Service(WorkerCore& core, TimePoint now);
  // No tick shows the world to who comes while it is paused.
  void GreetInPause(const RegionRun& run);

  // The core's actions.
  void Publish(const PublishClock& action);
  void Publish(const PublishStep& action, const RegionRun& run);

 private:
  void TakeInput(WorkerCore& core, const PlayerInput& input, TimePoint now);
  void TakeCommand(WorkerCore& core, const ReceivedFromClients::Command& command, TimePoint now);
  void ServeScene(const ReceivedFromClients& from_clients, TimePoint now);

  GamePort port_;
  WorkerMetrics& metrics_;
  PlayerNewsFeed news_;
  WorldNewsFeed world_news_;
  std::optional<SnapshotBroadcast> snapshots_;  // once it is open, as the next two
  std::optional<PairBroadcast> pairs_;
  std::optional<SceneDesk> scene_desk_;
};

}  // namespace tessera::worker
