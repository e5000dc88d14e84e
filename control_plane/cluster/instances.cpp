// Instances: made, listed, deleted, and led through their life.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/heirs.h"
#include "control_plane/id_ranges.h"
#include "control_plane/orders.h"
#include "control_plane/pages.h"
#include "control_plane/region_tree.h"
#include "core/region/settings.h"
#include "core/world/partition_io.h"
#include "net/connect_token.h"

namespace tessera::control {
namespace {

absl::Status NoInstance(const char* field, const std::string& id) {
  return absl::NotFoundError(absl::StrCat(field, ": no instance ", OneLine(id, kMaxNameBytes)));
}

// "RUNNING"
std::string Short(v1::InstanceState state) {
  constexpr std::string_view kPrefix = "INSTANCE_STATE_";
  const std::string& name = v1::InstanceState_Name(state);
  return name.size() > kPrefix.size() ? name.substr(kPrefix.size()) : absl::StrCat(static_cast<int>(state));
}

// By a map whose bodies move: who still has some of another's, and who cannot confirm any.
std::string WhatIsWaitedFor(const InstanceEntry& instance) {
  std::string text;
  for (const WorkerEntry& worker : instance.workers) {
    if (const std::uint64_t outside = worker.report.bodies_outside(); outside > 0) {
      absl::StrAppend(&text, "; region ", worker.region, " has ", outside, " to hand over");
    }
    if (worker.report.unprotected()) {
      absl::StrAppend(&text, "; region ", worker.region, " is unprotected and confirms nothing: its heir, region ",
                      HeirOf(instance.record, worker.region), ", does not take its log");
    }
  }
  return text;
}

void SetPlan(const PlacementPlan& plan, records::Instance& record) {
  record.clear_placements();
  for (const PlacedRegion& placed : plan.regions) {
    records::Placement& placement = *record.add_placements();
    placement.set_region(placed.region.value());
    placement.set_host_id(placed.host_id);
    placement.set_incarnation(record.last_incarnation() + 1);
    record.set_last_incarnation(placement.incarnation());
  }
  *record.mutable_map() = ToProto(plan.map);
}

records::Instance MakeRecord(Moment now, const InstancePlan& plan, const PlacementPlan& placed) {
  records::Instance record;
  record.set_request_id(plan.request_id);
  record.set_state(plan.lazy ? v1::INSTANCE_STATE_PENDING : v1::INSTANCE_STATE_STARTING);
  record.set_scene_name(plan.scene_name);
  record.set_scene_hash(plan.scene_hash);
  record.set_tick_rate_hz(plan.tick_rate_hz);
  record.set_expected_players(plan.expected_players);
  record.set_start_deadline_ms(plan.start_deadline.count());
  record.set_snapshot_rate_hz(plan.snapshot_rate_hz);
  *record.mutable_borders() = plan.borders;
  record.set_lazy(plan.lazy);
  record.set_balance(plan.balance);
  record.set_checkpoint_interval_ms(plan.checkpoint_interval.count());
  record.set_keep_checkpoints(plan.keep_checkpoints);
  record.set_leaver_policy(plan.leaver_policy);
  record.set_leaver_grace_ms(static_cast<std::uint32_t>(plan.leaver_grace.count()));
  *record.mutable_bodies() = ToRanges(plan.bodies);
  SetPlan(placed, record);
  record.set_wanted_regions(static_cast<std::uint32_t>(record.placements_size()));
  *record.mutable_properties() = {plan.properties.begin(), plan.properties.end()};
  record.set_properties_taken(true);
  for (const Vec3d& point : plan.spawn_points) {
    v1::Vec3& stored = *record.add_spawn_points();
    stored.set_x(point.x);
    stored.set_y(point.y);
    stored.set_z(point.z);
  }
  *record.mutable_create_time() = ToTimestamp(now.unix_time);
  return record;
}

bool SamePlaces(const records::Instance& a, const records::Instance& b) {
  return a.map().version() == b.map().version() &&
         std::equal(a.placements().begin(), a.placements().end(), b.placements().begin(), b.placements().end(),
                    [](const records::Placement& x, const records::Placement& y) {
                      return x.incarnation() == y.incarnation() && x.host_id() == y.host_id();
                    });
}

bool BeginsFailover(const records::Instance& before, const records::Instance& next) {
  return next.has_failover() && next.map().version() != before.map().version();
}

int Present(const records::Instance& record) {
  return static_cast<int>(std::count_if(record.players().begin(), record.players().end(),
                                        [](const v1::Player& player) { return !player.left(); }));
}

// How many players every worker has a connection of.
int ConnectedEverywhere(const InstanceEntry& instance) {
  return static_cast<int>(std::count_if(
      instance.record.players().begin(), instance.record.players().end(), [&instance](const v1::Player& player) {
        return !player.left() &&
               std::all_of(instance.workers.begin(), instance.workers.end(), [&player](const WorkerEntry& worker) {
                 const auto& connected = worker.report.connected_players();
                 return std::find(connected.begin(), connected.end(), player.number()) != connected.end();
               });
      }));
}

}  // namespace

absl::StatusOr<v1::Instance> Cluster::CreateInstance(Moment now, const InstancePlan& plan, bool validate_only) {
  if (!plan.request_id.empty()) {
    if (auto made = FindByRequestId(plan.request_id); made.ok()) return made;
  }
  const auto placed = PlaceAnew(now, plan.map, nullptr);
  if (!placed.ok()) return placed.status();
  InstanceEntry draft;
  draft.record = MakeRecord(now, plan, *placed);
  if (plan.restored) SetRestored(*placed, *plan.restored, draft.record);
  if (validate_only) {
    draft.record.set_state(v1::INSTANCE_STATE_PENDING);
    return View(draft, true);
  }
  records::Counters counters = counters_;
  counters.set_last_instance(counters.last_instance() + 1);
  const std::uint64_t number = counters.last_instance();
  draft.record.set_id(absl::StrCat("inst-", number));
  draft.record.set_key(random_(net::kKeyBytes));
  std::vector<StoreOp> ops{PutOp("counters", counters.SerializeAsString(), counters_revision_),
                           PutOp(absl::StrCat("instance/", number), draft.record.SerializeAsString(), kAbsent)};
  const bool new_scene = !scenes_.contains(plan.scene_hash);
  if (new_scene) ops.push_back(PutOp(SceneKey(plan.scene_hash), plan.scene_bytes, kAbsent));
  const auto stored = store_.Txn(ops);
  if (!stored.ok()) return absl::UnavailableError(stored.status().message());

  counters_ = counters;
  counters_revision_ = *stored;
  if (new_scene) scenes_[plan.scene_hash].revision = *stored;
  InstanceEntry& instance = Adopt(now, number, draft.record, *stored);
  effects_.log.push_back(absl::StrCat("instance made id=", instance.record.id(), " scene=", plan.scene_name,
                                      " regions=", instance.workers.size(), " state=", Short(instance.record.state())));
  MarkOrders(instance);
  Changed(instance);
  Reconcile(now, instance);
  return View(instance, true);
}

absl::StatusOr<v1::Instance> Cluster::FindByRequestId(const std::string& request_id) const {
  const auto found = request_ids_.find(request_id);
  if (request_id.empty() || found == request_ids_.end()) return absl::NotFoundError("request_id: not seen before");
  return View(instances_.at(found->second), true);
}

absl::StatusOr<v1::Instance> Cluster::GetInstance(const std::string& id) const {
  const InstanceEntry* instance = FindInstance(id);
  if (instance == nullptr) return NoInstance("id", id);
  return View(*instance, true);
}

absl::StatusOr<v1::ListInstancesResponse> Cluster::ListInstances(const v1::ListInstancesRequest& request) const {
  const auto page = ReadPage(request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  v1::ListInstancesResponse response;
  for (auto it = instances_.upper_bound(page->after); it != instances_.end(); ++it) {
    if (response.instances_size() == page->size) {
      response.set_next_page_token(PageToken(std::prev(it)->first));
      break;
    }
    *response.add_instances() = View(it->second, false);
  }
  return response;
}

absl::StatusOr<v1::Instance> Cluster::DeleteInstance(Moment now, const v1::DeleteInstanceRequest& request) {
  InstanceEntry* instance = FindInstance(request.id());
  if (instance == nullptr) return NoInstance("id", request.id());
  const v1::InstanceState state = instance->record.state();
  if (!request.validate_only() && state != v1::INSTANCE_STATE_STOPPING && !IsFinal(state)) {
    records::Instance next = instance->record;
    next.set_state(v1::INSTANCE_STATE_STOPPING);
    next.clear_reason();
    if (absl::Status status = StoreInstance(*instance, next); !status.ok()) return status;
    Entered(now, *instance, state);
    Reconcile(now, *instance);
  } else if (!request.validate_only() && state == v1::INSTANCE_STATE_FAILED) {
    if (absl::Status status = DropCheckpoints(*instance); !status.ok()) return status;
  }
  return View(*instance, true);
}

// Without them it is forgotten in time like all that have ended.
absl::Status Cluster::DropCheckpoints(InstanceEntry& instance) {
  if (instance.record.checkpoints().empty()) return absl::OkStatus();
  records::Instance next = instance.record;
  next.clear_checkpoints();
  const auto dropped = instance.record.checkpoints();
  if (absl::Status status = StoreInstance(instance, next); !status.ok()) return status;
  for (const v1::Checkpoint& checkpoint : dropped)
    effects_.pruned.emplace_back(instance.record.id(), checkpoint.tick());
  Changed(instance);
  return absl::OkStatus();
}

const InstanceEntry* Cluster::FindInstance(const std::string& id) const {
  const auto found = instances_.find(NumberOf(id, "inst-"));
  return found == instances_.end() ? nullptr : &found->second;
}

InstanceEntry* Cluster::FindInstance(const std::string& id) {
  return const_cast<InstanceEntry*>(std::as_const(*this).FindInstance(id));
}

std::optional<v1::InstanceState> Cluster::StateOf(const std::string& instance_id) const {
  const InstanceEntry* instance = FindInstance(instance_id);
  if (instance == nullptr) return std::nullopt;
  return ShownState(*instance);
}

v1::InstanceState Cluster::ShownState(const InstanceEntry& instance) const {
  const bool degraded = instance.record.state() == v1::INSTANCE_STATE_RUNNING && !instance.degraded.empty();
  return degraded ? v1::INSTANCE_STATE_DEGRADED : instance.record.state();
}

LifeFacts Cluster::Facts(const InstanceEntry& instance, Moment now) const {
  LifeFacts facts;
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    const WorkerEntry& worker = instance.workers[i];
    const auto host = hosts_.find(NumberOf(instance.record.placements(static_cast<int>(i)).host_id(), "host-"));
    const bool known = host != hosts_.end();
    facts.workers.push_back({worker.region, worker.report.phase(), known && host->second.lost,
                             known ? host->second.record.name() : "a removed host", worker.gone, worker.ending});
  }
  const bool pending = instance.record.state() == v1::INSTANCE_STATE_PENDING;
  const int there = pending ? instance.waiting + Present(instance.record) : ConnectedEverywhere(instance);
  facts.players_ready = there >= static_cast<int>(instance.record.expected_players());
  facts.start_deadline_passed = now.steady >= instance.start_deadline;
  facts.start_timed_out = now.steady - instance.state_since >= settings_.start_timeout;
  return facts;
}

void Cluster::Reconcile(Moment now, const std::set<std::uint64_t>& numbers) {
  for (const std::uint64_t number : numbers) Reconcile(now, instances_.at(number));
}

// Leads the instance on as far as the facts allow. A step that cannot be stored is not taken; the timer comes back to
// it.
void Cluster::Reconcile(Moment now, InstanceEntry& instance) {
  while (true) {
    const LifeFacts facts = Facts(instance, now);
    const std::optional<records::Instance> next = NextRecord(now, instance, facts);
    if (!next) {
      NoteDegraded(instance, facts);
      return;
    }
    const v1::InstanceState previous = instance.record.state();
    const bool placed_anew = !SamePlaces(instance.record, *next);
    if (BeginsFailover(instance.record, *next)) WatchFailover(now, instance, *next);
    if (absl::Status status = StoreInstance(instance, *next); !status.ok()) {
      NoteTrouble(instance, "instance cannot go on for now", status);
      return;
    }
    instance.trouble.clear();
    if (placed_anew) Assign(instance);
    Entered(now, instance, previous);
  }
}

// The record after one step; nothing if there is none to take.
std::optional<records::Instance> Cluster::NextRecord(Moment now, InstanceEntry& instance, const LifeFacts& facts) {
  const records::Instance& record = instance.record;
  if (record.state() == v1::INSTANCE_STATE_PLACING) {
    records::Instance next = record;
    StepPlacing(now, instance, next);
    if (next.state() == record.state() && next.reason() == record.reason()) return std::nullopt;
    if (IsFinal(next.state())) *next.mutable_end_time() = ToTimestamp(now.unix_time);
    return next;
  }
  if (record.state() == v1::INSTANCE_STATE_RUNNING) {
    if (auto next = NextProtected(instance)) return next;
    if (auto next = NextFailover(now, instance)) return next;
    if (auto next = NextChange(now, instance)) return next;
    if (auto next = NextLeavers(now, instance)) return next;
  }
  LifeStep step = NextStep(record.state(), record.run(), facts);
  if (step.state == record.state() && step.run == record.run()) return std::nullopt;
  records::Instance next = record;
  next.set_state(step.state);
  next.set_run(step.run);
  next.set_reason(std::move(step.reason));
  if (step.state == v1::INSTANCE_STATE_RUNNING) *next.mutable_start_time() = ToTimestamp(now.unix_time);
  if (IsFinal(step.state)) *next.mutable_end_time() = ToTimestamp(now.unix_time);
  return next;
}

// The timer tries again ten times a second; once is enough for the log.
void Cluster::NoteTrouble(InstanceEntry& instance, const char* what, const absl::Status& status) {
  if (std::exchange(instance.trouble, std::string(status.message())) == status.message()) return;
  effects_.log.push_back(absl::StrCat(what, " id=", instance.record.id(), ": ", status.message()));
}

void Cluster::NoteDegraded(InstanceEntry& instance, const LifeFacts& facts) {
  std::string degraded = instance.record.state() == v1::INSTANCE_STATE_RUNNING ? DegradedReason(facts) : "";
  if (instance.record.has_failover()) {
    degraded = absl::StrCat("failover of ", DescribeFailover(instance.record.failover()), degraded.empty() ? "" : "; ",
                            degraded);
  }
  if (degraded == instance.degraded) return;
  effects_.log.push_back(degraded.empty()
                             ? absl::StrCat("instance healthy id=", instance.record.id())
                             : absl::StrCat("instance degraded id=", instance.record.id(), ": ", degraded));
  instance.degraded = std::move(degraded);
  Changed(instance);
}

// A lazy instance's places were reserved when it was made. If a host of them is not ready now, others are looked for.
void Cluster::StepPlacing(Moment now, const InstanceEntry& instance, records::Instance& next) const {
  const bool usable =
      std::all_of(next.placements().begin(), next.placements().end(), [this](const records::Placement& placement) {
        const auto host = hosts_.find(NumberOf(placement.host_id(), "host-"));
        return host != hosts_.end() && StateOf(host->second) == v1::HOST_STATE_READY;
      });
  if (!usable) {
    const auto placed = PlaceAnew(now, instance.map, &instance);
    if (!placed.ok()) {
      const bool late = now.steady - instance.state_since >= settings_.start_timeout;
      if (late) next.set_state(v1::INSTANCE_STATE_FAILED);
      next.set_reason(std::string(placed.status().message()));
      return;
    }
    SetPlan(*placed, next);
  }
  next.set_state(v1::INSTANCE_STATE_STARTING);
  next.clear_reason();
}

// What follows from a stored step, other than the next step.
void Cluster::Entered(Moment now, InstanceEntry& instance, v1::InstanceState previous) {
  const v1::InstanceState state = instance.record.state();
  if (state != previous) {
    instance.state_since = now.steady;
    effects_.log.push_back(absl::StrCat("instance ", Short(previous), " -> ", Short(state),
                                        " id=", instance.record.id(), instance.record.reason().empty() ? "" : ": ",
                                        instance.record.reason()));
  }
  if (!WantsWorkers(state)) instance.degraded.clear();
  if (state == v1::INSTANCE_STATE_STOPPING || state == v1::INSTANCE_STATE_FAILED) {
    const bool never_ordered = previous == v1::INSTANCE_STATE_PENDING || previous == v1::INSTANCE_STATE_PLACING;
    for (std::size_t i = 0; i < instance.workers.size(); ++i) {
      const auto host = hosts_.find(NumberOf(instance.record.placements(static_cast<int>(i)).host_id(), "host-"));
      if (never_ordered || host == hosts_.end() || host->second.lost) SetGone(instance, instance.workers[i], "");
    }
  }
  MarkOrders(instance);
  Changed(instance);
}

void Cluster::SetGone(InstanceEntry& instance, WorkerEntry& worker, std::string ending) {
  if (worker.gone) return;
  worker.gone = true;
  worker.ending = std::move(ending);
  const auto index = static_cast<std::size_t>(&worker - instance.workers.data());
  const auto host = hosts_.find(NumberOf(instance.record.placements(static_cast<int>(index)).host_id(), "host-"));
  if (host != hosts_.end()) {
    host->second.workers.erase({instance.number, index});
    MarkDesired(host->second);
  }
  Changed(instance);
}

void Cluster::MarkOrders(InstanceEntry& instance) {
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    if (instance.workers[i].gone) continue;
    const auto host = hosts_.find(NumberOf(instance.record.placements(static_cast<int>(i)).host_id(), "host-"));
    if (host != hosts_.end()) MarkDesired(host->second);
  }
}

