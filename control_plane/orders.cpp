#include "control_plane/orders.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/heirs.h"
#include "control_plane/settings.h"

namespace tessera::control {

namespace {

void SetFailover(const records::Instance& record, v1::WorkerOrder& order) {
  if (!record.has_failover()) return;
  order.mutable_failover()->set_version(record.map().version());
  for (const records::Dead& dead : record.failover().dead()) {
    v1::DeadRegion& region = *order.mutable_failover()->add_dead();
    region.set_region(dead.region());
    region.set_incarnation(dead.incarnation());
  }
  if (record.failover().has_resolution()) *order.mutable_resolution() = record.failover().resolution();
}

void SetHeirs(const records::Instance& record, v1::WorkerOrder& order) {
  order.set_heir(HeirOf(record, order.region()));
  for (const v1::MapRegion& region : record.map().regions()) {
    if (region.heir() == order.region()) order.add_wards(region.id());
  }
  for (const records::Placement& placement : record.placements()) {
    if (placement.joins() && HeirOf(record, placement.region()) == order.region()) order.add_wards(placement.region());
  }
  // The copies of the dead are what is taken up.
  for (const records::Dead& dead : record.failover().dead()) {
    if (dead.heir() == order.region()) order.add_wards(dead.region());
  }
}

void SetInitialState(const records::Instance& record, const records::Placement& placement, v1::WorkerOrder& order) {
  if (placement.incarnation() > record.restored().last_incarnation()) return;
  for (const records::RegionFile& file : record.restored().files()) {
    if (file.region() != placement.region()) continue;
    order.mutable_initial_state()->set_tick(record.restored().tick());
    order.mutable_initial_state()->set_hash(file.hash());
  }
}

}  // namespace

v1::WorkerOrder MakeOrder(const InstanceEntry& instance, std::size_t index) {
  const records::Instance& record = instance.record;
  const records::Placement& placement = record.placements(static_cast<int>(index));
  v1::WorkerOrder order;
  order.set_instance_id(record.id());
  order.set_region(placement.region());
  order.set_incarnation(placement.incarnation());
  order.set_scene_hash(record.scene_hash());
  *order.mutable_map() = record.map();
  order.set_instance_key(record.key());
  for (const WorkerEntry& peer : instance.workers) {
    if (peer.region != placement.region() && peer.bound()) *order.add_peers() = peer.report.address();
  }
  *order.mutable_players() = record.players();
  order.set_run(record.run());
  order.set_stop(!WantsWorkers(record.state()));
  order.set_snapshot_rate_hz(record.snapshot_rate_hz());
  order.set_expected_players(record.expected_players());
  *order.mutable_borders() = record.borders();
  order.set_joins_running(placement.joins());
  if (record.planned().effective_tick() != 0 || (record.has_planned() && placement.joins())) {
    *order.mutable_planned() = record.planned();
    // A newcomer makes ready before there is a tick, and again when there is.
    if (record.planned().effective_tick() == 0) order.mutable_planned()->set_effective_tick(1);
  }
  SetFailover(record, order);
  SetHeirs(record, order);
  if (instance.checkpoint) order.mutable_checkpoint()->set_tick(instance.checkpoint->tick);
  for (const PropertyChangeEntry& entry : instance.property_changes) {
    if (!entry.outcome) *order.add_property_changes() = entry.change;
  }
  SetInitialState(record, placement, order);
  return order;
}

std::string DescribeExit(const v1::WorkerExited& exited, const v1::WorkerReport& last_report) {
  std::string text = "worker ";
  if (!exited.started()) {
    text += exited.reason().empty() ? "could not be started" : "could not be started: " + exited.reason();
  } else if (!exited.reason().empty()) {
    text += exited.reason();
  } else if (exited.signal() != 0) {
    absl::StrAppend(&text, "was killed by signal ", exited.signal());
  } else {
    absl::StrAppend(&text, "exited with code ", exited.exit_code());
  }
  if (!last_report.failure().empty()) absl::StrAppend(&text, ": ", last_report.failure());
  const auto& lines = exited.last_log_lines();
  if (!lines.empty()) {
    const auto kept = std::min<std::ptrdiff_t>(lines.size(), kReasonLogLines);
    absl::StrAppend(&text, "; last log: ", absl::StrJoin(lines.end() - kept, lines.end(), " | "));
  }
  return OneLine(text, kMaxReasonBytes);
}

std::string OneLine(std::string_view text, std::size_t max_bytes) {
  std::size_t size = std::min(text.size(), max_bytes);
  // Bytes 10xxxxxx continue a UTF-8 character: step back to where it began.
  while (size < text.size() && size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0) == 0x80) --size;
  std::string line(text.substr(0, size));
  std::replace_if(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, ' ');
  return line;
}

}  // namespace tessera::control
