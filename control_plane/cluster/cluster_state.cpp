#include "control_plane/cluster/cluster_state.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "core/world/scene_visuals.h"

namespace tessera::control {
namespace {

// True if both tell the same callers from all others.
bool SameProofs(const records::Host& a, const records::Host& b) {
  return a.name() == b.name() && a.join_token_hash() == b.join_token_hash() &&
         a.join_token_expire_time().seconds() == b.join_token_expire_time().seconds() &&
         a.certificate_serial() == b.certificate_serial();
}

// From a failed write to the next one that only asks whether writing works again.
constexpr Steady kProbeAfter = std::chrono::seconds(1);

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
  instance.last_player = stored.record.last_player();
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
  const StoreOp op = PutOp(kCountersKey, next.SerializeAsString(), counters_.revision);
  const auto written = WriteStored({&op, 1});
  if (!written.ok()) return written.status();
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
  const auto written = WriteStored(ops);
  if (!written.ok()) return written.status();
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
  const StoreOp op = PutOp(HostKey(host.number), next.SerializeAsString(), host.revision);
  const auto written = WriteStored({&op, 1});
  if (!written.ok()) return written.status();
  if (!SameProofs(host.record, next)) NoteAccessChanged();
  host.record = next;
  host.revision = *written;
  return absl::OkStatus();
}

absl::Status ClusterState::RemoveHost(HostEntry& host, const absl::Status& why) {
  const StoreOp op = DeleteOp(HostKey(host.number), host.revision);
  const auto written = WriteStored({&op, 1});
  if (!written.ok()) return written.status();
  CloseStream(host, why);
  hosts_.erase(host.number);
  NoteAccessChanged();
  return absl::OkStatus();
}

absl::StatusOr<Revision> ClusterState::WriteStored(std::span<const StoreOp> ops) {
  auto written = Write(ops);
  if (!written.ok()) return absl::UnavailableError(written.status().message());
  return written;
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
  ++instance.connections;
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
