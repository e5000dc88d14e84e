#include "region_worker/snapshot_broadcast.h"

#include <algorithm>
#include <chrono>

#include "core/replication/interest.h"
#include "core/replication/movement_news.h"
#include "core/world/viewer_number.h"
#include "region_worker/core/time.h"
#include "region_worker/core/view_share.h"

namespace tessera::worker {
namespace {

// Bytes a second that each region sends a viewer, whatever the scene allows a player: it sees everything, and stands in
// a data centre. Some 5000 bodies that all move, 30 times a second.
constexpr double kViewerBytes_per_s = 2.5e6;

}  // namespace

// A snapshot falls where the count of snapshots due by then grows, so any pair of rates keeps its mean.
bool SnapshotFallsOn(Tick tick, RegionId region, std::uint32_t snapshot_rate_hz, std::uint32_t tick_rate_hz) {
  const auto due = [&](std::uint64_t t) { return t * snapshot_rate_hz / tick_rate_hz; };
  const std::uint64_t turned = tick.value() + region.value();
  return tick == Tick() || due(turned) != due(turned - 1);
}

SnapshotBroadcast::SnapshotBroadcast(RegionId self, const Scene& scene, std::uint32_t snapshot_rate_hz,
                                     const replication::SnapshotSettings& settings, WorkerMetrics& metrics)
    : self_(self),
      scene_(scene),
      settings_(settings),
      tick_rate_hz_(scene.tick_rate_hz),
      snapshot_rate_hz_(std::min(snapshot_rate_hz, scene.tick_rate_hz)),
      metrics_(metrics) {}

void SnapshotBroadcast::Acknowledge(net::PeerHandle from, std::span<const std::uint8_t> bytes) {
  const auto sender = senders_.find(from);
  if (sender != senders_.end()) (void)sender->second.Acknowledge(bytes);
}

void SnapshotBroadcast::AfterTick(const region::Region& region, std::span<const region::Departure> departures,
                                  const PlayerPlaces* places, GamePort& port) {
  if (port.clients().empty()) {
    // A client that comes later is sent all that there is then.
    history_.reset();
    senders_.clear();
    feed_.Clear();
    return;
  }
  feed_.Note(region.tick(), departures);
  if (!SnapshotFallsOn(region.tick(), self_, snapshot_rate_hz_, tick_rate_hz_)) return;
  const TimePoint begin = Clock::now();
  Push(region);
  const std::vector<Recipient> recipients = Recipients(port);
  std::vector<replication::ClientView> views;
  std::vector<std::optional<Vec3d>> centres;
  views.reserve(recipients.size());
  centres.reserve(recipients.size());
  for (const Recipient& recipient : recipients) {
    views.push_back(ViewOf(region, places, *recipient.client));
    centres.push_back(views.back().centre);
  }
  bool full = false;
  std::uint64_t bytes = 0;
  const std::vector<std::uint32_t> order = replication::NeighboursInARow(centres, settings_.interest_radius_m);
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i + 1 < order.size()) recipients[order[i + 1]].sender->Prefetch();
    const auto& [peer, client, sender] = recipients[order[i]];
    const replication::WrittenSnapshot written =
        sender->Write(*history_, views[order[i]], region.LastInput(client->player), client->input_margin_ticks);
    full = full || written.full;
    bytes += port.SendDatagrams(peer, written.datagrams);
    if (!written.datagrams.empty()) bytes += SendMovement(region, peer, *client, port);
  }
  port.Flush();
  metrics_.snapshot_bytes.Increment(static_cast<double>(bytes));
  const double took_s = std::chrono::duration<double>(Clock::now() - begin).count();
  (full ? metrics_.snapshot_full : metrics_.snapshot_delta).Observe(took_s);
}

