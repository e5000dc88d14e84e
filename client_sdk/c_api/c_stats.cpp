// The C interface: statistics, and the network simulator.
#include "client_sdk/c_api/handle.h"

using namespace tessera;
using namespace tessera::c_api;

namespace {

tessera_duration Give(const client::DurationSummary& d) { return {d.count, d.mean_s, d.p50_s, d.p99_s, d.max_s}; }

tessera_work Give(const replication::WorkFigures& now, const replication::WorkFigures& before) {
  tessera_work work = {now.count, static_cast<double>(now.total_ns) * 1e-9, 0};
  if (now.count > before.count && now.total_ns >= before.total_ns) {
    work.recent =
        static_cast<double>(now.total_ns - before.total_ns) * 1e-9 / static_cast<double>(now.count - before.count);
  }
  return work;
}

void GiveFigures(const replication::RegionFigures& now, const replication::RegionFigures& before,
                 tessera_region_info& info) {
  info.tick = now.tick.value();
  info.bodies = now.owned;
  info.ghosts = now.ghosts;
  info.asleep = now.asleep;
  info.clients = now.clients;
  info.step = Give(now.step, before.step);
  info.physics = Give(now.physics, before.physics);
  info.prediction = Give(now.prediction, before.prediction);
  info.snapshot_full = Give(now.snapshot_full, before.snapshot_full);
  info.snapshot_delta = Give(now.snapshot_delta, before.snapshot_delta);
  info.process_virtual_bytes = now.memory.process_virtual_bytes;
  info.process_physical_bytes = now.memory.process_physical_bytes;
  info.host_virtual_usable_bytes = now.memory.host_virtual_usable_bytes;
  info.host_virtual_total_bytes = now.memory.host_virtual_total_bytes;
  info.host_physical_usable_bytes = now.memory.host_physical_usable_bytes;
  info.host_physical_total_bytes = now.memory.host_physical_total_bytes;
}

}  // namespace

tessera_code tessera_simulate_network(tessera_client* handle, const tessera_network* given) {
  if (handle == nullptr || given == nullptr) return Refuse("client or network: is NULL");
  if (!IsSize<tessera_network>(given->size, "network.size")) return TESSERA_INVALID_ARGUMENT;
  const tessera_network network = TakeIn(given, tessera_network TESSERA_NETWORK);
  const auto share = [](double value) { return value >= 0 && value <= 1; };
  if (!share(network.loss)) return Refuse("network.loss: is not 0 to 1");
  if (!share(network.duplicate)) return Refuse("network.duplicate: is not 0 to 1");
  constexpr uint32_t kMost_ms = 60'000;
  if (network.delay_ms > kMost_ms || network.jitter_ms > kMost_ms) return Refuse("network: more than a minute late");
  return Guarded([&] {
    handle->client->SimulateNetwork({.loss = network.loss,
                                     .duplicate = network.duplicate,
                                     .delay = std::chrono::milliseconds(network.delay_ms),
                                     .jitter = std::chrono::milliseconds(network.jitter_ms),
                                     .seed = network.seed});
    return tessera_code{TESSERA_OK};
  });
}

tessera_code tessera_get_stats(const tessera_client* handle, tessera_stats* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or stats: is NULL");
  if (!IsSize<tessera_stats>(out->size, "stats.size")) return TESSERA_INVALID_ARGUMENT;
  return Guarded([&] {
    const client::ClientStats from = handle->client->Stats();
    tessera_stats stats = TESSERA_STATS;
    for (const client::RegionStats& region : from.regions) stats.regions_connected += region.connected ? 1 : 0;
    stats.reconnects = from.reconnects;
    stats.bytes_in = from.bytes_in;
    stats.bytes_out = from.bytes_out;
    stats.bytes_in_per_s = from.bytes_in_per_s;
    stats.bytes_out_per_s = from.bytes_out_per_s;
    stats.datagrams_lost = from.datagrams_lost;
    stats.decode_errors = from.decode_errors;
    stats.full_records = from.full_records;
    stats.delta_records = from.delta_records;
    stats.inputs_refused = from.inputs_refused;
    stats.bodies = from.bodies;
    stats.round_trip_s = from.round_trip_s;
    stats.tick_rate_hz = from.tick_rate_hz;
    stats.render_delay_s = from.snapshot_delay_s;
    stats.jitter_s = from.jitter_s;
    stats.extrapolations = from.extrapolations;
    stats.playout_jumps = from.playout_jumps;
    stats.input_margin_ticks = from.input_margin_ticks;
    stats.corrections = from.corrections;
    stats.last_correction_m = from.last_correction_m;
    stats.frame_time = Give(from.frame_time);
    stats.network_time = Give(from.network_time);
    stats.update_time = Give(from.update_time);
    stats.datagrams_passed_over = from.datagrams_passed_over;
    stats.predicting = from.predicting ? 1 : 0;
    stats.tiles = static_cast<std::uint32_t>(from.tiles);
    stats.tile_bytes = from.tile_bytes;
    stats.tiles_damaged = from.tiles_damaged;
    GiveOut(stats, out);
    return tessera_code{TESSERA_OK};
  });
}

tessera_code tessera_region_stats(const tessera_client* handle, size_t index, tessera_region_info* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or info: is NULL");
  if (!IsSize<tessera_region_info>(out->size, "info.size")) return TESSERA_INVALID_ARGUMENT;
  return Guarded([&] {
    const client::ClientStats stats = handle->client->Stats();
    if (index >= stats.regions.size()) return Report(absl::NotFoundError("index: there are no more regions"));
    const client::RegionStats& from = stats.regions[index];
    tessera_region_info info = TESSERA_REGION_INFO;
    info.region = from.region.value();
    info.connected = from.connected ? 1 : 0;
    info.reports = from.figures_received;
    info.round_trip_s = from.round_trip_s;
    if (from.figures_received > 0) GiveFigures(from.figures, from.figures_before, info);
    GiveOut(info, out);
    return tessera_code{TESSERA_OK};
  });
}
