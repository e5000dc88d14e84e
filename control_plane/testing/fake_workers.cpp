#include "control_plane/testing/fake_workers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_format.h"
#include "core/world/player_changes.h"

namespace tessera::control {
namespace {

v1::AgentMessage InventoryOf(const FakeWorker& worker) {
  v1::AgentMessage message;
  *message.mutable_inventory()->mutable_identity() = worker.report.identity();
  *message.mutable_inventory()->mutable_inventory() = worker.inventory;
  return message;
}
v1::AgentMessage Exited(const FakeWorker& worker, bool started, int code, int signal, const std::string& reason) {
  v1::AgentMessage message;
  v1::WorkerExited& exited = *message.mutable_exited();
  *exited.mutable_identity() = worker.report.identity();
  exited.set_started(started);
  exited.set_exit_code(code);
  exited.set_signal(signal);
  exited.set_reason(reason);
  return message;
}

void Put(const std::map<std::uint64_t, std::uint32_t>& bodies, v1::BodyEpochs& out) {
  for (const auto& [body, epoch] : bodies) {
    out.add_bodies(body);
    out.add_epochs(epoch);
  }
}

}  // namespace

std::vector<v1::AgentMessage> FakeWorkers::Apply(const v1::DesiredSet& desired) {
  std::vector<v1::AgentMessage> out;
  std::set<Key> wanted;
  for (const v1::WorkerOrder& order : desired.workers()) {
    wanted.emplace(order.instance_id(), order.region());
    Act(order, out);
  }
  for (auto it = workers.begin(); it != workers.end();) {
    if (wanted.contains(it->first)) {
      ++it;
    } else {
      out.push_back(Exited(it->second, true, 0, 15, "ended by the agent"));
      it = workers.erase(it);
    }
  }
  acted_revision_ = desired.revision();
  return out;
}

v1::AgentMessage FakeWorkers::Heartbeat() {
  v1::AgentMessage message;
  for (auto& [key, worker] : workers) {
    const bool moves = worker.report.phase() == v1::WORKER_PHASE_RUNNING && worker.inventory.version() == 0 &&
                       !still.contains(key.second) && !Stands(worker);
    if (moves) worker.report.set_tick(worker.report.tick() + 15);
  }
  message.mutable_heartbeat()->set_desired_revision(acted_revision_);
  for (const auto& [key, worker] : workers) *message.mutable_heartbeat()->add_workers() = worker.report;
  return message;
}

std::vector<v1::AgentMessage> FakeWorkers::Inventories() const {
  std::vector<v1::AgentMessage> out;
  for (const auto& [key, worker] : workers) {
    if (worker.inventory.version() != 0) out.push_back(InventoryOf(worker));
  }
  return out;
}

v1::AgentMessage FakeWorkers::Kill(const Key& key, int signal) {
  v1::AgentMessage message = Exited(workers.at(key), true, 0, signal, "");
  workers.erase(key);
  return message;
}

void FakeWorkers::Act(const v1::WorkerOrder& order, std::vector<v1::AgentMessage>& out) {
  const Key key(order.instance_id(), order.region());
  auto found = workers.find(key);
  if (found != workers.end() && found->second.report.identity().incarnation() != order.incarnation()) {
    out.push_back(Exited(found->second, true, 0, 15, "ended by the agent"));
    workers.erase(found);
    found = workers.end();
  }
  if (found == workers.end()) {
    if (order.stop()) return;
    found = workers.emplace(key, Start(order)).first;
    if (no_ports) {
      out.push_back(
          Exited(found->second, false, 98, 0, "port in use: no three free ports in 7800-8799 after 16 tries"));
      workers.erase(found);
      return;
    }
    if (exit_at_start.contains(order.region())) {
      out.push_back(Exited(found->second, true, 3, 0, "exited with code 3"));
      for (const char* line : {"one", "two", "three", "no such mesh"})
        out.back().mutable_exited()->add_last_log_lines(line);
      workers.erase(found);
      return;
    }
  }
  FakeWorker& worker = found->second;
  if (order.stop() && stop_in_order) {
    out.push_back(Exited(worker, true, 0, 0, "ended in order"));
    workers.erase(found);
    return;
  }
  if (order.revision() <= worker.order.revision()) return;
  v1::WorkerOrder whole = order;
  EXPECT_TRUE(Continues(worker.order, whole)) << "changes of players since an order that did not come";
  CompletePlayers(std::move(worker.order), whole);
  worker.order = std::move(whole);
  Follow(worker);
  if (FollowMaps(worker) && !mute) out.push_back(InventoryOf(worker));
  v1::AgentMessage message;
  *message.mutable_report() = worker.report;
  out.push_back(message);
}

FakeWorker FakeWorkers::Start(const v1::WorkerOrder& order) {
  ++starts[{order.instance_id(), order.region(), order.incarnation()}];
  FakeWorker worker;
  v1::WorkerIdentity& identity = *worker.report.mutable_identity();
  identity.set_instance_id(order.instance_id());
  identity.set_region(order.region());
  identity.set_incarnation(order.incarnation());
  identity.set_pid(++last_pid_);
  const auto port = static_cast<std::uint32_t>(20000 + 3 * last_pid_);
  worker.report.mutable_address()->set_game_port(port);
  worker.report.mutable_address()->set_link_port(port + 1);
  worker.report.mutable_address()->set_metrics_port(port + 2);
  worker.report.set_public_key(absl::StrFormat("%032d", last_pid_));
  worker.report.set_tick(order.initial_state().tick());
  return worker;
}

void FakeWorkers::Follow(FakeWorker& worker) const {
  v1::WorkerReport& report = worker.report;
  const bool linked = worker.order.peers_size() + 1 >= worker.order.map().regions_size();
  const bool bound = report.phase() >= v1::WORKER_PHASE_BOUND || !worker.order.certificate().empty();
  report.set_phase(!bound               ? v1::WORKER_PHASE_LOADING
                   : !linked            ? v1::WORKER_PHASE_BOUND
                   : worker.order.run() ? v1::WORKER_PHASE_RUNNING
                                        : v1::WORKER_PHASE_LINKED);
  report.set_order_revision(worker.order.revision());
  report.clear_linked_regions();
  for (const v1::RegionAddress& peer : worker.order.peers()) {
    const std::uint32_t self = worker.order.region();
    const bool is_cut = cut.contains(std::minmax(self, peer.region()));
    if (!is_cut && !unlinked.contains(peer.region()) && !unlinked.contains(self)) {
      report.add_linked_regions(peer.region());
    }
  }
  if (!connect_players) return;
  report.clear_connected_players();
  for (const v1::Player& player : worker.order.players()) {
    if (!player.left()) report.add_connected_players(player.number());
  }
}

// Follows bodies, maps and failovers. True if there is an inventory to send.
bool FakeWorkers::FollowMaps(FakeWorker& worker) {
  v1::WorkerReport& report = worker.report;
  const v1::WorkerOrder& order = worker.order;
  if (report.phase() != v1::WORKER_PHASE_RUNNING) return false;
  const std::uint64_t incarnation = report.identity().incarnation();
  if (order.has_failover() && report.map_version() < order.failover().version()) {
    if (order.has_resolution()) return Resume(worker), false;
    const bool is_new = worker.inventory.version() != order.failover().version();
    if (is_new) TakeStock(worker);
    return is_new;
  }
  if (!world->owned.contains(incarnation)) {
    auto& bodies = world->owned[incarnation];
    const std::uint64_t first = 1000ull * report.identity().region() + 1;
    for (std::uint64_t body = first; !order.joins_running() && body < first + FakeWorld::kBodiesEach; ++body) {
      bodies[body] = 1;
    }
  }
  if (!order.joins_running()) report.set_map_version(std::max(report.map_version(), order.map().version()));
  const std::uint64_t planned = order.planned().map().version();
  if (order.has_planned()) report.set_planned_version(planned);
  if (order.planned().committed() && refuse_plans.erase(planned) > 0) report.set_refused_version(planned);
  if (order.planned().committed() && report.refused_version() != planned) Move(worker);
  HoldCopies(worker);
  return false;
}

// By the terms of the map that it goes by.
bool FakeWorkers::Stands(const FakeWorker& worker) {
  const v1::WorkerOrder& order = worker.order;
  const std::uint64_t version = worker.report.map_version();
  const v1::PartitionMap& map = order.planned().map().version() == version ? order.planned().map() : order.map();
  return map.version() == version && map.terms().paused() && order.resumed_version() < version;
}

void FakeWorkers::Move(FakeWorker& worker) {
  const v1::PartitionMap& map = worker.order.planned().map();
  const bool comes = worker.report.map_version() < map.version();
  if (comes && map.terms().paused()) worker.report.set_tick(worker.order.planned().effective_tick() - 1);
  worker.report.set_map_version(map.version());
  const std::uint32_t self = worker.report.identity().region();
  if (std::any_of(map.cells().begin(), map.cells().end(), [&](const auto& cell) { return cell.owner() == self; })) {
    return;
  }
  for (const v1::Cell& cell : map.cells()) {
    if (cell.from() != self) continue;
    for (const v1::RegionAddress& peer : worker.order.peers()) {
      if (peer.region() != cell.owner()) continue;
      auto& mine = world->owned[worker.report.identity().incarnation()];
      for (const auto& [body, epoch] : mine) world->owned[peer.incarnation()][body] = epoch + 1;
      mine.clear();
    }
  }
}

void FakeWorkers::HoldCopies(FakeWorker& worker) {
  worker.standby_copies.clear();
  worker.report.clear_standby_copies();
  for (const std::uint32_t primary : worker.order.primaries()) {
    for (const v1::RegionAddress& peer : worker.order.peers()) {
      if (peer.region() != primary) continue;
      worker.standby_copies[primary] = peer.incarnation();
      v1::StandbyStatus& standby_copy = *worker.report.add_standby_copies();
      standby_copy.set_region(primary);
      standby_copy.set_incarnation(peer.incarnation());
      standby_copy.set_tick(1);
    }
  }
}

void FakeWorkers::TakeStock(FakeWorker& worker) {
  v1::Inventory& inventory = worker.inventory;
  inventory.Clear();
  inventory.set_version(worker.order.failover().version());
  inventory.set_region(worker.report.identity().region());
  inventory.set_tick(worker.report.tick());
  Put(world->owned[worker.report.identity().incarnation()], *inventory.mutable_owned());
  for (const v1::DeadRegion& dead : worker.order.failover().dead()) {
    const auto copy = worker.standby_copies.find(dead.region());
    if (copy == worker.standby_copies.end() || copy->second != dead.incarnation()) continue;
    v1::StandbyCopyInventory& standby_copy = *inventory.add_standby_copies();
    standby_copy.set_region(dead.region());
    standby_copy.set_incarnation(dead.incarnation());
    standby_copy.set_tick(worker.report.tick());
    standby_copy.set_last_acknowledged_ms(last_acknowledged_ms);
    Put(world->owned[dead.incarnation()], *standby_copy.mutable_bodies());
  }
}

void FakeWorkers::Resume(FakeWorker& worker) {
  for (const v1::Takeover& takeover : worker.order.resolution().takeovers()) {
    if (takeover.region() != worker.report.identity().region()) continue;
    world->owned[worker.report.identity().incarnation()][takeover.body()] = takeover.epoch();
  }
  worker.inventory.Clear();
  worker.report.set_map_version(worker.order.resolution().version());
  worker.report.set_tick(worker.order.resolution().resume_tick());
  HoldCopies(worker);
}

}  // namespace tessera::control
