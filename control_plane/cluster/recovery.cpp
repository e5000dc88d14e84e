#include "control_plane/cluster/recovery.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/backup.h"
#include "control_plane/control_settings.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/stored_records.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

bool IsOf(const v1::WorkerOrder& order, const v1::WorkerIdentity& identity) {
  return order.instance_id() == identity.instance_id() && order.region() == identity.region() &&
         order.incarnation() == identity.incarnation();
}

// A host can say what it likes; this much shows that the order was once given.
bool IsBelievable(const InstanceEntry& instance, const v1::WorkerOrder& order) {
  const net::VerificationKey& key = instance.key.verification_key();
  const std::string expected(key.begin(), key.end());
  return order.instance_key() == expected && FromProto(order.map()).ok() && order.incarnation() != 0 &&
         (!order.has_planned() || FromProto(order.planned().map()).ok());
}

// True if an order is the worker's own, or knows it as a peer.
bool IsNamed(const WorkerEntry& worker, const std::vector<HeldOrder>& orders) {
  return std::any_of(orders.begin(), orders.end(), [&worker](const HeldOrder& held) {
    const auto& peers = held.order.peers();
    const auto is_it = [&worker](std::uint32_t region, std::uint64_t incarnation) {
      return region == worker.region && incarnation == worker.incarnation;
    };
    return is_it(held.order.region(), held.order.incarnation()) ||
           std::any_of(peers.begin(), peers.end(),
                       [&](const v1::RegionAddress& peer) { return is_it(peer.region(), peer.incarnation()); });
  });
}

// Drops the unknown workers that `gone` names. False: there were none.
template <class Gone>
absl::StatusOr<bool> Forget(ClusterState& state, HostEntry& host, const Gone& gone) {
  records::Host next = host.record;
  auto& unknown = *next.mutable_unknown_workers();
  const auto kept = std::remove_if(unknown.begin(), unknown.end(), gone);
  if (kept == unknown.end()) return false;
  unknown.erase(kept, unknown.end());
  if (absl::Status status = state.StoreHost(host, next); !status.ok()) return status;
  state.MarkDesired(host);
  return true;
}

}  // namespace

Recovery::Recovery(ClusterState& state, Now now) : state_(state), begun_(now.steady) {
  if (!active()) return;
  state_.Log(absl::StrCat(
                 state_.recovers_unreadable() ? "records of the store cannot be read" : "the store comes from a backup",
                 ": waiting for the hosts to say what runs"),
             Severity::kWarning);
}

void Recovery::NoteReport(const v1::WorkerReport& report, Now now) {
  NoteAlive(report.identity());
  auto& regions = stepped_[report.identity().instance_id()];
  const auto [known, is_new] = regions.try_emplace(report.identity().region(), Stepped{report.tick(), std::nullopt});
  Stepped& region = known->second;
  if ((!is_new && report.tick() > region.tick) || report.world_paused()) region.at = now.steady;
  region.tick = report.tick();
  CopiesHeld& copies = copies_[report.identity().instance_id()];
  for (const v1::StandbyStatus& copy : report.standby_copies()) {
    copies[copy.region()] = std::max(copies[copy.region()], copy.incarnation());
  }
}

// By the map of the newest order, where its hosts have answered.
bool Recovery::KnownToStep(const records::Instance& record, Now now) const {
  const auto stepped = stepped_.find(record.id());
  if (stepped == stepped_.end()) return false;
  const v1::PartitionMap* map = &record.map();
  for (const auto& [number, orders] : held_) {
    for (const v1::WorkerOrder& order : orders) {
      if (order.instance_id() == record.id() && order.map().version() > map->version()) map = &order.map();
    }
  }
  return std::all_of(map->regions().begin(), map->regions().end(), [&](const v1::MapRegion& region) {
    const auto known = stepped->second.find(region.id());
    return known != stepped->second.end() && known->second.at && now.steady - *known->second.at <= kStillAfter;
  });
}

void Recovery::NoteHealth(Now now) {
  if (!active()) return;
  for (InstanceEntry& instance : state_.EachInstance()) {
    if (instance.record.state() != v1::INSTANCE_STATE_RUNNING) continue;
    std::string degraded;
    if (!KnownToStep(instance.record, now)) {
      degraded = absl::StrCat("not known to step yet: ", held_.size(), " of ", state_.hosts().size(),
                              " hosts have said what they run");
    }
    if (degraded == instance.degraded) continue;
    if (instance.degraded.empty()) instance.degraded_since = now.unix_time;
    instance.degraded = std::move(degraded);
    state_.MarkChanged(instance);
  }
}

