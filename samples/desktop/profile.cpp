#include "profile.h"

#include <cstdio>
#include <string>

namespace desktop {
namespace {

constexpr double kMib = 1024.0 * 1024.0;

Timing TimingOf(const tessera_work& work) {
  return {work.recent * 1e3, work.count > 0 ? work.total * 1e3 / static_cast<double>(work.count) : 0, work.count};
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

bool Profiler::Sample(double now_s, const tessera::Client& client) {
  if (now_s < due_s_) return false;
  due_s_ = now_s + kEvery_s;
  const tessera::Stats stats = client.GetStats();
  shown_.frame = TimingOf(stats.frame_time, before_.frame_time);
  shown_.network = TimingOf(stats.network_time, before_.network_time);
  shown_.update = TimingOf(stats.update_time, before_.update_time);
  shown_.frames_per_s = shown_.frame.recent_ms > 0 ? 1e3 / shown_.frame.recent_ms : 0;
  shown_.frame_p99_ms = stats.frame_time.p99 * 1e3;
  shown_.round_trip_ms = stats.round_trip_s * 1e3;
  shown_.jitter_ms = stats.jitter_s * 1e3;
  shown_.render_delay_ms = stats.render_delay_s * 1e3;
  shown_.tick_rate_hz = stats.tick_rate_hz;
  shown_.in_kb_per_s = stats.bytes_in_per_s / 1e3;
  shown_.out_kb_per_s = stats.bytes_out_per_s / 1e3;
  shown_.bodies = stats.bodies;
  shown_.datagrams_lost = stats.datagrams_lost;
  shown_.corrections = stats.corrections;
  shown_.regions.clear();
  for (const tessera::RegionStats& region : client.Regions()) shown_.regions.push_back(ProfileOf(region));
  before_ = stats;
  return true;
}

std::string Text(const Profile& profile) {
  std::string text;
  const auto value = [&](const std::string& name, double number) {
    char line[160];
    std::snprintf(line, sizeof line, "%s %.6f\n", name.c_str(), number);
    text += line;
  };
  value("frames_per_s", profile.frames_per_s);
  value("frame_ms", profile.frame.mean_ms);
  value("network_ms", profile.network.mean_ms);
  value("update_ms", profile.update.mean_ms);
  value("bodies", static_cast<double>(profile.bodies));
  for (const RegionProfile& region : profile.regions) {
    const std::string name = "region " + std::to_string(region.region) + " ";
    value(name + "known", region.known ? 1 : 0);
    value(name + "tick", static_cast<double>(region.tick));
    value(name + "bodies", static_cast<double>(region.bodies));
    value(name + "step_ms", region.step.mean_ms);
    value(name + "physics_ms", region.physics.mean_ms);
    value(name + "prediction_ms", region.prediction.mean_ms);
    value(name + "snapshot_full_ms", region.snapshot_full.mean_ms);
    value(name + "snapshot_delta_ms", region.snapshot_delta.mean_ms);
    value(name + "process_virtual_mib", region.process_virtual_mib);
    value(name + "process_physical_mib", region.process_physical_mib);
    value(name + "host_virtual_usable_mib", region.host_virtual_usable_mib);
    value(name + "host_virtual_total_mib", region.host_virtual_total_mib);
    value(name + "host_physical_usable_mib", region.host_physical_usable_mib);
    value(name + "host_physical_total_mib", region.host_physical_total_mib);
  }
  return text;
}

}  // namespace desktop
