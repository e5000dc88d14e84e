#include "profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace desktop {
namespace {

constexpr double kMib = 1024.0 * 1024.0;
constexpr std::size_t kMostColumns = 8;  // as many as fit a window

Timing TimingOf(const tessera_work& work) {
  return {work.recent * 1e3, work.count > 0 ? work.total * 1e3 / static_cast<double>(work.count) : 0, work.count};
}

std::string Number(double value) {
  if (value == 0) return "0";
  constexpr int kMostDecimals = 6;
  int decimals = 0;
  for (double least = 100; decimals < kMostDecimals && std::abs(value) < least; least /= 10) ++decimals;
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

Panel::Cell CellOf(const RegionProfile& region, const Timing& timing) {
  if (!region.known) return {"-", true};
  return timing.recent_ms > 0 ? Panel::Cell{Number(timing.recent_ms), false}
                              : Panel::Cell{Number(timing.mean_ms), true};
}

std::vector<Panel::Row> RowsOf(const std::vector<RegionProfile>& regions) {
  using Of = RegionProfile;
  constexpr std::array<std::pair<const char*, Timing Of::*>, 5> kTimings = {{{"physics update", &Of::physics},
                                                                             {"prediction", &Of::prediction},
                                                                             {"full snapshots", &Of::snapshot_full},
                                                                             {"delta snapshots", &Of::snapshot_delta},
                                                                             {"whole tick", &Of::step}}};
  constexpr std::array<std::pair<const char*, std::uint64_t Of::*>, 3> kCounts = {
      {{"bodies", &Of::bodies}, {"ghosts", &Of::ghosts}, {"asleep", &Of::asleep}}};
  constexpr std::array<std::pair<const char*, double Of::*>, 2> kMemory = {
      {{"virtual memory, MiB", &Of::process_virtual_mib}, {"physical memory, MiB", &Of::process_physical_mib}}};
  std::vector<Panel::Row> rows;
  const auto add = [&](const char* label, const auto& cell_of) {
    Panel::Row& row = rows.emplace_back();
    row.label = label;
    for (const RegionProfile& region : regions) row.cells.push_back(cell_of(region));
  };
  for (const auto& [label, timing] : kTimings) {
    add(label, [member = timing](const RegionProfile& region) { return CellOf(region, region.*member); });
  }
  for (const auto& [label, count] : kCounts) {
    add(label, [member = count](const RegionProfile& region) {
      return Panel::Cell{std::to_string(region.*member), false};
    });
  }
  for (const auto& [label, mib] : kMemory) {
    add(label, [member = mib](const RegionProfile& region) { return Panel::Cell{Number(region.*member), false}; });
  }
  return rows;
}

Panel::Bar BarOf(const char* label, double usable_mib, double total_mib) {
  return {label, Number(usable_mib) + " of " + Number(total_mib) + " MiB usable",
          total_mib > 0 ? usable_mib / total_mib : 0};
}

}  // namespace

Timing TimingOf(const tessera_duration& now, const tessera_duration& before) {
  Timing timing{0, now.mean * 1e3, now.count};
  if (now.count > before.count) {
    const double spent_s = now.mean * static_cast<double>(now.count) - before.mean * static_cast<double>(before.count);
    timing.recent_ms = spent_s * 1e3 / static_cast<double>(now.count - before.count);
  }
  return timing;
}

RegionProfile ProfileOf(const tessera::RegionStats& stats) {
  RegionProfile profile;
  profile.region = stats.region;
  profile.connected = stats.connected != 0;
  profile.known = stats.reports > 0;
  profile.reports = stats.reports;
  profile.round_trip_ms = stats.round_trip_s * 1e3;
  profile.tick = stats.tick;
  profile.bodies = stats.bodies;
  profile.ghosts = stats.ghosts;
  profile.asleep = stats.asleep;
  profile.clients = stats.clients;
  profile.step = TimingOf(stats.step);
  profile.physics = TimingOf(stats.physics);
  profile.prediction = TimingOf(stats.prediction);
  profile.snapshot_full = TimingOf(stats.snapshot_full);
  profile.snapshot_delta = TimingOf(stats.snapshot_delta);
  profile.process_virtual_mib = static_cast<double>(stats.process_virtual_bytes) / kMib;
  profile.process_physical_mib = static_cast<double>(stats.process_physical_bytes) / kMib;
  profile.host_virtual_usable_mib = static_cast<double>(stats.host_virtual_usable_bytes) / kMib;
  profile.host_virtual_total_mib = static_cast<double>(stats.host_virtual_total_bytes) / kMib;
  profile.host_physical_usable_mib = static_cast<double>(stats.host_physical_usable_bytes) / kMib;
  profile.host_physical_total_mib = static_cast<double>(stats.host_physical_total_bytes) / kMib;
  return profile;
}

Profile ProfileOf(const Figures& figures) {
  const tessera::Stats &now = figures.now, &before = figures.before;
  Profile profile;
  profile.frame = TimingOf(now.frame_time, before.frame_time);
  profile.network = TimingOf(now.network_time, before.network_time);
  profile.update = TimingOf(now.update_time, before.update_time);
  profile.frames_per_s = profile.frame.recent_ms > 0 ? 1e3 / profile.frame.recent_ms : 0;
  profile.frame_p99_ms = now.frame_time.p99 * 1e3;
  profile.round_trip_ms = now.round_trip_s * 1e3;
  profile.jitter_ms = now.jitter_s * 1e3;
  profile.render_delay_ms = now.render_delay_s * 1e3;
  profile.tick_rate_hz = now.tick_rate_hz;
  profile.in_kb_per_s = now.bytes_in_per_s / 1e3;
  profile.out_kb_per_s = now.bytes_out_per_s / 1e3;
  profile.bodies = now.bodies;
  profile.datagrams_lost = now.datagrams_lost;
  profile.corrections = now.corrections;
  for (const tessera::RegionStats& region : figures.regions) profile.regions.push_back(ProfileOf(region));
  return profile;
}

bool Profiler::Sample(double now_s, const tessera::Client& client) {
  if (now_s < due_s_) return false;
  due_s_ = now_s + kEvery_s;
  figures_ = {figures_.now, client.GetStats(), client.Regions()};
  shown_ = ProfileOf(figures_);
  return true;
}

Panel PanelOf(const Profile& profile) {
  Panel panel;
  const auto client = [&](const char* label, double value, const char* unit) {
    panel.client.push_back({label, {{Number(value) + unit, false}}});
  };
  client("frames", profile.frames_per_s, " a second");
  client("frame time", profile.frame.recent_ms, " ms");
  client("network time", profile.network.recent_ms, " ms");
  client("update time", profile.update.recent_ms, " ms");
  client("round trip", profile.round_trip_ms, " ms");
  client("shown behind", profile.render_delay_ms, " ms");
  client("received", profile.in_kb_per_s, " kB/s");
  client("sent", profile.out_kb_per_s, " kB/s");
  panel.client.push_back({"bodies", {{std::to_string(profile.bodies), false}}});
  client("world", profile.tick_rate_hz, " ticks/s");
  const std::size_t fit = std::min(profile.regions.size(), kMostColumns);
  const std::vector<RegionProfile> regions(profile.regions.begin(),
                                           profile.regions.begin() + static_cast<std::ptrdiff_t>(fit));
  for (const RegionProfile& region : regions) panel.columns.push_back({region.region, region.connected});
  panel.more = profile.regions.size() - fit;
  panel.regions = RowsOf(regions);
  const auto known =
      std::find_if(profile.regions.begin(), profile.regions.end(), [](const auto& region) { return region.known; });
  if (known != profile.regions.end()) {
    panel.host = {BarOf("virtual, host", known->host_virtual_usable_mib, known->host_virtual_total_mib),
                  BarOf("physical, host", known->host_physical_usable_mib, known->host_physical_total_mib)};
  }
  return panel;
}

std::string Text(const Panel& panel) {
  std::string text;
  const auto line = [&](const std::string& label, const Panel::Cell& cell) {
    text += "panel " + label + (cell.of_all ? " (of all): " : ": ") + cell.text + "\n";
  };
  for (const Panel::Row& row : panel.client) line(row.label, row.cells.front());
  for (const Panel::Row& row : panel.regions) {
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      line("region " + std::to_string(panel.columns[i].region) + " " + row.label, row.cells[i]);
    }
  }
  for (const Panel::Bar& bar : panel.host) line(bar.label, {bar.text, false});
  return text;
}

