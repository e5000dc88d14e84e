// Loading, storing and the passing of time.
#include "control_plane/cluster/cluster.h"

#include <algorithm>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

constexpr char kCountersKey[] = "counters";
constexpr char kHostPrefix[] = "host/";
constexpr char kInstancePrefix[] = "instance/";
constexpr char kScenePrefix[] = "scene/";

// Orders' revisions: 2^32 changes in each of 2^31 lives.
constexpr int kLifeShift = 32;

absl::Status Damaged(const std::string& key) {
  return absl::DataLossError(absl::StrCat("store: ", key, ": cannot be read"));
}

}  // namespace

std::uint64_t NumberOf(std::string_view id, std::string_view prefix) {
  std::uint64_t number = 0;
  if (!id.starts_with(prefix)) return 0;
  const std::string digits(id.substr(prefix.size()));
  // The same id in one spelling only: "host-07" and "host-+7" are not host-7.
  return absl::SimpleAtoi(digits, &number) && absl::StrCat(number) == digits ? number : 0;
}

std::string SceneKey(std::string_view hash) { return kScenePrefix + std::string(hash); }

absl::StatusOr<std::unique_ptr<Cluster>> Cluster::Load(Store& store, const Settings& settings, RandomBytes random,
                                                       Moment now) {
  std::unique_ptr<Cluster> cluster(new Cluster(store, settings, std::move(random)));
  if (absl::Status status = cluster->LoadAll(now); !status.ok()) return status;
  return cluster;
}

absl::Status Cluster::LoadAll(Moment now) {
  if (absl::Status status = LoadCounters(); !status.ok()) return status;
  if (absl::Status status = LoadHosts(now); !status.ok()) return status;
  if (absl::Status status = LoadInstances(now); !status.ok()) return status;
  if (absl::Status status = LoadScenes(); !status.ok()) return status;
  effects_.log.push_back(
      absl::StrCat("loaded hosts=", hosts_.size(), " instances=", instances_.size(), " life=", counters_.lives()));
  return absl::OkStatus();
}

absl::Status Cluster::LoadCounters() {
  const absl::StatusOr<Entry> entry = store_.Get(kCountersKey);
  if (entry.ok()) {
    if (!counters_.ParseFromString(entry->value)) return Damaged(kCountersKey);
    counters_revision_ = entry->revision;
  } else if (entry.status().code() != absl::StatusCode::kNotFound) {
    return entry.status();
  }
  counters_.set_lives(counters_.lives() + 1);
  last_revision_ = counters_.lives() << kLifeShift;
  const auto stored = store_.Put(kCountersKey, counters_.SerializeAsString(), counters_revision_);
  if (!stored.ok()) return stored.status();
  counters_revision_ = *stored;
  return absl::OkStatus();
}

absl::Status Cluster::LoadHosts(Moment now) {
  const auto entries = store_.List(kHostPrefix);
  if (!entries.ok()) return entries.status();
  for (const Entry& entry : *entries) {
    HostEntry host;
    if (!host.record.ParseFromString(entry.value)) return Damaged(entry.key);
    host.number = NumberOf(entry.key, kHostPrefix);
    host.revision = entry.revision;
    host.last_heard = now.steady;  // nobody is declared lost before there was time to be heard
    hosts_.emplace(host.number, std::move(host));
  }
  return absl::OkStatus();
}

absl::Status Cluster::LoadInstances(Moment now) {
  const auto entries = store_.List(kInstancePrefix);
  if (!entries.ok()) return entries.status();
  for (const Entry& entry : *entries) {
    records::Instance record;
    if (!record.ParseFromString(entry.value) || !FromProto(record.map()).ok()) return Damaged(entry.key);
    Adopt(now, NumberOf(entry.key, kInstancePrefix), record, entry.revision);
  }
  return absl::OkStatus();
}

absl::Status Cluster::LoadScenes() {
  const auto entries = store_.List(kScenePrefix);
  if (!entries.ok()) return entries.status();
  for (const Entry& entry : *entries) {
    const auto use = scenes_.find(entry.key.substr(sizeof(kScenePrefix) - 1));
    if (use == scenes_.end()) continue;
    use->second.revision = entry.revision;
    if (absl::Status status = TakeProperties(use->first, entry.value); !status.ok()) return status;
  }
  return absl::OkStatus();
}

