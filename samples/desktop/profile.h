// The profiler: what it costs to show the world here, and to compute it in each region. Taken once a second, so that
// people can read it. The panel on screen and a report draw and write the same texts, and a report has the library's
// figures beside them, of which they were made.
//
// Thread rule: one thread. Time comes in.
#pragma once

#include <cstddef>
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

// The library's figures, at the begin and at the end of a second; those of regions at its end.
struct Figures {
  tessera::Stats before = TESSERA_STATS, now = TESSERA_STATS;
  std::vector<tessera::RegionStats> regions;
};

// The panel as it is drawn: texts. A number has three digits that count, or all before its point where those are more.
struct Panel {
  struct Cell {
    std::string text{};
    bool of_all = false;  // a mean of all time, drawn faint: nothing was done in the last second
  };
  struct Row {
    std::string label{};
    std::vector<Cell> cells{};
  };
  struct Column {
    std::uint32_t region = 0;
    bool connected = false;
  };
  struct Bar {
    std::string label{}, text{};
    double share = 0;  // 0 to 1
  };

  std::vector<Row> client{};      // a cell each
  std::vector<Column> columns{};  // the regions that fit a window
  std::size_t more = 0;           // regions that do not
  std::vector<Row> regions{};     // a cell a column
  std::vector<Bar> host{};        // as the first region that has sent its figures has it
};

class Profiler {
 public:
  static constexpr double kEvery_s = 1;

  // True when a second is over and `shown` is new.
  bool Sample(double now_s, const tessera::Client& client);
  const Profile& shown() const { return shown_; }
  // Those that `shown` was made of.
  const Figures& figures() const { return figures_; }

 private:
  Profile shown_;
  Figures figures_;
  double due_s_ = 0;
};

Timing TimingOf(const tessera_duration& now, const tessera_duration& before);
RegionProfile ProfileOf(const tessera::RegionStats& stats);
Profile ProfileOf(const Figures& figures);
Panel PanelOf(const Profile& profile);

// For scripts and tests. A line a text, "panel region 2 physics update: 1.23", with "(of all)" behind the label of a
// mean of all time.
std::string Text(const Panel& panel);
// A line a value: "now frame_time.mean 0.0166", "region 2 physics.recent 0.00123"; seconds and bytes, as tessera.h
// names and has them.
std::string Text(const Figures& figures);

}  // namespace desktop