std::string Text(const Figures& figures) {
  std::string text;
  const auto value = [&](const std::string& name, double number) {
    char line[160];
    std::snprintf(line, sizeof line, "%s %.15g\n", name.c_str(), number);
    text += line;
  };
  const auto count = [&](const std::string& name, std::uint64_t number) { value(name, static_cast<double>(number)); };
  for (const auto& [when, stats] : {std::pair("before ", &figures.before), std::pair("now ", &figures.now)}) {
    const std::string at = when;
    for (const auto& [name, time] :
         {std::pair("frame_time", &stats->frame_time), std::pair("network_time", &stats->network_time),
          std::pair("update_time", &stats->update_time)}) {
      count(at + name + ".count", time->count);
      value(at + name + ".mean", time->mean);
    }
    value(at + "round_trip_s", stats->round_trip_s);
    value(at + "render_delay_s", stats->render_delay_s);
    value(at + "bytes_in_per_s", stats->bytes_in_per_s);
    value(at + "bytes_out_per_s", stats->bytes_out_per_s);
    value(at + "tick_rate_hz", stats->tick_rate_hz);
    count(at + "bodies", stats->bodies);
  }
  for (const tessera::RegionStats& region : figures.regions) {
    const std::string at = "region " + std::to_string(region.region) + " ";
    for (const auto& [name, work] :
         {std::pair("step", &region.step), std::pair("physics", &region.physics),
          std::pair("prediction", &region.prediction), std::pair("snapshot_full", &region.snapshot_full),
          std::pair("snapshot_delta", &region.snapshot_delta)}) {
      count(at + name + ".count", work->count);
      value(at + name + ".total", work->total);
      value(at + name + ".recent", work->recent);
    }
    count(at + "reports", region.reports);
    count(at + "tick", region.tick);
    count(at + "bodies", region.bodies);
    count(at + "ghosts", region.ghosts);
    count(at + "asleep", region.asleep);
    count(at + "process_virtual_bytes", region.process_virtual_bytes);
    count(at + "process_physical_bytes", region.process_physical_bytes);
    count(at + "host_virtual_usable_bytes", region.host_virtual_usable_bytes);
    count(at + "host_virtual_total_bytes", region.host_virtual_total_bytes);
    count(at + "host_physical_usable_bytes", region.host_physical_usable_bytes);
    count(at + "host_physical_total_bytes", region.host_physical_total_bytes);
  }
  return text;
}

}  // namespace desktop
