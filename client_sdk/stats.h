// Measurements that a client makes of itself.
//
// Thread rule: plain data; DurationStats one thread at a time.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/replication/region_figures.h"
#include "core/world/ids.h"

namespace tessera::client {

struct DurationSummary {
  std::uint64_t count = 0;
  double mean_s = 0, p50_s = 0, p99_s = 0, max_s = 0;
};

// Counts durations in buckets that grow by a twelfth of an octave, from 100 ns to over a minute: quantiles err by at
// most 6 %.
class DurationStats {
 public:
  void Add(std::chrono::nanoseconds duration);
  DurationSummary Summary() const;

 private:
  static constexpr std::size_t kPerOctave = 12, kBuckets = 30 * kPerOctave;
  double Quantile(double q) const;

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  std::chrono::nanoseconds sum_{0}, max_{0};
};

struct RegionStats {
  RegionId region;
  bool connected = false;
  double round_trip_s = 0;
  std::uint64_t datagrams = 0;       // snapshots that were read
  std::uint64_t datagrams_lost = 0;  // or on their way
  // Came while newer ones were there already, after a pause, and were not read.
  std::uint64_t datagrams_passed_over = 0;
  std::uint64_t decode_errors = 0;  // refused: malformed, or their baseline was not here
  std::uint64_t reconnects = 0;
  // The region's own figures, over this connection: how many came, the newest, and those before it. Before the first
  // two the ones before are those of a region that has done nothing.
  std::uint32_t figures_received = 0;
  replication::RegionFigures figures{}, figures_before{};
};

struct ClientStats {
  // Payload of all connections since Join, and over the last second or so.
  std::uint64_t bytes_in = 0, bytes_out = 0;
  double bytes_in_per_s = 0, bytes_out_per_s = 0;
  std::vector<RegionStats> regions;                     // ascending by id
  std::uint64_t datagrams_lost = 0, decode_errors = 0;  // sums of the above, and of those no longer connected
  std::uint64_t reconnects = 0, datagrams_passed_over = 0;
  std::uint64_t full_records = 0, delta_records = 0;  // bodies that came as full records, and as changes
  std::uint64_t inputs_refused = 0;
  std::size_t bodies = 0;
  double round_trip_s = 0;              // to the region of the own body, or to any while that is not known
  double tick_rate_hz = 0;              // the world's, as seen here
  double snapshot_delay_s = 0;          // how far behind the newest state Interpolated shows the world
  double jitter_s = 0;                  // mean deviation of arrivals from their rhythm
  std::uint64_t extrapolations = 0;     // bodies shown beyond their newest state, summed over calls of Interpolated
  std::int32_t input_margin_ticks = 0;  // ticks early that inputs are at the server: the least of the last second
  std::uint64_t corrections = 0;        // times the predicted own body was off by more than a centimetre
  double last_correction_m = 0;
  std::uint64_t playout_jumps = 0;  // times the moment shown had to jump instead of to glide
  // Counted work (work_budget.h) of the last Poll, and of the dearest: receiving, reading the scene, building ground.
  std::int64_t work_units = 0, most_work_units = 0;
  // Tiles of a large level that are here and their packed bytes, and how often one came that was not the one of the
  // list.
  std::size_t tiles = 0;
  std::uint64_t tile_bytes = 0, tiles_damaged = 0;
  std::string last_tile_damage{};  // the last of those, and what is wrong with it
  bool predicting = false;         // the own body is shown ahead, by the inputs already made
  // The dissertation's client metrics: between calls of Poll, within Poll, within Interpolated.
  DurationSummary frame_time, network_time, update_time;
};

}  // namespace tessera::client