// A control plane that knew of no properties kept what a scene says of them, unread; its workers may be replaced by
// some that know them.
absl::Status Cluster::TakeProperties(const std::string& scene_hash, const std::string& scene_bytes) {
  for (auto& [number, instance] : instances_) {
    if (instance.record.properties_taken() || instance.record.scene_hash() != scene_hash) continue;
    records::Instance next = instance.record;
    if (v1::Scene scene; scene.ParseFromString(scene_bytes)) *next.mutable_properties() = scene.properties();
    next.set_properties_taken(true);
    if (absl::Status status = StoreInstance(instance, next); !status.ok()) return status;
  }
  return absl::OkStatus();
}

InstanceEntry& Cluster::Adopt(Moment now, std::uint64_t number, const records::Instance& record, Revision revision) {
  InstanceEntry& instance = instances_[number];
  instance.number = number;
  instance.record = record;
  instance.revision = revision;
  const auto age = [&](const google::protobuf::Timestamp& since) {
    return std::max(now.unix_time - FromTimestamp(since),
                    std::chrono::nanoseconds(0));  // the wall clock may have been set back
  };
  instance.start_deadline =
      now.steady + std::chrono::milliseconds(record.start_deadline_ms()) - age(record.create_time());
  instance.state_since = IsFinal(record.state()) ? now.steady - age(record.end_time()) : now.steady;
  Assign(instance);
  WatchFailover(now, instance, record);
  if (!record.request_id().empty()) request_ids_[record.request_id()] = number;
  if (!IsFinal(record.state())) ++scenes_[record.scene_hash()].instances;
  return instance;
}

// Workers and hosts' lists follow the record's placements; what is known of a worker stays.
void Cluster::Assign(InstanceEntry& instance) {
  for (auto& [number, host] : hosts_) {
    if (std::erase_if(host.workers, [&](const auto& worker) { return worker.first == instance.number; }) > 0) {
      MarkDesired(host);
    }
  }
  std::map<std::uint64_t, WorkerEntry> known;  // by incarnation
  for (WorkerEntry& worker : instance.workers) known.emplace(worker.incarnation, std::move(worker));
  instance.map = *FromProto(instance.record.map());  // checked when it was loaded or made
  instance.workers.clear();
  for (const records::Placement& placement : instance.record.placements()) {
    WorkerEntry& worker = instance.workers.emplace_back();
    const auto host = hosts_.find(NumberOf(placement.host_id(), "host-"));
    if (const auto old = known.find(placement.incarnation()); old != known.end()) worker = std::move(old->second);
    worker.region = placement.region();
    worker.incarnation = placement.incarnation();
    worker.gone = worker.gone || instance.record.state() == v1::INSTANCE_STATE_ENDED || host == hosts_.end();
    if (!worker.gone) host->second.workers.emplace(instance.number, instance.workers.size() - 1);
  }
}

absl::Status Cluster::StoreHost(HostEntry& host, const records::Host& next) {
  const auto stored = store_.Put(absl::StrCat(kHostPrefix, host.number), next.SerializeAsString(), host.revision);
  if (!stored.ok()) return absl::UnavailableError(stored.status().message());
  host.record = next;
  host.revision = *stored;
  return absl::OkStatus();
}

absl::Status Cluster::StoreInstance(InstanceEntry& instance, const records::Instance& next) {
  std::vector<StoreOp> ops{
      PutOp(absl::StrCat(kInstancePrefix, instance.number), next.SerializeAsString(), instance.revision)};
  const bool ends = IsFinal(next.state()) && !IsFinal(instance.record.state());
  const auto scene = scenes_.find(next.scene_hash());
  const bool last_use = ends && scene != scenes_.end() && scene->second.instances == 1;
  if (last_use) ops.push_back(DeleteOp(SceneKey(next.scene_hash()), scene->second.revision));
  const auto stored = store_.Txn(ops);
  if (!stored.ok()) return absl::UnavailableError(stored.status().message());
  if (last_use) {
    scenes_.erase(scene);
  } else if (ends && scene != scenes_.end()) {
    --scene->second.instances;
  }
  instance.record = next;
  instance.revision = *stored;
  return absl::OkStatus();
}

// Whoever stood still itself has heard nobody: that is no silence of theirs. Noted before anything is made of what came
// meanwhile, of which the first may be old.
void Cluster::NoteTime(Moment now) {
  const Steady paused = last_call_.count() == 0 ? Steady(0) : now.steady - last_call_;
  last_call_ = now.steady;
  if (paused <= kOwnPause) return;
  const auto later = [&](Steady& time) { time = std::min(now.steady, time + paused); };
  for (auto& [number, host] : hosts_) later(host.last_heard);
  for (auto& [number, instance] : instances_) {
    for (WorkerEntry& worker : instance.workers) later(worker.witnessed_at);
  }
}