// What is under way, and what would be lost now.
void Cluster::ViewChanges(const InstanceEntry& instance, v1::Instance& view) const {
  const records::Instance& record = instance.record;
  if (record.has_failover()) {
    v1::InstanceChange& change = *view.add_changes();
    change.set_text(absl::StrCat("failover of ", DescribeFailover(record.failover())));
    change.set_version(record.map().version());
  } else if (const std::string plan = DescribePlan(record); !plan.empty()) {
    v1::InstanceChange& change = *view.add_changes();
    change.set_text(absl::StrCat(plan, WhatIsWaitedFor(instance)));
    change.set_version(record.has_planned() ? record.planned().map().version() : record.map().version());
    change.set_effective_tick(record.planned().effective_tick());
  }
  RegionLoads loads;
  for (const WorkerEntry& worker : instance.workers) {
    if (worker.report.unprotected()) view.add_unprotected_regions(worker.region);
    loads[RegionId(worker.region)] = worker.report.step().p50_seconds();
  }
  const bool measured = std::all_of(loads.begin(), loads.end(), [](const auto& load) { return load.second > 0; });
  if (measured && !loads.empty()) view.set_imbalance(Imbalance(loads));
}

void Cluster::Changed(InstanceEntry& instance) { effects_.instances.insert(instance.record.id()); }

