// The profiler: what it costs to show the world here, and to compute it in each region. Taken once a second, so that
// people can read it; what is on screen, in a report and in the tests are the same numbers.
//
// Thread rule: one thread. Time comes in.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tessera/tessera.hpp"

namespace desktop {

struct Timing {
  double recent_ms = 0;  // mean of the last second
  double mean_ms = 0;    // mean of all
  std::uint64_t count = 0;
};

struct RegionProfile {
  std::uint32_t region = 0;
  bool connected = false, known = false;  // known: it has sent its figures
  std::uint32_t reports = 0;              // how often
  double round_trip_ms = 0;
  std::uint64_t tick = 0, bodies = 0, ghosts = 0, asleep = 0, clients = 0;
  Timing step, physics, prediction, snapshot_full, snapshot_delta;
  double process_virtual_mib = 0, process_physical_mib = 0;
  double host_virtual_usable_mib = 0, host_virtual_total_mib = 0;
  double host_physical_usable_mib = 0, host_physical_total_mib = 0;
};

struct Profile {
  double frames_per_s = 0;
  Timing frame, network, update;
  double frame_p99_ms = 0;
  double round_trip_ms = 0, jitter_ms = 0, render_delay_ms = 0, tick_rate_hz = 0;
  double in_kb_per_s = 0, out_kb_per_s = 0;
  std::uint64_t bodies = 0, datagrams_lost = 0, corrections = 0;
  std::vector<RegionProfile> regions;
};

class Profiler {
 public:
  static constexpr double kEvery_s = 1;

  // True when a second is over and `shown` is new.
  bool Sample(double now_s, const tessera::Client& client);
  const Profile& shown() const { return shown_; }

 private:
  Profile shown_;
  tessera::Stats before_ = TESSERA_STATS;
  double due_s_ = 0;
};

Timing TimingOf(const tessera_duration& now, const tessera_duration& before);
RegionProfile ProfileOf(const tessera::RegionStats& stats);
// One line a value, "region 2 physics_ms 1.234": for scripts and tests.
std::string Text(const Profile& profile);

}  // namespace desktop
