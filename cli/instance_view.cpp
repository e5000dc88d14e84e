#include "cli/instance_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "cli/output.h"
#include "cli/table.h"

namespace tessera::cli {
namespace {

using Predicate = std::function<bool(v1::InstanceState)>;

bool Over(v1::InstanceState state) { return state == v1::INSTANCE_STATE_ENDED || state == v1::INSTANCE_STATE_FAILED; }

v1::Instance WatchUntil(Connection& connection, const std::string& id, std::chrono::milliseconds timeout,
                        const Predicate& done) {
  v1::WatchInstanceRequest request;
  request.set_id(id);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  const auto stream = connection.instances().WatchInstance(&context, request);
  v1::WatchInstanceResponse response;
  while (stream->Read(&response)) {
    if (!done(response.instance().state())) continue;
    context.TryCancel();
    while (stream->Read(&response)) {
    }
    stream->Finish();
    return response.instance();
  }
  const grpc::Status status = stream->Finish();
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) {
    throw CommandError(fmt::format("instance/{} is still {} after {:.1f} s; 'tessera instance describe {}' shows why",
                                   id, InstanceStateName(response.instance()),
                                   static_cast<double>(timeout.count()) / 1e3, id));
  }
  connection.Check(status, "instance watch");
  return response.instance();
}

}  // namespace

std::string InstanceStateName(const v1::Instance& instance) {
  return ShortName(v1::InstanceState_Name(instance.state()), "INSTANCE_STATE_");
}

v1::Instance WaitUntilSettled(Connection& connection, const std::string& id, std::chrono::milliseconds timeout) {
  return WatchUntil(connection, id, timeout, [](v1::InstanceState state) {
    return Over(state) || state == v1::INSTANCE_STATE_RUNNING || state == v1::INSTANCE_STATE_WAITING_FOR_PLAYERS;
  });
}

v1::Instance WaitFor(Connection& connection, const std::string& id, v1::InstanceState wanted,
                     std::chrono::milliseconds timeout) {
  return WatchUntil(connection, id, timeout,
                    [wanted](v1::InstanceState state) { return Over(state) || state == wanted; });
}

v1::Instance WaitUntilEnded(Connection& connection, const std::string& id, std::chrono::milliseconds timeout) {
  return WatchUntil(connection, id, timeout, Over);
}

std::string SummaryLine(const v1::Instance& instance) {
  std::uint64_t tick = 0;
  int running = 0;
  for (const v1::RegionStatus& region : instance.region_status()) {
    tick = std::max<std::uint64_t>(tick, region.report().tick());
    if (region.report().phase() == v1::WORKER_PHASE_RUNNING) ++running;
  }
  return fmt::format("{} {} tick {}, {} of {} regions run, {} players{}\n", instance.id(), InstanceStateName(instance),
                     tick, running, instance.regions(), instance.players(),
                     instance.reason().empty() ? "" : ": " + instance.reason());
}

std::string RegionTable(const v1::Instance& instance) {
  std::vector<Row> rows{{"REGION", "HOST", "PHASE", "TICK", "RATE", "STEP-P50", "STEP-P99", "OWNED", "GHOSTS", "ASLEEP",
                         "IN", "OUT", "LATE", "MEMORY"}};
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

std::string DescribeInstance(const v1::Instance& instance) {
  std::string out = fmt::format("Name:     {}\nState:    {}\n", instance.id(), InstanceStateName(instance));
  if (!instance.reason().empty()) out += fmt::format("Reason:   {}\n", instance.reason());
  out += fmt::format(
      "Scene:    {} ({})\nRegions:  {}\nPlayers:  {} of {} expected\nMap:      version {}\nAge:      {}\n\n",
      instance.scene_name(), instance.scene_hash().substr(0, 12), instance.regions(), instance.players(),
      instance.expected_players(), instance.map().version(), FormatAge(AgeSeconds(instance.create_time())));
  return out + RegionTable(instance);
}

}  // namespace tessera::cli
