#include "tests/simulation/simulated_store.h"

#include "control_plane/backup.h"

namespace tessera::simulation {
namespace {

// As control_plane/etcd/etcd_fence.h has them.
constexpr Micros kWritePatience = Milliseconds(2000), kSettlePatience = Milliseconds(4000);

}  // namespace

// --- Election.

std::int64_t SimulatedStore::Campaign(std::uint32_t control) {
  if (token() != 0 || full_) return 0;
  leader_ = control;
  lease_until_ = timeline_.now() + kElectionTtl;
  ++elections_;
  return ++token_;
}

bool SimulatedStore::Renew(std::int64_t held) {
  if (token() != held) return false;
  lease_until_ = timeline_.now() + kElectionTtl;
  return true;
}

void SimulatedStore::Resign(std::int64_t held) {
  if (token_ == held) lease_until_ = 0;
}

void SimulatedStore::LoseAnswer(bool carried_out, Micros found_out_after) {
  lost_answer_ = {.next = true, .carried_out = carried_out, .found_out_after = found_out_after};
}

// --- Backups.

std::string SimulatedStore::Backup() const {
  std::string file;
  (void)control::WriteBackup(kept_, [&file](std::string_view piece) {  // neither the store nor this fails
    file.append(piece);
    return absl::OkStatus();
  });
  return file;
}

bool SimulatedStore::BeginFrom(const std::string& backup) {
  lease_until_ = 0;
  lost_answer_ = {};
  std::vector<control::StoreOp> all;
  const auto stored = kept_.List("");
  for (const control::StoreEntry& entry : *stored) all.push_back(control::DeleteOp(entry.key, entry.revision));
  // Each restore draws ids of its own, the same in every run of a seed.
  const auto drawn = [number = ++restores_](std::size_t n) {
    std::string bytes(n, '\0');
    bytes[1] = static_cast<char>(number);
    return bytes;
  };
  return kept_.Txn(all).ok() && control::RestoreBackup(backup, kept_, drawn).ok();
}

// --- One control plane's way to it.

void StoreClient::Begin(std::int64_t token) {
  token_ = token;
  lost_ = dead_ = false;
  writes_left_ = 0;
  writing_for_ = 0;
}

absl::StatusOr<control::StoreEntry> StoreClient::Get(std::string_view key) const {
  if (!reaches()) return absl::UnavailableError("store: no member of etcd answers");
  return shared_.kept_.Get(key);
}

absl::StatusOr<std::vector<control::StoreEntry>> StoreClient::ListWithout(std::string_view prefix,
                                                                          std::string_view without) const {
  if (!reaches()) return absl::UnavailableError("store: no member of etcd answers");
  return shared_.kept_.ListWithout(prefix, without);
}

absl::StatusOr<control::Revision> StoreClient::Txn(std::span<const control::StoreOp> ops) {
  if (dead_) return absl::UnavailableError("dead");
  if (lost_) return absl::FailedPreconditionError("store: this control plane no longer leads");
  writing_for_ += shared_.write_time_;
  if (!reaches()) {
    writing_for_ += kSettlePatience;
    return Lose(absl::UnavailableError("store: it is not known whether a write took effect"));
  }
  if (token_ != 0 && shared_.token() != token_) {
    return Lose(absl::FailedPreconditionError("store: this control plane no longer leads"));
  }
  if (shared_.full_) return absl::UnavailableError("the disk is full");
  if (writes_left_ > 0) dead_ = --writes_left_ == 0;
  if (dead_ && last_is_lost_) return absl::UnavailableError("dead");
  if (std::exchange(shared_.lost_answer_.next, false)) return WriteUnanswered(ops);
  return shared_.kept_.Txn(ops);
}

// As EtcdStore has it: a barrier says what became of the write, and one that is void is written anew.
absl::StatusOr<control::Revision> StoreClient::WriteUnanswered(std::span<const control::StoreOp> ops) {
  const bool carried_out = shared_.lost_answer_.carried_out;
  const Micros found_out_after = shared_.lost_answer_.found_out_after;
  if (found_out_after <= kSettlePatience) {
    writing_for_ += found_out_after + (carried_out ? 0 : shared_.write_time_);
    return shared_.kept_.Txn(ops);
  }
  writing_for_ += kWritePatience + kSettlePatience;
  if (carried_out) (void)shared_.kept_.Txn(ops);  // nobody learns of it
  return Lose(absl::UnavailableError("store: it is not known whether a write took effect"));
}

absl::Status StoreClient::Lose(absl::Status why) {
  lost_ = true;
  return why;
}

}  // namespace tessera::simulation
