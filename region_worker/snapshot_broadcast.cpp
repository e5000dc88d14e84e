#include "region_worker/snapshot_broadcast.h"

#include <algorithm>

namespace tessera::worker {
namespace {

// Of what a client may be sent, where not all is of interest.
constexpr double kShareOfOwner = 0.5;

}  // namespace

// Where the count of snapshots due by then grows, so any pair of rates keeps its mean.
bool SnapshotFallsOn(Tick tick, RegionId region, std::uint32_t snapshot_rate_hz, std::uint32_t tick_rate_hz) {
  const auto due = [&](std::uint64_t t) { return t * snapshot_rate_hz / tick_rate_hz; };
  const std::uint64_t turned = tick.value() + region.value();
  return tick == Tick() || due(turned) != due(turned - 1);
}

SnapshotBroadcast::SnapshotBroadcast(RegionId self, const Scene& scene, std::uint32_t snapshot_rate_hz,
                                     const replication::Settings& settings, WorkerMetrics& metrics)
    : self_(self),
      scene_(scene),
      settings_(settings),
      tick_rate_hz_(scene.tick_rate_hz),
      snapshot_rate_hz_(std::min(snapshot_rate_hz, scene.tick_rate_hz)),
      metrics_(metrics) {}

void SnapshotBroadcast::AfterTick(const region::Region& region, std::span<const region::Departure> departures,
                                  const PlayerPlaces* places, GamePort& port) {
  if (port.clients().empty()) {
    // A client that comes later gets all that there is then.
    history_.reset();
    feed_.Clear();
    return;
  }
  feed_.Note(departures);
  if (!SnapshotFallsOn(region.tick(), self_, snapshot_rate_hz_, tick_rate_hz_)) return;
  const TimePoint begin = Clock::now();
  if (!history_) history_.emplace(scene_.bounds, settings_);
  feed_.Push(region, *history_);
  bool full = false;
  const auto view = [&](const Client& client) { return ViewOf(region, places, client); };
  const auto write = [&](Client& client, const replication::ClientView& seen) {
    replication::WrittenSnapshot written =
        client.sender.Write(*history_, seen, region.LastInput(client.player), client.input_margin_ticks);
    full = full || written.full;
    return std::move(written.datagrams);
  };
  const std::uint64_t bytes = port.Broadcast(begin, view, write);
  metrics_.snapshot_bytes.Increment(static_cast<double>(bytes));
  const double took_s = std::chrono::duration<double>(Clock::now() - begin).count();
  (full ? metrics_.snapshot_full : metrics_.snapshot_delta).Observe(took_s);
}

// Around the body: as it is here, or where its owner says that it is; a client never says where it looks from. As long
// as nobody has said it, a region shows all that it has. Half of what the client may be sent goes to where the body is.
replication::ClientView SnapshotBroadcast::ViewOf(const region::Region& region, const PlayerPlaces* places,
                                                  const Client& client) const {
  replication::ClientView view{.centre = {}, .own = PlayerBodyId(client.player)};
  view.centre = feed_.PlaceOf(view.own);
  const bool here = view.centre.has_value();
  if (!here && places != nullptr) {
    view.centre = places->At(client.player, region.tick());
  }
  const auto regions = static_cast<double>(region.map().regions().size());
  if (settings_.interest_radius_m <= 0) {
    view.budget_share = 1 / regions;
  } else if (regions > 1) {
    view.budget_share = here ? kShareOfOwner : (1 - kShareOfOwner) / (regions - 1);
  }
  return view;
}

}  // namespace tessera::worker
