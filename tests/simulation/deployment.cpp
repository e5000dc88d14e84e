#include "tests/simulation/deployment.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/queries.h"
#include "core/game/game_file.h"
#include "core/region/testing/kept_bodies.h"
#include "core/world/limits.h"
#include "core/world/partition_change.h"

namespace tessera::simulation {
namespace {

constexpr std::uint64_t kStepsBetweenChecks = 32;
constexpr Micros kPatience = Milliseconds(30'000);
constexpr std::uint64_t kTicksSettling = 10;
constexpr int kFreezes = 20;

// The invariant checker knows owners by number: that of a life.
RegionId LifeOf(const SimulatedWorker& worker) { return RegionId(worker.node()); }

std::string Name(const SimulatedWorker& worker) {
  return absl::StrCat("region ", worker.identity().region.value(), "#", worker.identity().incarnation.value(),
                      " on host ", worker.place());
}

}  // namespace

Deployment::Deployment(std::shared_ptr<const Scene> scene, const DeploymentOptions& options)
    : around_(options.seed, std::move(scene)),
      store_(around_.timeline),
      map_(*MakeGridMap(around_.scene->ground(), options.regions)),
      invariants_(std::make_unique<InvariantChecker>(*around_.scene)),
      regions_(options.regions) {
  for (std::uint32_t number = 1; number <= options.controls; ++number) {
    controls_.push_back(std::make_unique<SimulatedControl>(around_.timeline, around_.network, store_,
                                                           options.seed + number, number, options.controls > 1));
  }
  around_.settings = options.settings;
  around_.game = options.game;
  around_.damaged_games = options.damaged_games;
  around_.on_step = [this](SimulatedWorker& worker, const region::StepResult& result) { Stepped(worker, result); };
  around_.on_takeover = [this](SimulatedWorker& worker, const worker::OrderedFailover& failover) {
    TakenOver(worker, failover);
  };
  around_.on_failure = [this](SimulatedWorker& worker, const std::string& what) {
    invariants_->Problem(tick(), absl::StrCat(Name(worker), " failed: ", what));
  };
  Begin(options);
}

Deployment::~Deployment() = default;

void Deployment::Begin(const DeploymentOptions& options) {
  StartControls();
  RunUntil(kPatience, [this] { return control().alive(); });
  for (std::uint32_t i = 1; i <= options.hosts; ++i) {
    v1::AddHostRequest request;
    request.set_name(absl::StrCat("host", i));
    request.set_max_regions(kMaxRegions);
    const auto added =
        control().Call([&](control::Cluster& cluster, control::Now now) { return cluster.AddHost(now, request); });
    hosts_.push_back(std::make_unique<SimulatedHost>(around_, controls_, i, options.capacity, added->join_token()));
    hosts_.back()->on_ending = [this](SimulatedWorker& worker) { Ending(worker); };
    hosts_.back()->StartAgent();
  }
  RunUntil(kPatience, [&] { return std::ranges::all_of(hosts_, [](const auto& host) { return host->admitted(); }); });
  control::InstancePlan plan;
  plan.scene_name = "simulated";
  plan.scene_hash = std::string(64, '0');
  plan.contents.scene = "scene";
  if (!options.game.empty()) {
    plan.game_name = "game.lua";
    plan.game_hash = game::GameHash(options.game);
    plan.contents.game = options.game;
  }
  plan.tick_rate_hz = around_.scene->tick_rate_hz;
  plan.snapshot_rate_hz = 30;
  plan.start_deadline = std::chrono::seconds(30);
  plan.checkpoint_interval = options.checkpoint_interval;
  plan.map = map_;
  for (const BodyId id : invariants_->expected()) plan.bodies.push_back(id);
  for (const PropertyDef& declared : around_.scene->properties) {
    v1::Property& property = plan.properties.emplace_back();
    property.set_name(declared.name);
    property.set_number(std::get<std::int64_t>(declared.initial));
  }
  if (around_.scene->player) plan.spawn_points = around_.scene->player->spawn_points;
  const auto made = control().Call(
      [&](control::Cluster& cluster, control::Now now) { return cluster.CreateInstance(now, plan, false); });
  if (!made.ok()) return invariants_->Problem(Tick(), std::string(made.status().message()));
  id_ = made->id();
}

void Deployment::RunFor(Micros time) {
  const Micros end = around_.timeline.now() + time;
  while (!around_.timeline.empty() && around_.timeline.next() <= end) around_.timeline.RunNext();
  around_.timeline.AdvanceTo(end);
  if (!control().answers()) return;
  const auto seen =
      control().Call([this](control::Cluster& cluster, control::Now) { return GetInstance(cluster.state(), id_); });
  if (seen.ok()) last_seen_ = *seen;
  TakeAnswers();
}

v1::Instance Deployment::instance() const { return last_seen_; }

std::vector<SimulatedWorker*> Deployment::Workers() const {
  std::vector<SimulatedWorker*> all;
  for (const auto& host : hosts_) {
    for (SimulatedWorker* worker : host->workers()) all.push_back(worker);
  }
  return all;
}

SimulatedWorker* Deployment::Find(RegionId region) {
  for (SimulatedWorker* worker : Workers()) {
    if (worker->identity().region == region && Counts(*worker)) return worker;
  }
  return nullptr;
}

void Deployment::Kill(RegionId region) { Kill(*Find(region)); }

void Deployment::Kill(const SimulatedWorker& worker) {
  const worker::Identity& identity = worker.identity();
  host(worker.place()).KillWorker({identity.instance_id, identity.region.value(), identity.incarnation.value()});
}

SimulatedWorker* Deployment::Newcomer() const {
  for (SimulatedWorker* worker : Workers()) {
    if (worker->order().joins_running && Counts(*worker)) return worker;
  }
  return nullptr;
}

bool Deployment::Scale(std::uint32_t regions) {
  if (!control().alive()) return false;
  v1::ScaleInstanceRequest request;
  request.set_id(id_);
  request.set_regions(regions);
  const auto taken = control().Call([&](control::Cluster& cluster, control::Now now) -> absl::StatusOr<v1::Instance> {
    if (cluster.state().recovering()) return absl::UnavailableError("it takes up what runs");  // as the doors answer
    return cluster.ScaleInstance(now, request);
  });
  if (taken.ok()) regions_ = regions;
  perhaps_ = absl::IsUnavailable(taken.status()) ? regions : 0;
  return taken.ok();
}

absl::Status Deployment::Pause(bool paused) {
  return control()
      .Call([&](control::Cluster& cluster, control::Now now) {
        v1::PauseInstanceRequest pause;
        pause.set_id(id_);
        v1::ResumeInstanceRequest resume;
        resume.set_id(id_);
        return paused ? cluster.PauseInstance(now, pause) : cluster.ResumeInstance(now, resume);
      })
      .status();
}

absl::Status Deployment::MakeTicks(std::uint32_t ticks) {
  v1::ResumeInstanceRequest request;
  request.set_id(id_);
  request.set_ticks(ticks);
  return control()
      .Call([&](control::Cluster& cluster, control::Now now) { return cluster.ResumeInstance(now, request); })
      .status();
}

absl::Status Deployment::SetPace(double ticks_per_second) {
  v1::SetPaceRequest request;
  request.set_id(id_);
  request.set_ticks_per_second(ticks_per_second);
  return control()
      .Call([&](control::Cluster& cluster, control::Now now) { return cluster.SetPace(now, request); })
      .status();
}

absl::Status Deployment::SetGame(const std::string& game, const std::set<RegionId>& damaged) {
  const std::string hash = game::GameHash(game);
  around_.next_games[hash] = game;
  around_.damaged_games = damaged;
  v1::SetGameRequest request;
  request.set_id(id_);
  request.mutable_game()->set_name("next.lua");
  request.mutable_game()->set_content(game);
  return control()
      .Call([&](control::Cluster& cluster, control::Now now) { return cluster.SetGame(now, request, hash); })
      .status();
}

bool Deployment::Calm() const {
  return control().alive() && last_seen_.state() == v1::INSTANCE_STATE_RUNNING && Still();
}

bool Deployment::Still() const {
  const std::vector<SimulatedWorker*> workers = Workers();
  if (workers.empty() || (workers.size() != regions_ && workers.size() != perhaps_)) return false;
  if (control().alive() && last_seen_.changes_size() > 0) return false;
  // A write under way was decided before: it may be a death, while a host was silent.
  if (std::ranges::any_of(controls_, [](const auto& control) { return control->writing(); })) return false;
  const MapVersion version = workers.front()->region() ? workers.front()->region()->map().version() : MapVersion();
  return std::ranges::all_of(workers, [&](const SimulatedWorker* worker) {
    if (!worker->Moves() || !worker->Protected() || !Counts(*worker)) return false;
    const region::Region& region = *worker->region();
    return region.map().version() == version && !region.committed() && !InTransition(region.map()) &&
           region.map().version().value() == last_seen_.map().version();
  });
}

bool Deployment::AwaitCalm(Micros patience) {
  return RunUntil(patience, [this] { return Calm(); });
}

void Deployment::Settle() {
  around_.network.conditions() = {};
  around_.network.ClearCuts();
  StartControls();
  for (const auto& host : hosts_) {
    if (!host->agent_alive()) host->StartAgent();
  }
  if (!AwaitCalm(kPatience)) return invariants_->Problem(tick(), "it does not come to rest:" + Standing());
  RunFor(Milliseconds(500));
  if (!AwaitCalm(kPatience)) return invariants_->Problem(tick(), "it does not stay at rest:" + Standing());
  if (!Freeze()) return invariants_->Problem(tick(), "there is no end to changes:" + Standing());
  const Tick end = tick() + kTicksSettling;
  for (SimulatedWorker* worker : Workers()) worker->set_target(end);
  const auto there = [&] {
    return std::ranges::all_of(Workers(), [&](SimulatedWorker* worker) { return worker->region()->tick() >= end; });
  };
  if (!RunUntil(kPatience, there)) return invariants_->Problem(tick(), "ticks differ at the end:" + Standing());
  std::vector<BodyId> owned;
  for (SimulatedWorker* worker : Workers()) {
    if (worker->region()->tick() != end) invariants_->Problem(tick(), "ticks differ at the end");
    for (const region::OwnedBody& body : worker->region()->owned()) owned.push_back(body.def->id);
    worker->set_target(Tick(~Tick::rep{0} >> 1));
  }
  invariants_->CheckOwners(end, owned);
  CheckHealths(end);
  CheckCopies();
  StartControls();
  for (const auto& host : hosts_) {
    for (const auto& [key, count] : host->starts()) {
      if (count > 1) invariants_->Problem(end, absl::StrCat(key.ToString(), " was started ", count, " times"));
    }
  }
}

// Without a control plane nothing is changed any more, unless it had begun to.
bool Deployment::Freeze() {
  for (int i = 0; i < kFreezes; ++i) {
    KillControls();
    RunFor(Milliseconds(200));
    if (Still()) return true;
    StartControls();
    if (!AwaitCalm(kPatience)) return false;
  }
  return false;
}

// --- What is checked.

Tick Deployment::tick() const {
  Tick newest;
  for (const auto& [node, tick] : last_step_) newest = std::max(newest, tick);
  return newest;
}

void Deployment::Stepped(SimulatedWorker& worker, const region::StepResult& result) {
  ++totals_.steps;
  totals_.handovers += result.handed_out;
  if (before_.contains(worker.node())) return;
  if (on_step) on_step(worker, result);
  if (!Counts(worker)) return TwoOwners(worker, Name(worker) + " steps though its place was taken");
  invariants_->Stepped(LifeOf(worker), result.tick, worker.region()->owned(), result);
  last_step_[worker.node()] = result.tick;
  CheckOthers(worker);
  if (totals_.steps % kStepsBetweenChecks == 0) CheckCopies();
}

void Deployment::TwoOwners(const SimulatedWorker& worker, const std::string& what) {
  if (doubled_.insert(worker.node()).second) ++totals_.two_owners;
  invariants_->Problem(worker.region()->tick(), what);
}

void Deployment::CheckOthers(SimulatedWorker& worker) {
  const region::Region& region = *worker.region();
  for (SimulatedWorker* other : Workers()) {
    if (other == &worker || !other->Moves() || before_.contains(other->node())) continue;
    if (other->identity().region == worker.identity().region) {
      TwoOwners(worker, absl::StrCat(Name(worker), " and ", Name(*other), " move at one time"));
    }
    const region::Region& its = *other->region();
    if (its.tick() != region.tick()) continue;
    for (const region::OwnedBody& body : region.owned()) {
      if (!its.Owns(body.def->id)) continue;
      invariants_->Problem(region.tick(), absl::StrCat("body ", body.def->id.value(), " is owned by ", Name(worker),
                                                       " and ", Name(*other)));
    }
  }
}

// Whoever is declared dead owns nothing any more, and may not step again.
void Deployment::TakenOver(SimulatedWorker& worker, const worker::OrderedFailover& failover) {
  for (const worker::DeadRegion& dead : failover.dead) {
    const Node node = NodeOf(dead.region, dead.incarnation);
    if (!taken_over_.insert(node).second) continue;
    if (totals_.takeovers++ == 0) totals_.first_takeover_at = around_.timeline.now();
    for (SimulatedWorker* other : Workers()) {
      if (other->node() != node || !other->Moves()) continue;
      TwoOwners(*other, absl::StrCat(Name(*other), " still moves while ", Name(worker), " takes its place"));
    }
    invariants_->Died(RegionId(node));
  }
}

void Deployment::Ending(SimulatedWorker& worker) {
  if (!Counts(worker)) ++totals_.fenced;
  invariants_->Died(LifeOf(worker));
}

void Deployment::CheckCopies() {
  std::vector<BodyId> held;
  for (SimulatedWorker* worker : Workers()) {
    if (worker->region() == nullptr || !Counts(*worker)) continue;
    for (const region::OwnedBody& body : worker->region()->owned()) held.push_back(body.def->id);
    for (const BodyId kept : region::KeptBodies(*worker->region())) held.push_back(kept);
    for (const region::StandbyCopy* copy : worker->core().run()->copies().Whole()) {
      for (const region::StateBody& body : copy->state().bodies) held.push_back(body.id);
      for (const auto& [key, grant] : copy->state().grants) held.push_back(key.first);
    }
  }
  invariants_->CheckCopies(tick(), held);
}

RegionId Deployment::OwnerOf(BodyId id) const {
  for (SimulatedWorker* worker : Workers()) {
    if (worker->region() != nullptr && Counts(*worker) && worker->region()->Owns(id)) {
      return worker->identity().region;
    }
  }
  return RegionId();
}

std::size_t Deployment::bodies() const {
  std::size_t count = 0;
  for (SimulatedWorker* worker : Workers()) {
    if (worker->region() != nullptr && Counts(*worker)) count += worker->region()->owned().size();
  }
  return count;
}

void Deployment::ExcuseAll() {
  for (const BodyId id : invariants_->expected()) invariants_->Excuse(id);
}

// Lives of the world before are stopped by their agents; what they still do is not of this one.
void Deployment::Restored() {
  for (SimulatedWorker* worker : Workers()) before_.insert(worker->node());
  problems_ = problems();
  invariants_ = std::make_unique<InvariantChecker>(*around_.scene);
  healths_.clear();
}

std::vector<std::string> Deployment::problems() const {
  std::vector<std::string> all = problems_;
  all.insert(all.end(), invariants_->problems().begin(), invariants_->problems().end());
  return all;
}

// --- Players.

std::optional<std::uint32_t> Deployment::Join(const std::string& name) {
  if (!control().alive()) return std::nullopt;
  v1::JoinInstanceRequest request;
  request.set_instance_id(id_);
  request.set_player_name(name);
  const auto joined =
      control().Call([&](control::Cluster& cluster, control::Now now) { return cluster.Join(now, request); });
  if (!joined.ok()) return std::nullopt;
  tokens_[joined->response.player()] = joined->response;
  invariants_->Spawned(PlayerBodyId(PlayerNumber(joined->response.player())));
  return joined->response.player();
}

void Deployment::Leave(std::uint32_t player) {
  if (!control().alive()) return;
  v1::LeaveInstanceRequest request;
  request.set_instance_id(id_);
  request.set_credential(tokens_.at(player).credential());
  request.set_credential_key(tokens_.at(player).credential_key());
  invariants_->Removing(PlayerBodyId(PlayerNumber(player)));
  (void)control().Call([&](control::Cluster& cluster, control::Now now) { return cluster.Leave(now, request); });
}

// --- Properties.

bool Deployment::SetHealth(BodyId body, std::int64_t health) {
  if (!control().alive()) return false;
  v1::SetPropertyRequest request;
  request.set_id(id_);
  request.set_body(body.value());
  request.mutable_property()->set_name("health");
  request.mutable_property()->set_number(health);
  const auto number =
      control().Call([&](control::Cluster& cluster, control::Now) { return cluster.SetProperty(request); });
  if (number.ok()) healths_[body].push_back({*number, health});
  return number.ok();
}

// As a caller waits for it.
void Deployment::TakeAnswers() {
  for (auto& [body, orders] : healths_) {
    for (std::size_t i = 0; i < orders.size(); ++i) {
      const std::uint64_t number = orders[i].number;
      if (orders[i].answered || orders[i].given_up) continue;
      const auto outcome = control().Call([&](control::Cluster& cluster, control::Now) {
        auto told = cluster.PropertyOutcome(id_, number);
        if (told) cluster.ForgetProperty(id_, number);
        return told;
      });
      if (!outcome) continue;
      orders[i].given_up = !outcome->ok();  // and may have been made all the same
      if (orders[i].given_up) continue;
      orders[i].answered = true;
      ++healths_answered_;
      orders.erase(orders.begin(), orders.begin() + static_cast<std::ptrdiff_t>(i));
      i = 0;
    }
  }
}

void Deployment::CheckHealths(Tick end) {
  std::map<BodyId, std::int64_t> found;
  for (SimulatedWorker* worker : Workers()) {
    for (const region::KeptRecord& entry : worker->region()->records().all()) {
      const auto changed = PropertySet::Decode(*entry.bytes, around_.scene->properties);
      if (!changed.ok()) continue;
      const auto value = ValueOf(around_.scene->properties, {}, *changed, "health");
      if (value.has_value()) found[entry.body] = std::get<std::int64_t>(*value);
    }
  }
  for (const auto& [body, orders] : healths_) {
    if (OwnerOf(body) == RegionId()) continue;  // that is told of elsewhere
    const auto has = found.find(body);
    const bool unchanged = has == found.end();
    const bool may_be_unchanged = !orders.front().answered;
    const bool ordered = !unchanged && std::ranges::any_of(orders, [&](const HealthOrder& order) {
      return order.health == has->second;
    });
    if (ordered || (unchanged && may_be_unchanged)) continue;
    invariants_->Problem(end, absl::StrCat("body ", body.value(), " has health ",
                                           unchanged ? std::string("as it began") : absl::StrCat(has->second), ", and ",
                                           orders.front().health, " was answered"));
  }
}

// --- For a person.

std::string Deployment::Standing() const {
  std::string text = absl::StrCat(
      "\n  control plane ", control().number(), " ", control().alive() ? "lives" : "is dead", ", ",
      v1::InstanceState_Name(last_seen_.state()), " ", last_seen_.reason(), ", map ", last_seen_.map().version());
  for (SimulatedWorker* worker : Workers()) {
    absl::StrAppend(&text, "\n  ", Name(*worker));
    if (!Counts(*worker)) absl::StrAppend(&text, ", fenced");
    if (worker->region() == nullptr) continue;
    const region::Region& region = *worker->region();
    absl::StrAppend(&text, ": tick ", region.tick().value(), ", map ", region.map().version().value(),
                    worker->running() ? "" : ", does not run", worker->paused() ? ", paused" : "",
                    region.halted() ? ", halted" : "", worker->Protected() ? "" : ", unprotected", ", standby ",
                    worker->order().standby.value(), ", waits for");
    for (const RegionId other : region.WaitingFor()) absl::StrAppend(&text, " ", other.value());
    const worker::DropCounts& drops = worker->core().run()->drops();
    for (std::size_t i = 0; i < drops.size(); ++i) {
      if (drops[i] > 0) absl::StrAppend(&text, "; ", std::string(worker::kDropReasonNames[i]), " x", drops[i]);
    }
  }
  for (const v1::InstanceEvent& event : last_seen_.events()) absl::StrAppend(&text, "\n  event: ", event.text());
  const auto& log = control().log();
  for (std::size_t i = log.size() > 12 ? log.size() - 12 : 0; i < log.size(); ++i)
    absl::StrAppend(&text, "\n  ", log[i]);
  return text;
}

}  // namespace tessera::simulation