void Recovery::TakeOrders(const HostEntry& host, const v1::HeldOrders& held) {
  for (const v1::WorkerOrder& order : held.orders()) state_.NoteRevision(order.revision());
  held_[host.number] = {held.orders().begin(), held.orders().end()};
  state_.Log(absl::StrCat("orders taken up host=", host.record.name(), " workers=", held.orders_size()));
}

bool Recovery::Due(Now now) const { return now.steady - begun_ >= kRecoverPatience || AllAnswered(); }

bool Recovery::AllAnswered() const {
  return std::all_of(state_.hosts().begin(), state_.hosts().end(), [this](const auto& numbered) {
    // One that was never admitted runs nothing.
    return numbered.second.record.secret_hash().empty() || held_.contains(numbered.first);
  });
}

bool Recovery::AllHostsAnswered(const records::Instance& record) const {
  return std::all_of(record.placements().begin(), record.placements().end(), [this](const auto& placement) {
    const HostEntry* host = state_.FindHost(placement.host_id());
    return host == nullptr || held_.contains(host->number);
  });
}

bool Recovery::Step(Now now) {
  if (!active() || !Due(now)) return false;
  std::map<std::uint64_t, std::vector<HeldOrder>> orders;  // by the number of the instance
  for (const auto& [number, held] : held_) {
    if (!state_.hosts().contains(number)) continue;  // it was revoked since it answered
    const HostEntry& host = state_.hosts().at(number);
    for (const v1::WorkerOrder& order : held) {
      const InstanceEntry* instance = state_.FindInstance(order.instance_id());
      if (instance == nullptr || IsFinal(instance->record.state()) || !IsBelievable(*instance, order)) continue;
      orders[instance->number].push_back({host.record.id(), order});
    }
  }
  absl::Status status = KeepUnknown();
  for (InstanceEntry& instance : state_.EachInstance()) {
    if (!status.ok()) break;
    if (IsFinal(instance.record.state())) continue;
    const auto found = orders.find(instance.number);
    if (state_.recovers_unreadable()) {
      if (found != orders.end()) status = TakeUpPlayers(instance, found->second, now);
      continue;
    }
    status = found == orders.end() ? EndUnlessItRuns(instance, now) : TakeUp(instance, found->second, now);
  }
  if (status.ok()) status = state_.EndRecovery();
  if (!status.ok()) {  // records that were stored stay, and are found again as they are
    const std::string why(status.message());
    if (std::exchange(trouble_, why) != why) state_.Log("what runs cannot be taken up: " + why, Severity::kError);
    return false;
  }
  state_.Log(absl::StrCat("what runs is taken up hosts=", held_.size(), " of ", state_.hosts().size()));
  held_.clear();
  stepped_.clear();
  copies_.clear();
  for (HostEntry& host : state_.EachHost()) state_.MarkDesired(host);
  return true;
}

absl::Status Recovery::TakeUp(InstanceEntry& instance, const std::vector<HeldOrder>& orders, Now now) {
  const auto host_at = [this](const std::string& address) {
    std::string found;
    for (const auto& [number, host] : state_.hosts()) {
      if (host.record.advertise_address() != address) continue;
      if (!found.empty()) return std::string();  // any of several
      found = host.record.id();
    }
    return found;
  };
  // Whoever was begun from this backup before has given numbers on from the same ones.
  records::Instance old = instance.record;
  if (state_.restored_again()) Raise(old);
  records::Instance next = AdoptOrders(old, orders, copies_[old.id()], host_at);
  // A game that came after the backup cannot be given to a new worker.
  std::string lacks;
  for (const std::string& key : ContentKeys(next)) {
    if (!state_.ContentInUse(key)) lacks = "; its game came after the backup: set it again (tessera instance set-game)";
  }
  if (!lacks.empty()) {
    next.set_game_hash(instance.record.game_hash());
    next.set_game_name(instance.record.game_name());
    next.set_game_native(instance.record.game_native());
    next.clear_movement();
    if (instance.record.has_movement()) *next.mutable_movement() = instance.record.movement();
  }
  AddEvent(next, now, "taken up as it runs, after the cluster was restored from a backup" + lacks);
  if (absl::Status status = state_.StoreWithPlayers(instance, next, AdoptPlayers(instance.players, orders));
      !status.ok()) {
    return status;
  }
  if (next.run()) EndMissing(instance, orders);
  return absl::OkStatus();
}

