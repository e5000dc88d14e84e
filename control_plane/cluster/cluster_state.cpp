#include "control_plane/cluster/cluster_state.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "control_plane/operation.h"
#include "core/world/partition_io.h"
#include "core/world/scene_visuals.h"

namespace tessera::control {
namespace {

bool SamePlaces(const records::Instance& a, const records::Instance& b) {
  return a.map().version() == b.map().version() &&
         std::equal(a.placements().begin(), a.placements().end(), b.placements().begin(), b.placements().end(),
                    [](const records::Placement& x, const records::Placement& y) {
                      return x.incarnation() == y.incarnation() && x.host_id() == y.host_id();
                    });
}

// True if both tell the same callers from all others.
bool SameProofs(const records::Host& a, const records::Host& b) {
  return a.name() == b.name() && a.join_token_hash() == b.join_token_hash() &&
         a.join_token_expire_time().seconds() == b.join_token_expire_time().seconds() &&
         a.certificate_serial() == b.certificate_serial();
}

std::vector<std::string> Without(std::vector<std::string> keys, const std::vector<std::string>& those) {
  std::erase_if(keys,
                [&](const std::string& key) { return std::find(those.begin(), those.end(), key) != those.end(); });
  return keys;
}

// A bucket that differs from the one before it, of that revision; null: it is empty now.
StoreOp BucketOp(std::uint64_t instance, std::uint32_t index, const records::PlayerBucket* bucket, Revision before) {
  if (bucket == nullptr) return DeleteOp(PlayersKey(instance, index), before);
  return PutOp(PlayersKey(instance, index), bucket->SerializeAsString(), before);
}

// From a failed write to the next one that only asks whether writing works again.
constexpr Steady kProbeAfter = std::chrono::seconds(1);

absl::Status NotWritten(const absl::Status& status) { return absl::UnavailableError(status.message()); }

}  // namespace

// --- Loading.

absl::StatusOr<std::unique_ptr<ClusterState>> ClusterState::Load(Store& store, bool drop_set_aside) {
  auto stored = ReadRecords(store);
  if (!stored.ok()) return stored.status();
  std::unique_ptr<ClusterState> state(new ClusterState(store));
  state->counters_ = std::move(stored->counters);
  if (absl::Status status = state->BeginLife(stored->unreadable); !status.ok()) return status;
  if (absl::Status status = state->LoadSetAside(stored->unreadable, drop_set_aside); !status.ok()) return status;
  for (auto& host : stored->hosts) {
    HostEntry& entry = state->hosts_[host.number];
    entry.number = host.number;
    entry.record = std::move(host.record);
    entry.revision = host.revision;
  }
  for (const auto& instance : stored->instances) {
    state->Adopt(instance);
    InstanceEntry& entry = state->instance(instance.number);
    if (absl::Status status = state->AdoptPlayers(entry, std::move(stored->players[instance.number])); !status.ok()) {
      return status;
    }
  }
  // While something is set aside, it may be a scene whose pieces they are.
  if (state->set_aside_.empty()) state->effects_.scene_pieces = std::move(stored->stray_pieces);
  for (const auto& [key, content] : stored->contents) {
    if (absl::Status status = state->AdoptContent(key, content); !status.ok()) return status;
  }
  state->Log(absl::StrCat("loaded hosts=", state->hosts_.size(), " instances=", state->instances_.size(),
                          " life=", state->counters_.record.lives()));
  return state;
}

// Agents would end the workers of an instance that is set aside, and expel players of a bucket that is: nothing is
// ordered before they have said what they run.
absl::Status ClusterState::BeginLife(const std::vector<StoreEntry>& unreadable) {
  counters_.record.set_lives(counters_.record.lives() + 1);
  last_revision_ = counters_.record.lives() << kLifeShift;
  const bool lacks = std::any_of(unreadable.begin(), unreadable.end(), [](const StoreEntry& entry) {
    return InstanceOfKey(entry.key) != 0 || InstanceOfPlayersKey(entry.key) != 0;
  });
  if (lacks && !counters_.record.recovering()) {
    counters_.record.set_recovering(true);
    counters_.record.set_recovers_unreadable(true);
  }
  const auto written = WriteCounters();
  if (!written.ok()) return written.status();
  counters_.revision = *written;
  return absl::OkStatus();
}

void ClusterState::Adopt(const StoredRecord<records::Instance>& stored) {
  InstanceEntry& instance = instances_[stored.number];
  instance.number = stored.number;
  instance.record = stored.record;
  instance.revision = stored.revision;
  FollowSeed(instance);
  FollowPlacements(instance);
  if (!stored.record.request_id().empty()) request_ids_[stored.record.request_id()] = stored.number;
  if (IsFinal(stored.record.state())) return;
  for (const std::string& key : ContentKeys(stored.record)) ++contents_[key].instances;
}

// Releases before this one kept the players in the record itself.
absl::Status ClusterState::AdoptPlayers(InstanceEntry& instance, StoredPlayers stored) {
  instance.players = std::move(stored.players);
  instance.player_revisions = stored.revisions;
  if (instance.record.players().empty()) return absl::OkStatus();
  const auto& unseen = instance.record.unseen_players();
  Players players;
  for (const v1::Player& player : instance.record.players()) {
    records::StoredPlayer known;
    *known.mutable_player() = player;
    known.set_unseen(std::find(unseen.begin(), unseen.end(), player.number()) != unseen.end());
    players.Put(std::move(known));
  }
  records::Instance next = instance.record;
  next.clear_players();
  next.clear_unseen_players();
  return StoreWithPlayers(instance, next, players);
}

// With a seed that is none, what the instance signs verifies nowhere.
void ClusterState::FollowSeed(InstanceEntry& instance) {
  instance.key = net::SigningKey::FromSeed(instance.record.signing_seed(), "signing_seed").value_or(net::SigningKey());
}

// A control plane that knew of no properties, or of no files of meshes, kept the scene's, unread; its workers may be
// replaced by some that know them.
absl::Status ClusterState::AdoptContent(const std::string& key, const StoredContent& content) {
  // While something is set aside, it may need what nobody else does.
  if (set_aside_.empty() && !contents_.contains(key) && content.pieces) return DropStray(key, content);
  ContentUse& use = contents_[key];
  use.revision = content.revision;
  use.pieces = content.pieces;
  if (use.instances == 0 || !IsSceneKey(key)) return absl::OkStatus();
  for (InstanceEntry& instance : EachInstance()) {
    const bool taken = instance.record.properties_taken() && instance.record.world_properties_taken() &&
                       instance.record.visuals_taken();
    if (taken || SceneKey(instance.record.scene_hash()) != key) continue;
    records::Instance next = instance.record;
    if (v1::Scene read; read.ParseFromString(content.bytes)) {
      *next.mutable_properties() = read.properties();
      *next.mutable_world_properties() = read.instance_properties();
      const std::vector<std::string> visuals = VisualFiles(read);
      *next.mutable_visuals() = {visuals.begin(), visuals.end()};
    }
    next.set_properties_taken(true);
    next.set_world_properties_taken(true);
    next.set_visuals_taken(true);
    if (absl::Status status = StoreInstance(instance, next); !status.ok()) return status;
  }
  return absl::OkStatus();
}

std::unique_ptr<const ClusterState> ClusterState::Picture() const {
  return std::unique_ptr<const ClusterState>(new ClusterState(*this));
}

// --- Access.

const HostEntry* ClusterState::FindHost(std::string_view id) const {
  const auto found = hosts_.find(NumberOf(id, kHostId));
  return found == hosts_.end() ? nullptr : &found->second;
}

HostEntry* ClusterState::FindHost(std::string_view id) {
  return const_cast<HostEntry*>(std::as_const(*this).FindHost(id));
}

HostEntry* ClusterState::HostOf(StreamId stream) {
  const auto found = streams_.find(stream);
  return found == streams_.end() ? nullptr : &hosts_.at(found->second);
}

const InstanceEntry* ClusterState::FindInstance(std::string_view id) const {
  const auto found = instances_.find(NumberOf(id, kInstanceId));
  return found == instances_.end() ? nullptr : &found->second;
}

InstanceEntry* ClusterState::FindInstance(std::string_view id) {
  return const_cast<InstanceEntry*>(std::as_const(*this).FindInstance(id));
}

const InstanceEntry* ClusterState::FindByRequestId(const std::string& request_id) const {
  const auto found = request_ids_.find(request_id);
  return request_id.empty() || found == request_ids_.end() ? nullptr : &instances_.at(found->second);
}

// --- Writing.

absl::StatusOr<Revision> ClusterState::Write(std::span<const StoreOp> ops) {
  auto written = store_.Txn(ops);
  const std::string why = written.ok() ? "" : std::string(written.status().message());
  if (!written.ok()) ++failed_writes_;
  if (why.empty() != store_trouble_.empty()) {
    if (why.empty()) {
      Log("store can be written again");
    } else {
      Log(absl::StrCat("store cannot be written, nothing that dies is replaced: ", why), Severity::kError);
    }
    probe_at_ = Steady(0);
  }
  store_trouble_ = why;
  return written;
}

absl::StatusOr<Revision> ClusterState::WriteOne(const StoreOp& op) { return Write({&op, 1}); }

absl::StatusOr<Revision> ClusterState::WriteCounters() {
  return WriteOne(PutOp(kCountersKey, counters_.record.SerializeAsString(), counters_.revision));
}

absl::Status ClusterState::EndRecovery() {
  records::Counters next = counters_.record;
  next.set_recovering(false);
  next.set_recovers_unreadable(false);
  next.set_restored_again(false);
  const auto written = WriteOne(PutOp(kCountersKey, next.SerializeAsString(), counters_.revision));
  if (!written.ok()) return NotWritten(written.status());
  counters_.record = next;
  counters_.revision = *written;
  return absl::OkStatus();
}

void ClusterState::ProbeStore(Now now) {
  if (store_trouble_.empty()) return;
  if (probe_at_ == Steady(0)) probe_at_ = now.steady + kProbeAfter;
  if (now.steady < probe_at_) return;
  probe_at_ = now.steady + kProbeAfter;
  if (const auto written = WriteCounters(); written.ok()) counters_.revision = *written;
}

void ClusterState::SetCheckpointTrouble(const std::string& why) {
  if (why.empty() && !checkpoint_trouble_.empty()) Log("checkpoints are made again");
  if (!why.empty() && checkpoint_trouble_.empty()) Log(absl::StrCat("checkpoints stopped: ", why), Severity::kError);
  checkpoint_trouble_ = why;
}

absl::StatusOr<HostEntry*> ClusterState::AddHost(records::Host record) {
  records::Counters counters = counters_.record;
  const std::uint64_t number = counters.last_host() + 1;
  counters.set_last_host(number);
  record.set_id(absl::StrCat(kHostId, number));
  const StoreOp ops[] = {PutOp(kCountersKey, counters.SerializeAsString(), counters_.revision),
                         PutOp(HostKey(number), record.SerializeAsString(), kAbsent)};
  const auto written = Write(ops);
  if (!written.ok()) return NotWritten(written.status());
  counters_.record = counters;
  counters_.revision = *written;
  HostEntry& host = hosts_[number];
  host.number = number;
  host.record = std::move(record);
  host.revision = *written;
  NoteAccessChanged();
  return &host;
}

absl::Status ClusterState::StoreHost(HostEntry& host, const records::Host& next) {
  const auto written = WriteOne(PutOp(HostKey(host.number), next.SerializeAsString(), host.revision));
  if (!written.ok()) return NotWritten(written.status());
  if (!SameProofs(host.record, next)) NoteAccessChanged();
  host.record = next;
  host.revision = *written;
  return absl::OkStatus();
}

absl::Status ClusterState::RemoveHost(HostEntry& host, const absl::Status& why) {
  const auto written = WriteOne(DeleteOp(HostKey(host.number), host.revision));
  if (!written.ok()) return NotWritten(written.status());
  CloseStream(host, why);
  hosts_.erase(host.number);
  NoteAccessChanged();
  return absl::OkStatus();
}

absl::StatusOr<InstanceEntry*> ClusterState::AddInstance(records::Instance record, const Contents& contents) {
  records::Counters counters = counters_.record;
  const std::uint64_t number = counters.last_instance() + 1;
  counters.set_last_instance(number);
  record.set_id(absl::StrCat(kInstanceId, number));
  record.set_operation(absl::StrCat(counters.lives(), "-", ++operations_));
  std::vector<StoreOp> ops{PutOp(kCountersKey, counters.SerializeAsString(), counters_.revision),
                           PutOp(InstanceKey(number), record.SerializeAsString(), kAbsent)};
  const std::vector<StoreOp> missing = PutMissing(record, contents);
  ops.insert(ops.end(), missing.begin(), missing.end());
  const auto written = Write(ops);
  if (!written.ok()) return NotWritten(written.status());
  counters_.record = counters;
  counters_.revision = *written;
  for (const StoreOp& put : missing) contents_[put.key].revision = *written;
  Adopt({number, std::move(record), *written});
  return &instances_.at(number);
}

absl::Status ClusterState::StoreInstance(InstanceEntry& instance, const records::Instance& next,
                                         const Contents& contents) {
  return StoreWithPlayers(instance, next, instance.players, contents);
}

absl::Status ClusterState::StoreWithPlayers(InstanceEntry& instance, const records::Instance& next,
                                            const Players& players, const Contents& contents) {
  NamedRecord named =
      NameOperation(instance.record, next, absl::StrCat(counters_.record.lives(), "-", operations_ + 1));
  if (named.begins) ++operations_;
  std::vector<StoreOp> ops{PutOp(InstanceKey(instance.number), named.record.SerializeAsString(), instance.revision)};
  const std::vector<std::uint32_t> buckets = players.BucketsUnlike(instance.players);
  for (const std::uint32_t index : buckets) {
    ops.push_back(BucketOp(instance.number, index, players.bucket(index), instance.player_revisions[index]));
  }
  // An instance that had ended uses none; ReuseContents counts what it needs again.
  const bool used = !IsFinal(instance.record.state()), uses = !IsFinal(next.state());
  const bool keep = !set_aside_.empty();  // one that is set aside may use them
  const std::vector<std::string> before = used ? ContentKeys(instance.record) : std::vector<std::string>();
  const std::vector<std::string> after = used && uses ? ContentKeys(next) : std::vector<std::string>();
  const std::vector<std::string> released = Without(before, after), added = Without(after, before);
  std::vector<StoreOp> missing;
  // With a scene at hand, also one that uses it already and that the store has lost.
  if (!added.empty() || (uses && !contents.scene.empty())) missing = PutMissing(next, contents);
  ops.insert(ops.end(), missing.begin(), missing.end());
  for (const std::string& key : released) {
    const auto use = contents_.find(key);
    const bool there = use != contents_.end() && use->second.revision != kAbsent;
    const bool last = there && use->second.instances == 1;
    if (last && !keep) ops.push_back(DeleteOp(key, use->second.revision));
  }
  const auto written = Write(ops);
  if (!written.ok()) return NotWritten(written.status());
  for (const StoreOp& put : missing) contents_[put.key].revision = *written;
  for (const std::string& key : added) ++contents_[key].instances;
  for (const std::string& key : released) {
    const auto use = contents_.find(key);
    if (use != contents_.end() && --use->second.instances == 0 && !keep) ForgetContent(use);
  }
  for (const std::uint32_t index : buckets) {
    instance.player_revisions[index] = players.bucket(index) == nullptr ? kAbsent : *written;
  }
  if (!buckets.empty()) instance.players = players;
  const bool placed_anew = !SamePlaces(instance.record, next);
  const bool new_seed = instance.record.signing_seed() != next.signing_seed();
  instance.record = std::move(named.record);
  for (std::string& line : named.lines) Log(std::move(line));
  instance.told.reset();
  instance.revision = *written;
  if (new_seed) FollowSeed(instance);
  if (placed_anew) FollowPlacements(instance);
  return absl::OkStatus();
}

absl::Status ClusterState::RemoveInstance(const InstanceEntry& instance) {
  std::vector<StoreOp> ops{DeleteOp(InstanceKey(instance.number), instance.revision)};
  for (std::uint32_t index = 0; index < Players::kBuckets; ++index) {
    const Revision revision = instance.player_revisions[index];
    if (revision != kAbsent) ops.push_back(DeleteOp(PlayersKey(instance.number, index), revision));
  }
  const auto written = Write(ops);
  if (!written.ok()) return written.status();
  request_ids_.erase(instance.record.request_id());
  instances_.erase(instance.number);
  return absl::OkStatus();
}

absl::StatusOr<Revision> ClusterState::WriteStored(std::span<const StoreOp> ops) {
  auto written = Write(ops);
  if (!written.ok()) return NotWritten(written.status());
  return written;
}

// Workers and hosts' lists follow the record's placements; what is known of a worker stays.
void ClusterState::FollowPlacements(InstanceEntry& instance) {
  for (HostEntry& host : EachHost()) {
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
    HostEntry* host = FindHost(placement.host_id());
    if (const auto old = known.find(placement.incarnation()); old != known.end()) worker = std::move(old->second);
    worker.region = placement.region();
    worker.incarnation = placement.incarnation();
    worker.evicted = worker.evicted || (host == nullptr && !worker.gone);
    worker.gone = worker.gone || instance.record.state() == v1::INSTANCE_STATE_ENDED || host == nullptr;
    if (!worker.gone) host->workers.emplace(instance.number, instance.workers.size() - 1);
  }
}

// --- Agents' streams.

StreamId ClusterState::OpenStream(HostEntry& host, const absl::Status& why) {
  CloseStream(host, why);
  host.stream = ++last_stream_;
  host.clock_ahead_s.reset();
  streams_[host.stream] = host.number;
  return host.stream;
}

void ClusterState::CloseStream(HostEntry& host, const absl::Status& why) {
  if (host.stream == 0) return;
  effects_.closed[host.stream] = why;
  ForgetStream(host);
}

void ClusterState::ForgetStream(HostEntry& host) {
  streams_.erase(host.stream);
  host.stream = 0;
}

// --- What follows from a change.

void ClusterState::SetGone(InstanceEntry& instance, WorkerEntry& worker, std::string ending) {
  if (worker.gone) return;
  worker.gone = true;
  worker.ending = std::move(ending);
  const auto index = static_cast<std::size_t>(&worker - instance.workers.data());
  if (HostEntry* host = HostAt(*this, instance, index)) {
    host->workers.erase({instance.number, index});
    MarkDesired(*host);
  }
  MarkChanged(instance);
}

void ClusterState::MarkDesired(HostEntry& host) {
  host.desired_changed = true;
  if (host.stream != 0) effects_.desired.insert(host.stream);
}

void ClusterState::MarkOrders(InstanceEntry& instance) {
  for (std::size_t i = 0; i < instance.workers.size(); ++i) {
    if (instance.workers[i].gone) continue;
    if (HostEntry* host = HostAt(*this, instance, i)) MarkDesired(*host);
  }
}

void ClusterState::MarkChanged(const InstanceEntry& instance) { effects_.instances.insert(instance.record.id()); }

// --- Free functions.

const HostEntry* HostAt(const ClusterState& state, const InstanceEntry& instance, std::size_t index) {
  return state.FindHost(instance.record.placements(static_cast<int>(index)).host_id());
}

HostEntry* HostAt(ClusterState& state, const InstanceEntry& instance, std::size_t index) {
  return state.FindHost(instance.record.placements(static_cast<int>(index)).host_id());
}

void LogTrouble(ClusterState& state, InstanceEntry& instance, const char* what, const absl::Status& status) {
  if (std::exchange(instance.trouble, std::string(status.message())) == status.message()) return;
  state.Log(
      absl::StrCat(what, " id=", instance.record.id(), " op=", instance.record.operation(), ": ", status.message()),
      Severity::kWarning);
}

FoundWorker FindWorker(ClusterState& state, const HostEntry& host, const v1::WorkerIdentity& identity) {
  InstanceEntry* instance = state.FindInstance(identity.instance_id());
  if (instance == nullptr) return {};
  for (std::size_t i = 0; i < instance->workers.size(); ++i) {
    const records::Placement& placement = instance->record.placements(static_cast<int>(i));
    if (placement.region() == identity.region() && placement.incarnation() == identity.incarnation() &&
        placement.host_id() == host.record.id()) {
      return {instance, &instance->workers[i]};
    }
  }
  return {};
}

absl::Status NoInstance(const char* field, const std::string& id) {
  return absl::NotFoundError(absl::StrCat(field, ": no instance ", OneLine(id, kMaxNameBytes)));
}

absl::StatusOr<InstanceEntry*> FindRunning(ClusterState& state, const std::string& id) {
  InstanceEntry* instance = state.FindInstance(id);
  if (instance == nullptr) return NoInstance("id", id);
  if (instance->record.state() != v1::INSTANCE_STATE_RUNNING) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", instance->record.id(), " does not run"));
  }
  return instance;
}

}  // namespace tessera::control