void Cluster::HandleTimer(Moment now) {
  NoteTime(now);
  for (auto& [number, host] : hosts_) {
    const bool admitted = !host.record.secret_hash().empty();
    if (admitted && !host.lost && now.steady - host.last_heard > settings_.lost_after) MarkLost(now, host);
  }
  for (auto& [number, instance] : instances_) {
    if (!IsFinal(instance.record.state())) {
      Reconcile(now, instance);
      if (!instance.restore_wanted.empty() && now.steady >= instance.change_after) {  // it could not be stored
        instance.change_after = now.steady + kChangeRetry;
        effects_.restore.insert(instance.record.id());
      }
      PrunePlayers(now, instance);
      StepCheckpoint(now, instance);
    }
    const v1::InstanceState state = instance.record.state();
    const bool stopping = state == v1::INSTANCE_STATE_STOPPING || state == v1::INSTANCE_STATE_FAILED;
    if (stopping && !instance.withdrawn && now.steady - instance.state_since > settings_.stop_grace) {
      instance.withdrawn = true;
      MarkOrders(instance);
    }
  }
  ForgetEnded(now);
}

void Cluster::ForgetEnded(Moment now) {
  std::vector<std::pair<Steady, std::uint64_t>> ended;  // oldest first
  for (const auto& [number, instance] : instances_) {
    const bool quiet =
        std::all_of(instance.workers.begin(), instance.workers.end(), [](const auto& worker) { return worker.gone; });
    // What can be brought back from a checkpoint goes only when somebody deletes it.
    const bool restorable =
        instance.record.state() == v1::INSTANCE_STATE_FAILED && !instance.record.checkpoints().empty();
    if (IsFinal(instance.record.state()) && quiet && !restorable) ended.emplace_back(instance.state_since, number);
  }
  std::sort(ended.begin(), ended.end());
  std::size_t kept = ended.size();
  for (const auto& [since, number] : ended) {
    if (kept <= kMaxEndedInstances && now.steady - since <= settings_.keep_ended) break;
    const auto instance = instances_.find(number);
    const auto deleted = store_.Delete(absl::StrCat(kInstancePrefix, number), instance->second.revision);
    if (!deleted.ok()) {
      NoteTrouble(instance->second, "instance cannot be forgotten for now", deleted.status());
      return;
    }
    effects_.instances.insert(instance->second.record.id());
    effects_.forgotten.push_back(instance->second.record.id());
    request_ids_.erase(instance->second.record.request_id());
    instances_.erase(instance);
    --kept;
  }
}

Census Cluster::Count() const {
  Census census;
  for (const auto& [number, host] : hosts_) ++census.hosts[StateOf(host)];
  for (const auto& [number, instance] : instances_) {
    ++census.instances[ShownState(instance)];
    if (instance.record.state() != v1::INSTANCE_STATE_RUNNING) continue;
    const v1::Instance view = View(instance, true);
    Census::Health& health = census.health.emplace_back();
    health.id = view.id();
    health.unprotected = view.unprotected_regions_size();
    if (!view.checkpoints().empty()) health.last_checkpoint = FromTimestamp(view.checkpoints().rbegin()->create_time());
    health.imbalance = view.imbalance();
    health.lost_bodies = view.lost_bodies();
    health.lost_ticks = view.lost_ticks();
    health.checkpoints_expected = instance.record.checkpoint_interval_ms() > 0;
  }
  return census;
}

std::vector<ScrapeTarget> Cluster::ScrapeTargets() const {
  std::vector<ScrapeTarget> targets;
  for (const auto& [number, host] : hosts_) {
    if (host.record.secret_hash().empty() || host.record.metrics_port() == 0) continue;
    targets.push_back(
        {absl::StrCat(host.record.advertise_address(), ":", host.record.metrics_port()), host.record.name(), "", 0});
  }
  for (const auto& [number, instance] : instances_) {
    for (std::size_t i = 0; i < instance.workers.size(); ++i) {
      const WorkerEntry& worker = instance.workers[i];
      if (!worker.bound() || worker.report.address().metrics_port() == 0) continue;
      const auto host = hosts_.find(NumberOf(instance.record.placements(static_cast<int>(i)).host_id(), "host-"));
      targets.push_back({absl::StrCat(worker.report.address().host(), ":", worker.report.address().metrics_port()),
                         host == hosts_.end() ? "" : host->second.record.name(), instance.record.id(), worker.region});
    }
  }
  return targets;
}

}  // namespace tessera::control
