#include "cli/instance_view.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "cli/output.h"
#include "cli/table.h"
#include "core/game/native_name.h"
#include "core/world/proto_math.h"

namespace tessera::cli {

v1::Instance GetInstance(local::Connection& connection, const std::string& command, const std::string& id) {
  v1::GetInstanceRequest request;
  request.set_id(id);
  return connection.Call(command, connection.instances(), &v1::InstanceService::Stub::GetInstance, request).instance();
}

std::string GameOf(const v1::Instance& instance) {
  if (instance.game_hash().empty()) return "-";
  if (instance.game_native()) return game::NativeGameText(instance.game_name(), instance.game_hash());
  const std::string file = fmt::format("{} ({})", instance.game_name(), instance.game_hash().substr(0, 12));
  if (!instance.has_movement()) return file;
  return fmt::format("{} with {}", file, game::NativeGameText(instance.movement().name(), instance.movement().hash()));
}

std::string SummaryLine(const v1::Instance& instance) {
  std::uint64_t tick = 0;
  int running = 0;
  for (const v1::RegionStatus& region : instance.region_status()) {
    tick = std::max<std::uint64_t>(tick, region.report().tick());
    if (region.report().phase() == v1::WORKER_PHASE_RUNNING) ++running;
  }
  return fmt::format("{} {} tick {}, {} of {} regions run, {} players{}\n", instance.id(),
                     local::InstanceStateName(instance), tick, running, instance.regions(), instance.players(),
                     instance.reason().empty() ? "" : ": " + instance.reason());
}

std::string RegionTable(const v1::Instance& instance) {
  std::vector<TableRow> rows{{"REGION", "HOST", "PHASE", "TICK", "RATE", "STEP-P50", "STEP-P99", "OWNED", "GHOSTS",
                              "ASLEEP", "IN", "OUT", "LATE", "MEMORY"}};
  for (const v1::RegionStatus& region : instance.region_status()) {
    const v1::WorkerReport& report = region.report();
    rows.push_back({std::to_string(region.region()), region.host(),
                    ShortName(v1::WorkerPhase_Name(report.phase()), "WORKER_PHASE_"), std::to_string(report.tick()),
                    fmt::format("{:.1f}", report.tick_rate_hz()), FormatMillis(report.step().p50_seconds()),
                    FormatMillis(report.step().p99_seconds()), std::to_string(report.owned()),
                    std::to_string(report.ghosts()), std::to_string(report.asleep()),
                    std::to_string(report.handovers_in()), std::to_string(report.handovers_out()),
                    std::to_string(report.late_ticks()), FormatBytes(static_cast<double>(report.resident_bytes()))});
  }
  return FormatTable(rows);
}

namespace {

// With the tick from which on it runs, where it took another one's place.
std::string GameLine(const v1::Instance& instance) {
  std::string line = GameOf(instance);
  if (instance.game_number() > 0) {
    line += fmt::format(", change {}, from tick {} on", instance.game_number(), instance.game_since_tick());
  }
  if (!instance.game_refused().empty()) line += fmt::format("; another was refused: {}", instance.game_refused());
  return line;
}

std::string PaceLine(const v1::Instance& instance) {
  return instance.ticks_per_second() > 0 ? fmt::format("{} ticks a second", instance.ticks_per_second()) : "paused";
}

// Lists changes under way, risks and past events.
std::string Health(const v1::Instance& instance) {
  std::string out;
  for (const v1::InstanceChange& change : instance.changes()) {
    out += fmt::format("\nChange:       {}", change.text());
    if (change.has_since()) out += fmt::format(" (for {})", FormatAge(AgeSeconds(change.since())));
  }
  if (!instance.unprotected_regions().empty()) {
    out += fmt::format("\nUnprotected:  regions {}",
                       fmt::join(instance.unprotected_regions().begin(), instance.unprotected_regions().end(), ", "));
  }
  if (instance.failovers() > 0) {
    out += fmt::format("\nFailovers:    {}, {} bodies lost", instance.failovers(), instance.lost_bodies());
  }
  if (instance.lost_ticks() > 0 || instance.lost_ticks_at_least()) {
    out += fmt::format("\nLost time:    {}{} ticks", instance.lost_ticks_at_least() ? "at least " : "",
                       instance.lost_ticks());
  }
  if (instance.imbalance() > 0) out += fmt::format("\nImbalance:    {:.2f}", instance.imbalance());
  const auto last = std::find_if(instance.checkpoints().rbegin(), instance.checkpoints().rend(),
                                 [](const v1::Checkpoint& checkpoint) { return !checkpoint.taken_back(); });
  if (last != instance.checkpoints().rend()) {
    out += fmt::format("\nCheckpoint:   tick {}, {} ago", last->tick(), FormatAge(AgeSeconds(last->create_time())));
  }
  if (!out.empty()) out += "\n";
  if (instance.events().empty()) return out;
  std::vector<TableRow> rows{{"AGE", "OPERATION", "EVENT"}};
  for (const v1::InstanceEvent& event : instance.events()) {
    rows.push_back(
        {FormatAge(AgeSeconds(event.time())), event.operation().empty() ? "-" : event.operation(), event.text()});
  }
  return out + "\n" + FormatTable(rows);
}

// The properties of the world, with their values.
std::string WorldLine(const v1::Instance& instance) {
  std::string line;
  for (const v1::Property& property : instance.world_properties()) {
    line += fmt::format("{}{} = {}", line.empty() ? "World:    " : ", ", property.name(),
                        PropertyText(FromProto(property).value_or(PropertyValue())));
  }
  return line.empty() ? line : line + "\n";
}

}  // namespace

std::string DescribeInstance(const v1::Instance& instance) {
  std::string out = fmt::format("Name:     {}\nState:    {}\n", instance.id(), local::InstanceStateName(instance));
  if (!instance.reason().empty()) {
    out += fmt::format("Reason:   {}{}\n", instance.reason(),
                       instance.has_degraded_since()
                           ? fmt::format(" (for {})", FormatAge(AgeSeconds(instance.degraded_since())))
                           : "");
  }
  out += fmt::format(
      "Scene:    {} ({})\nGame:     {}\nRegions:  {}\nPlayers:  {} of {} expected, at most {}{}\nMap:      version "
      "{}\nAge:      "
      "{}\n"
      "Pace:     {}\nGhosts:   {} deep, whole up to {}\nThreads:  {} a region\n{}\n",
      instance.scene_name(), instance.scene_hash().substr(0, 12), GameLine(instance), instance.regions(),
      instance.players(), instance.expected_players(), instance.max_players(), instance.guests() ? "" : ", no guests",
      instance.map().version(), FormatAge(AgeSeconds(instance.create_time())), PaceLine(instance),
      instance.borders().ghost_depth(), instance.borders().whole_up_to(), instance.region_threads(),
      WorldLine(instance));
  if (!instance.release().empty()) out.insert(out.find("Map: "), fmt::format("Release:  {}\n", instance.release()));
  return out + RegionTable(instance) + Health(instance);
}

}  // namespace tessera::cli
