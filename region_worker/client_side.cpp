#include "region_worker/client_side.h"

#include "absl/status/status.h"

namespace tessera::worker {

void ClientSide::Open(const OpenPorts& action, const net::EndpointIdentity& self, WorkerCore& core,
                      const std::string& scene_hash, bool quiet) {
  const Scene& scene = *core.scene();
  port_.Open(
      {.self = self,
       .tick_rate_hz = scene.tick_rate_hz,
       .snapshot_rate_hz = action.snapshot_rate_hz,
       .map = action.map,
       .quiet = quiet},
      [&core](PlayerNumber player, net::Generation generation) { return core.Admit(player, generation); },
      [&core](PlayerNumber player) { return core.EndedBecause(player); });
  snapshots_.emplace(self.region, scene, action.snapshot_rate_hz, replication::SnapshotSettingsFor(scene), metrics_);
  pairs_.emplace(scene.view.radius_m);
  scene_desk_.emplace(core.scene(), scene_hash);
}

void ClientSide::Service(WorkerCore& core, TimePoint now) {
  const RegionRun* run = core.run();
  const Tick tick = run != nullptr ? run->region().tick() : Tick();
  const bool started = run != nullptr && run->ticks().running();
  const ReceivedFromClients from_clients = port_.Service(now, tick, started);
  for (const auto& [from, bytes] : from_clients.acknowledgements) snapshots_->Acknowledge(from, bytes);
  for (const PlayerInput& input : from_clients.inputs) TakeInput(core, input, now);
  for (const auto& command : from_clients.commands) TakeCommand(core, command, now);
  for (const auto& [player, event] : from_clients.event_acknowledgements) core.AcknowledgeEvents(player, event);
  core.SetConnected(port_.players());
  ServeScene(from_clients, now);
}

void ClientSide::TakeInput(WorkerCore& core, const PlayerInput& input, TimePoint now) {
  const absl::Status status = core.TakeInput(input);
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return metrics_.inputs_applied.Increment();
    case absl::StatusCode::kAlreadyExists:
      return;  // a copy, sent in case the first was lost
    case absl::StatusCode::kOutOfRange:
      return metrics_.inputs_late.Increment();
    case absl::StatusCode::kNotFound:
      // The body is being handed over, to or from here: not the player's fault, and a copy may find it here.
      return metrics_.inputs_not_owner.Increment();
    default:
      metrics_.inputs_refused.Increment();
      port_.ReportRefused(input, status.message(), now);
  }
}

void ClientSide::TakeCommand(WorkerCore& core, const ReceivedFromClients::Command& command, TimePoint now) {
  const absl::Status status = core.TakeCommand(
      command.player, {command.base, command.number, command.bytes, command.shown_at, command.with_input});
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return metrics_.commands_taken.Increment();
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kOutOfRange:
      return;  // a copy, or one that comes again
    default:
      metrics_.commands_refused.Increment();
      port_.ReportRefused(command.player, command.number, status.message(), !absl::IsResourceExhausted(status), now);
  }
}

void ClientSide::ServeScene(const ReceivedFromClients& from_clients, TimePoint now) {
  if (!scene_desk_) return;
  scene_desk_->Retain([this](net::PeerHandle peer) { return port_.clients().contains(peer); });
  for (const auto& [peer, request] : from_clients.scene_requests) scene_desk_->Take(peer, request);
  for (const auto& [peer, request] : from_clients.tile_requests) scene_desk_->Take(peer, request);
  const std::uint64_t before = scene_desk_->sent_bytes();
  (void)scene_desk_->Serve(
      now, [this](net::PeerHandle peer, std::span<const std::uint8_t> message) { port_.SendScene(peer, message); });
  if (scene_desk_->sent_bytes() == before) return;
  metrics_.scene_bytes.Increment(static_cast<double>(scene_desk_->sent_bytes() - before));
  port_.Flush();
}

void ClientSide::GreetInPause(const RegionRun& run) {
  if (!snapshots_ || !run.clock().paused() || !run.ticks().running()) return;
  snapshots_->ShowStanding(run.region(), run.places(), port_);
  pairs_->AfterTick(run.region(), {}, run.places(), port_);
}

void ClientSide::Publish(const PublishClock& action) {
  v1::WorldClock clock;
  clock.set_paused(action.clock.paused);
  clock.set_ticks_per_second(action.clock.ticks_per_second);
  clock.set_tick(action.tick.value());
  port_.SetClock(clock);
}

void ClientSide::Publish(const PublishStep& action, const RegionRun& run) {
  snapshots_->AfterTick(run.region(), action.result.departures, run.places(), port_);
  pairs_->AfterTick(run.region(), action.result.events, run.places(), port_);
  news_.AfterTick(run.region(), port_);
  world_news_.AfterTick(run.region(), port_);
}

}  // namespace tessera::worker
