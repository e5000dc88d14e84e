// ClusterState's part in instances: how they are stored, with their players and the scenes and games that they use.
#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/life.h"
#include "control_plane/operation.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

bool SamePlaces(const records::Instance& a, const records::Instance& b) {
  return a.map().version() == b.map().version() &&
         std::equal(a.placements().begin(), a.placements().end(), b.placements().begin(), b.placements().end(),
                    [](const records::Placement& x, const records::Placement& y) {
                      return x.incarnation() == y.incarnation() && x.host_id() == y.host_id();
                    });
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

}  // namespace

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
  const auto written = WriteStored(ops);
  if (!written.ok()) return written.status();
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
  const std::vector<StoreOp> buckets = PlayerOps(instance, players);
  ops.insert(ops.end(), buckets.begin(), buckets.end());
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
  const auto written = WriteStored(ops);
  if (!written.ok()) return written.status();
  for (const StoreOp& put : missing) contents_[put.key].revision = *written;
  for (const std::string& key : added) ++contents_[key].instances;
  for (const std::string& key : released) {
    const auto use = contents_.find(key);
    if (use != contents_.end() && --use->second.instances == 0 && !keep) ForgetContent(use);
  }
  FollowPlayers(instance, players, *written);
  if (instance.record.last_player() != next.last_player()) instance.last_player = next.last_player();
  const bool placed_anew = !SamePlaces(instance.record, next);
  const std::uint64_t last_incarnation = instance.record.last_incarnation();
  const bool new_seed = instance.record.signing_seed() != next.signing_seed();
  instance.record = std::move(named.record);
  for (std::string& line : named.lines) Log(std::move(line));
  instance.told.reset();
  instance.revision = *written;
  if (new_seed) FollowSeed(instance);
  if (!placed_anew) return absl::OkStatus();
  FollowPlacements(instance);
  for (WorkerEntry& worker : instance.workers) {
    // A worker that is found to run while recovering was asked for by somebody else.
    if (worker.incarnation > last_incarnation && !recovering()) worker.asked_in = kUnasked;
  }
  return absl::OkStatus();
}

absl::Status ClusterState::StorePlayers(InstanceEntry& instance, const Players& players) {
  if (instance.told) return StoreWithPlayers(instance, instance.record, players);  // which it is over with
  const std::vector<StoreOp> ops = PlayerOps(instance, players);
  if (ops.empty()) return absl::OkStatus();
  const auto written = WriteStored(ops);
  if (!written.ok()) return written.status();
  FollowPlayers(instance, players, *written);
  return absl::OkStatus();
}

std::vector<StoreOp> ClusterState::PlayerOps(const InstanceEntry& instance, const Players& players) {
  std::vector<StoreOp> ops;
  for (const std::uint32_t index : players.BucketsUnlike(instance.players)) {
    ops.push_back(BucketOp(instance.number, index, players.bucket(index), instance.player_revisions[index]));
  }
  return ops;
}

void ClusterState::FollowPlayers(InstanceEntry& instance, const Players& players, Revision written) {
  const std::vector<std::uint32_t> buckets = players.BucketsUnlike(instance.players);
  for (const std::uint32_t index : buckets) {
    instance.player_revisions[index] = players.bucket(index) == nullptr ? kAbsent : written;
  }
  if (!buckets.empty()) instance.players = players;
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
  ++instance.connections;
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

}  // namespace tessera::control