v1::Instance Cluster::View(const InstanceEntry& instance, bool whole) const {
  const records::Instance& record = instance.record;
  v1::Instance view;
  view.set_id(record.id());
  view.set_state(ShownState(instance));
  view.set_reason(instance.degraded.empty() ? record.reason() : instance.degraded);
  view.set_scene_name(record.scene_name());
  view.set_scene_hash(record.scene_hash());
  view.set_regions(static_cast<std::uint32_t>(record.placements_size()));
  view.set_expected_players(record.expected_players());
  view.set_players(static_cast<std::uint32_t>(Present(record)));
  view.set_snapshot_rate_hz(record.snapshot_rate_hz());
  *view.mutable_borders() = record.borders();
  // Records made before there were such settings lack them.
  if (!record.borders().has_ghost_depth()) view.mutable_borders()->set_ghost_depth(region::Settings().ghost_depth);
  if (!record.borders().has_whole_up_to()) view.mutable_borders()->set_whole_up_to(region::Settings().whole_up_to);
  *view.mutable_create_time() = record.create_time();
  if (record.has_start_time()) *view.mutable_start_time() = record.start_time();
  view.set_revision(static_cast<std::uint64_t>(instance.revision));
  view.set_wanted_regions(record.wanted_regions() == 0 ? view.regions() : record.wanted_regions());
  view.set_failovers(record.failovers());
  view.set_lost_bodies(record.lost_bodies());
  view.set_lost_ticks(record.lost_ticks());
  if (!whole) return view;
  ViewChanges(instance, view);
  *view.mutable_events() = record.events();
  *view.mutable_checkpoints() = record.checkpoints();
  *view.mutable_map() = record.map();
  *view.mutable_player_list() = record.players();
  *view.mutable_properties() = record.properties();
  for (int i = 0; i < record.placements_size(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    if (index < instance.workers.size() && instance.workers[index].gone) continue;
    v1::RegionStatus& status = *view.add_region_status();
    status.set_region(record.placements(i).region());
    const auto host = hosts_.find(NumberOf(record.placements(i).host_id(), "host-"));
    if (host != hosts_.end()) status.set_host(host->second.record.name());
    if (index < instance.workers.size() && instance.workers[index].reported)
      *status.mutable_report() = instance.workers[index].report;
  }
  return view;
}

}  // namespace tessera::control
