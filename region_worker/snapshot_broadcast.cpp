#include "region_worker/snapshot_broadcast.h"

#include <algorithm>

namespace tessera::worker {

SnapshotBroadcast::SnapshotBroadcast(const Scene& scene, std::uint32_t snapshot_rate_hz,
                                     const replication::Settings& settings, WorkerMetrics& metrics)
    : tick_rate_hz_(scene.tick_rate_hz),
      snapshot_rate_hz_(std::min(snapshot_rate_hz, scene.tick_rate_hz)),
      metrics_(metrics),
      history_(scene.bounds, settings) {}

void SnapshotBroadcast::AfterTick(const region::Region& region, std::span<const region::Departure> departures,
                                  GamePort& port) {
  if (port.clients().empty()) {
    departures_.clear();  // a client that comes later gets all that there is then
    return;
  }
  Gather(departures);
  if (!FallsOn(region.tick())) return;
  const TimePoint begin = Clock::now();
  Push(region);
  bool full = false;
  const std::uint64_t bytes = port.Broadcast(begin, [&](Client& client) {
    replication::WrittenSnapshot written =
        client.sender.Write(history_, region.LastInput(client.player), client.input_margin_ticks);
    full = full || written.full;
    return std::move(written.datagrams);
  });
  metrics_.snapshot_bytes.Increment(static_cast<double>(bytes));
  const double took_s = std::chrono::duration<double>(Clock::now() - begin).count();
  (full ? metrics_.snapshot_full : metrics_.snapshot_delta).Observe(took_s);
}

// True where the count of snapshots due by then grows, so any pair of rates keeps its mean.
bool SnapshotBroadcast::FallsOn(Tick tick) const {
  const auto due = [&](std::uint64_t t) { return t * snapshot_rate_hz_ / tick_rate_hz_; };
  return tick.value() == 0 || due(tick.value()) != due(tick.value() - 1);
}

void SnapshotBroadcast::Gather(std::span<const region::Departure> departures) {
  for (const region::Departure& departure : departures) {
    const RegionId to = departure.reason == region::DepartureReason::kHandedOver ? departure.to : RegionId();
    departures_.push_back({departure.body, departure.epoch, to});
  }
}

void SnapshotBroadcast::Push(const region::Region& region) {
  bodies_.clear();
  for (const region::OwnedBody& body : region.owned()) bodies_.push_back({body.def->id, body.epoch, body.state});
  history_.Push(region.tick(), bodies_, departures_);
  departures_.clear();
}

}  // namespace tessera::worker
