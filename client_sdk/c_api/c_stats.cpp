// The C interface: statistics.
#include "client_sdk/c_api/handle.h"

using namespace tessera;
using namespace tessera::c_api;

namespace {

tessera_duration Give(const client::DurationSummary& d) { return {d.count, d.mean_s, d.p50_s, d.p99_s, d.max_s}; }

}  // namespace

tessera_code tessera_get_stats(const tessera_client* handle, tessera_stats* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or stats: is NULL");
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
    GiveOut(stats, out);
    return tessera_code{TESSERA_OK};
  });
}