// To the player whose body the game's own movement moves here; the bytes sent.
std::uint64_t SnapshotBroadcast::SendMovement(const region::Region& region, net::PeerHandle peer,
                                              const ConnectedClient& client, GamePort& port) {
  if (IsViewer(client.player)) return 0;
  const auto moved = region.MovementOf(client.player);
  if (!moved) return 0;
  const net::Bytes news =
      replication::EncodeMovementNews({.tick = region.tick(), .name = moved->movement.name, .state = moved->state});
  return port.SendDatagrams(peer, {&news, 1});
}

void SnapshotBroadcast::Push(const region::Region& region) {
  if (!history_) history_.emplace(scene_.bounds, settings_);
  feed_.Push(region, *history_);
  pushed_ = region.tick();
}

void SnapshotBroadcast::ShowStanding(const region::Region& region, const PlayerPlaces* places, GamePort& port) {
  std::vector<net::PeerHandle> fresh;
  for (const auto& [peer, client] : port.clients()) {
    if (!client.waits_for_scene && !senders_.contains(peer)) fresh.push_back(peer);
  }
  // No snapshot may have fallen on the tick: clients would go on by the velocities of the one before.
  const bool to_all = history_.has_value() && pushed_ != region.tick();
  if (fresh.empty() && !to_all) return;
  if (!history_ || to_all) Push(region);
  for (const auto& [peer, client, sender] : Recipients(port)) {
    if (!to_all && !std::binary_search(fresh.begin(), fresh.end(), peer)) continue;
    const replication::WrittenSnapshot written = sender->Write(
        *history_, ViewOf(region, places, *client), region.LastInput(client->player), client->input_margin_ticks);
    std::uint64_t bytes = port.SendDatagrams(peer, written.datagrams);
    if (!written.datagrams.empty()) bytes += SendMovement(region, peer, *client, port);
    metrics_.snapshot_bytes.Increment(static_cast<double>(bytes));
  }
  port.Flush();
}

std::vector<SnapshotBroadcast::Recipient> SnapshotBroadcast::Recipients(const GamePort& port) {
  std::vector<Recipient> recipients;
  recipients.reserve(port.clients().size());
  auto sender = senders_.begin();  // ascending by peer, as the clients are
  for (const auto& [peer, client] : port.clients()) {
    if (client.waits_for_scene) continue;  // its sender, if there was one, goes: it will begin from nothing
    while (sender != senders_.end() && sender->first < peer) sender = senders_.erase(sender);
    if (sender == senders_.end() || sender->first != peer) {
      sender = senders_.emplace_hint(sender, peer, replication::SnapshotSender(settings_));
    }
    recipients.push_back({peer, &client, &sender->second});
    ++sender;
  }
  senders_.erase(sender, senders_.end());
  return recipients;
}

// The view is centred on the client's body: as it is here, or where its owner says that it is; a client never says
// where it looks from. While the place is unknown, a region sends all that it has.
replication::ClientView SnapshotBroadcast::ViewOf(const region::Region& region, const PlayerPlaces* places,
                                                  const ConnectedClient& client) const {
  if (IsViewer(client.player)) return {.budget_share = kViewerBytes_per_s / settings_.client_bytes_per_s};
  const BodyId own = PlayerBodyId(client.player);
  replication::ClientView view{.centre = {}, .own = region.MovedBy(client.player)};
  view.centre = feed_.PlaceOf(view.own);
  const bool here = view.centre.has_value();
  view.team = view.own == own ? feed_.TeamOf(own) : region.AudienceOf(own).team;
  if (!here && places != nullptr) {
    if (settings_.interest_radius_m > 0) view.centre = places->At(client.player, region.tick());
    view.team = places->TeamAt(client.player, region.tick());
  }
  if (settings_.interest_radius_m > 0 && view.centre.has_value()) {
    view.budget_share = ViewShare(region.map(), self_, *view.centre, settings_.interest_radius_m);
  } else {
    view.budget_share = 1 / static_cast<double>(region.map().regions().size());
  }
  return view;
}

}  // namespace tessera::worker