// A region of a running world that no order names died just before, and where it was placed it is not. Ordered to
// begin, it would begin from the scene, beside those who have its bodies. Once all hosts have answered it runs nowhere;
// else its lease has to run out.
void Recovery::EndMissing(InstanceEntry& instance, const std::vector<HeldOrder>& orders) {
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    WorkerEntry& worker = instance.workers[i];
    const HostEntry* const host = HostAt(state_, instance, i);
    if (IsNamed(worker, orders) || (host != nullptr && !held_.contains(host->number))) continue;
    worker.evicted = !AllAnswered();
    state_.SetGone(instance, worker, "found on no host after the cluster was restored");
  }
}

absl::Status Recovery::TakeUpPlayers(InstanceEntry& instance, const std::vector<HeldOrder>& orders, Now now) {
  if (!state_.LacksPlayers(instance.number)) return absl::OkStatus();
  records::Instance next = instance.record;
  Players players = AdoptPlayers(instance.players, orders);
  for (const records::StoredPlayer* known : players.All()) {
    next.set_last_player(std::max(next.last_player(), known->player().number()));
  }
  AddEvent(next, now, "players that the store could not say are taken up from the regions");
  return state_.StoreWithPlayers(instance, next, players);
}

absl::Status Recovery::EndUnlessItRuns(InstanceEntry& instance, Now now) {
  const v1::InstanceState state = instance.record.state();
  if (state == v1::INSTANCE_STATE_PENDING || alive_.contains(instance.record.id())) return absl::OkStatus();
  if (!AllHostsAnswered(instance.record)) return absl::OkStatus();
  records::Instance next = instance.record;
  next.set_state(v1::INSTANCE_STATE_ENDED);
  next.set_reason("ran on none of its hosts when the cluster was restored from a backup");
  *next.mutable_end_time() = ToTimestamp(now.unix_time);
  AddEvent(next, now, next.reason());
  state_.Log(absl::StrCat("instance not taken up id=", next.id(), ": ", next.reason()), Severity::kWarning);
  if (absl::Status status = state_.StoreInstance(instance, next); !status.ok()) return status;
  instance.degraded.clear();
  for (WorkerEntry& worker : instance.workers) state_.SetGone(instance, worker, "");
  return absl::OkStatus();
}

absl::Status Recovery::KeepUnknown() {
  for (HostEntry& host : state_.EachHost()) {
    const auto held = held_.find(host.number);
    if (held == held_.end()) continue;
    records::Host next = host.record;
    next.clear_unknown_workers();
    for (const v1::WorkerOrder& order : held->second) {
      const InstanceEntry* instance = state_.FindInstance(order.instance_id());
      if (instance != nullptr && !IsFinal(instance->record.state())) continue;
      *next.add_unknown_workers() = order;
      state_.Log(absl::StrCat("worker of an unknown world left as it is host=", host.record.name(),
                              " instance=", order.instance_id(), " region=", order.region()),
                 Severity::kWarning);
    }
    if (next.SerializeAsString() == host.record.SerializeAsString()) continue;
    if (absl::Status status = state_.StoreHost(host, next); !status.ok()) return status;
  }
  return absl::OkStatus();
}

// --- Workers of worlds that nobody knows.

bool IsUnknownWorker(const HostEntry& host, const v1::WorkerIdentity& identity) {
  const auto& unknown = host.record.unknown_workers();
  return std::any_of(unknown.begin(), unknown.end(),
                     [&identity](const v1::WorkerOrder& order) { return IsOf(order, identity); });
}

absl::StatusOr<bool> ForgetUnknown(ClusterState& state, const std::string& instance_id) {
  bool any = false;
  for (HostEntry& host : state.EachHost()) {
    const auto forgotten =
        Forget(state, host, [&](const v1::WorkerOrder& order) { return order.instance_id() == instance_id; });
    if (!forgotten.ok()) return forgotten.status();
    any = any || *forgotten;
  }
  return any;
}

void ForgetUnknownWorker(ClusterState& state, HostEntry& host, const v1::WorkerIdentity& identity) {
  // Where it cannot be stored, the agent says it again.
  (void)Forget(state, host, [&](const v1::WorkerOrder& order) { return IsOf(order, identity); });
}

}  // namespace tessera::control
