#include "control_plane/etcd/etcd_store.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace tessera::control {
namespace {

namespace pb = etcdserverpb;
using StoreClock = std::chrono::steady_clock;

constexpr int kEtcdStoreVersion = 1;
constexpr char kEtcdStoreName[] = "tessera";
// etcd takes 128 operations in a list. A longer transaction is a tree of lists, whose longest way down counts as one
// list: three of 40 make 64000.
constexpr std::size_t kEtcdListOps = 40, kMaxEtcdOps = kEtcdListOps * kEtcdListOps * kEtcdListOps;
// So many expected revisions are compared by etcd itself. Beyond it they are read before: nobody else can write
// between.
constexpr std::size_t kEtcdCompared = 100;
// Keys with their values that one call reads: values under their keys are small.
constexpr std::int64_t kEtcdEntriesAtOnce = 200;
constexpr std::chrono::milliseconds kEtcdSettlePause{50};
// Transactions between two compactions: etcd keeps every value that ever was until then.
constexpr int kEtcdCompactEvery = 1000;

std::string HeadText(const std::string& mark) {
  return absl::StrCat(kEtcdStoreName, " ", kEtcdStoreVersion, " ", mark);
}

std::string HeadKey(const std::string& prefix) { return prefix + "/head"; }

void CompareRevision(const std::string& key, Revision expected, pb::TxnRequest& request) {
  pb::Compare& compare = *request.add_compare();
  compare.set_target(pb::Compare::MOD);
  compare.set_key(key);
  compare.set_mod_revision(expected);
}

void AddRange(const std::string& key, bool keys_only, pb::RequestOp& operation) {
  operation.mutable_request_range()->set_key(key);
  operation.mutable_request_range()->set_keys_only(keys_only);
}

// The only key of an answer to AddRange; null: it is not there.
const pb::KeyValue* Only(const pb::ResponseOp& answer) {
  return answer.response_range().kvs_size() == 1 ? &answer.response_range().kvs(0) : nullptr;
}
Revision RevisionIn(const pb::ResponseOp& answer) {
  const pb::KeyValue* found = Only(answer);
  return found == nullptr ? kAbsent : found->mod_revision();
}

// Adds the operations to the list, as a tree of lists where they are many.
void AddTree(std::vector<pb::RequestOp> operations, google::protobuf::RepeatedPtrField<pb::RequestOp>& list) {
  while (operations.size() > kEtcdListOps) {
    std::vector<pb::RequestOp> parents;
    for (std::size_t at = 0; at < operations.size(); at += kEtcdListOps) {
      pb::TxnRequest& nested = *parents.emplace_back().mutable_request_txn();
      for (std::size_t i = at; i < std::min(operations.size(), at + kEtcdListOps); ++i) {
        nested.add_success()->Swap(&operations[i]);
      }
    }
    operations = std::move(parents);
  }
  for (pb::RequestOp& operation : operations) list.Add()->Swap(&operation);
}

absl::Status NoEtcdKey(std::string_view key) {
  return absl::NotFoundError(absl::StrCat("store: no key ", std::string(key)));
}

}  // namespace

absl::StatusOr<std::string> ReadEtcdValue(const EtcdClient& client, const std::string& prefix, std::string_view key) {
  pb::RangeRequest request;
  request.set_key(EtcdDataKey(prefix, key));
  const auto found = client.Range(request, kEtcdReadPatience);
  if (!found.ok()) return found.status();
  if (found->kvs_size() == 0) return NoEtcdKey(key);
  return EtcdValues(client, prefix, {}).Decode(key, found->kvs(0).value());
}

// --- Opening.

EtcdStore::EtcdStore(const EtcdClient& client, const std::string& prefix, const EtcdFence& fence,
                     std::function<void()> on_lost)
    : client_(client), prefix_(prefix), fence_(fence), on_lost_(std::move(on_lost)), values_(client, prefix, fence) {}

absl::StatusOr<std::unique_ptr<EtcdStore>> EtcdStore::Open(const EtcdClient& client, const std::string& prefix,
                                                           const EtcdFence& fence, std::function<void()> on_lost) {
  std::unique_ptr<EtcdStore> store(new EtcdStore(client, prefix, fence, std::move(on_lost)));
  if (absl::Status status = store->ReadHead(); !status.ok()) return status;
  if (absl::Status status = store->values_.Collect(); !status.ok()) return status;
  return store;
}

absl::Status EtcdStore::ReadHead() {
  pb::RangeRequest request;
  request.set_key(HeadKey(prefix_));
  const auto found = client_.Range(request, kEtcdReadPatience);
  if (!found.ok()) return found.status();
  if (found->kvs_size() == 0) return absl::OkStatus();
  const std::vector<std::string> parts = absl::StrSplit(found->kvs(0).value(), ' ');
  int version = 0;
  if (parts.size() < 2 || parts[0] != kEtcdStoreName || !absl::SimpleAtoi(parts[1], &version)) {
    return absl::FailedPreconditionError(absl::StrCat("store: ", HeadKey(prefix_), " in etcd is not that of a store"));
  }
  if (version > kEtcdStoreVersion) {
    return absl::FailedPreconditionError(absl::StrCat("store: ", prefix_, " in etcd has version ", version,
                                                      ", this program knows ", kEtcdStoreVersion,
                                                      ": start the newer tessera-control that wrote it"));
  }
  head_ = compact_to_ = found->kvs(0).mod_revision();
  return absl::OkStatus();
}

// --- Reading.

absl::StatusOr<StoreEntry> EtcdStore::Get(std::string_view key) const {
  pb::RangeRequest request;
  request.set_key(EtcdDataKey(prefix_, key));
  // The value may have been replaced between the pointer and its chunks; then the new pointer is read.
  for (bool again = true;; again = false) {
    const auto found = client_.Range(request, kEtcdReadPatience);
    if (!found.ok()) return found.status();
    if (found->kvs_size() == 0) return NoEtcdKey(key);
    auto value = values_.Decode(key, found->kvs(0).value());
    if (value.ok()) return StoreEntry{std::string(key), *std::move(value), found->kvs(0).mod_revision()};
    if (!again) return absl::DataLossError(value.status().message());
    if (!absl::IsNotFound(value.status()) && !absl::IsDataLoss(value.status())) return value.status();
  }
}

absl::StatusOr<std::vector<StoreEntry>> EtcdStore::ListWithout(std::string_view prefix,
                                                               std::string_view without) const {
  const std::lock_guard lock(mutex_);  // so that both parts are of one moment
  const std::string first = EtcdDataKey(prefix_, prefix), end = EtcdRangeEnd(first);
  const std::string gap = EtcdDataKey(prefix_, without), gap_end = EtcdRangeEnd(gap);
  std::vector<StoreEntry> entries;
  const bool cut = !without.empty() && gap < end && gap_end > first;
  absl::Status status = first < gap || !cut ? ListRange(first, cut ? gap : end, entries) : absl::OkStatus();
  if (status.ok() && cut && gap_end < end) status = ListRange(gap_end, end, entries);
  if (!status.ok()) return status;
  return entries;
}

// With the lock held. From `first` up to `end`, which is not in it.
absl::Status EtcdStore::ListRange(const std::string& first, const std::string& end,
                                  std::vector<StoreEntry>& entries) const {
  const std::size_t skipped = EtcdDataKey(prefix_, "").size();
  pb::RangeRequest request;
  request.set_key(first);
  request.set_range_end(end);
  request.set_limit(kEtcdEntriesAtOnce);
  for (bool more = true; more;) {
    const auto page = client_.Range(request, kEtcdReadPatience);
    if (!page.ok()) return page.status();
    for (const pb::KeyValue& found : page->kvs()) {
      std::string key = found.key().substr(skipped);
      auto value = values_.Read(key, found.value());
      if (!value.ok()) return value.status();
      entries.push_back({std::move(key), std::move(value->bytes), found.mod_revision(), !value->fault.ok()});
    }
    more = page->more() && page->kvs_size() > 0;
    if (more) request.set_key(page->kvs().rbegin()->key() + '\0');
  }
  return absl::OkStatus();
}

Revision EtcdStore::revision() const {
  const std::lock_guard lock(mutex_);
  return head_;
}

// --- Writing.

absl::StatusOr<Revision> EtcdStore::Txn(std::span<const StoreOp> ops) {
  if (absl::Status status = CheckOps(ops); !status.ok()) return status;
  if (ops.size() > kMaxEtcdOps / 2) {  // each may remove chunks besides
    return absl::InvalidArgumentError(
        absl::StrCat("store: a transaction of ", ops.size(), " writes is more than etcd takes, ", kMaxEtcdOps / 2));
  }
  const std::lock_guard lock(mutex_);
  if (!lost_.ok()) return lost_;
  auto written = Write(ops);
  if (written.ok()) CompactNowAndThen();
  const absl::Status& status = written.status();
  if (status.ok() || absl::IsAborted(status) || absl::IsFailedPrecondition(status)) return written;
  return absl::UnavailableError(status.message());
}

absl::StatusOr<Revision> EtcdStore::Write(std::span<const StoreOp> ops) {
  const std::span<const StoreOp> compared = ops.size() <= kEtcdCompared ? ops : ops.first(0);
  // Chunks are not written for a transaction that cannot succeed.
  if (absl::Status status = CheckExpected(ops); !status.ok()) return status;
  const auto stored = values_.Encode(ops);
  if (!stored.ok()) return absl::IsFailedPrecondition(stored.status()) ? Lose(stored.status()) : stored.status();
  const std::vector<pb::RequestOp> operations = Operations(ops, *stored);
  auto written = Commit(operations, compared);
  // A member that has just died answers nothing; the next one takes the write, once the first is known to be void.
  if (absl::IsCancelled(written.status())) written = Commit(operations, compared);
  if (!written.ok()) return written;
  for (std::size_t i = 0; i < ops.size(); ++i) values_.NoteWritten(ops[i].key, (*stored)[i]);
  return written;
}

std::vector<pb::RequestOp> EtcdStore::Operations(std::span<const StoreOp> ops,
                                                 const std::vector<std::string>& stored) const {
  std::vector<pb::RequestOp> operations;
  for (std::size_t i = 0; i < ops.size(); ++i) {
    const std::string key = EtcdDataKey(prefix_, ops[i].key);
    if (ops[i].kind == StoreOp::Kind::kDelete) {
      operations.emplace_back().mutable_request_delete_range()->set_key(key);
    } else {
      pb::PutRequest& put = *operations.emplace_back().mutable_request_put();
      put.set_key(key);
      put.set_value(stored[i]);
    }
    values_.AddRemovals(ops[i].key, stored[i], operations);
  }
  return operations;
}

// Only for what etcd does not compare itself, and before chunks are written.
absl::Status EtcdStore::CheckExpected(std::span<const StoreOp> ops) const {
  std::size_t bytes = 0;
  for (const StoreOp& op : ops) bytes += op.value.size();
  if (ops.size() <= kEtcdCompared && bytes <= kEtcdInlineBytes) return absl::OkStatus();
  for (std::size_t at = 0; at < ops.size(); at += kEtcdCompared) {
    const std::span<const StoreOp> part = ops.subspan(at, std::min(kEtcdCompared, ops.size() - at));
    pb::TxnRequest request;
    for (const StoreOp& op : part) AddRange(EtcdDataKey(prefix_, op.key), true, *request.add_success());
    const auto found = client_.Read(request, kEtcdReadPatience);
    if (!found.ok()) return found.status();
    if (found->responses_size() != static_cast<int>(part.size())) {
      return absl::UnavailableError("etcd: answered another question");
    }
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Revision at_revision = RevisionIn(found->responses(static_cast<int>(i)));
      if (at_revision != part[i].expected) return Conflict(part[i], at_revision);
    }
  }
  return absl::OkStatus();
}

// Every transaction compares and writes these; where it fails the first two answers are the fence's key and the head.
void EtcdStore::AddGuards(pb::TxnRequest& request, const std::string& mark) const {
  const std::string head = HeadKey(prefix_);
  fence_.AddTo(request);
  CompareRevision(head, head_, request);
  pb::PutRequest& put = *request.add_success()->mutable_request_put();
  put.set_key(head);
  put.set_value(HeadText(mark));
  AddRange(fence_.key, true, *request.add_failure());
  AddRange(head, false, *request.add_failure());
}

// CANCELLED: it was not answered, and has certainly not taken effect.
absl::StatusOr<Revision> EtcdStore::Commit(const std::vector<pb::RequestOp>& operations,
                                           std::span<const StoreOp> compared) {
  const std::string mark = NextMark();
  pb::TxnRequest request;
  AddGuards(request, mark);
  for (const StoreOp& op : compared) {
    const std::string key = EtcdDataKey(prefix_, op.key);
    CompareRevision(key, op.expected, request);
    AddRange(key, true, *request.add_failure());
  }
  AddTree(operations, *request.mutable_success());
  const auto answer = client_.Write(request, kEtcdWritePatience);
  if (absl::IsResourceExhausted(answer.status())) return AfterNoSpace(mark, answer.status());
  if (!answer.ok()) {
    return EtcdClient::IsAmbiguous(answer.status()) ? Settle(mark, answer.status()) : answer.status();
  }
  if (!answer->succeeded()) return Refusal(*answer, compared);
  return head_ = answer->header().revision();
}

// The write that finds etcd full is refused by etcd, and yet may have taken effect. It is under way no more.
absl::StatusOr<Revision> EtcdStore::AfterNoSpace(const std::string& mark, const absl::Status& why) {
  pb::RangeRequest request;
  request.set_key(HeadKey(prefix_));
  const auto head = client_.Range(request, kEtcdReadPatience);
  if (!head.ok()) return Lose(head.status());
  if (head->kvs_size() == 0 || head->kvs(0).value() != HeadText(mark)) return why;
  return head_ = head->kvs(0).mod_revision();
}

// Why a transaction that etcd answered did not succeed.
absl::Status EtcdStore::Refusal(const pb::TxnResponse& response, std::span<const StoreOp> compared) {
  if (response.responses_size() != static_cast<int>(compared.size()) + 2) {
    return Lose(absl::UnavailableError("store: etcd answered another question"));
  }
  const pb::KeyValue* fence = Only(response.responses(0));
  if (fence == nullptr || fence->create_revision() != fence_.token) {
    return Lose(absl::FailedPreconditionError("store: this control plane no longer leads"));
  }
  if (RevisionIn(response.responses(1)) != head_) {
    return Lose(absl::FailedPreconditionError("store: somebody else has written to it; this control plane steps down"));
  }
  for (std::size_t i = 0; i < compared.size(); ++i) {
    const Revision found = RevisionIn(response.responses(static_cast<int>(i) + 2));
    if (found != compared[i].expected) return Conflict(compared[i], found);
  }
  return Lose(absl::UnavailableError("store: etcd refused a transaction and gave no reason"));
}

// A write was not answered. See the header for why a barrier ends the doubt.
absl::StatusOr<Revision> EtcdStore::Settle(const std::string& mark, const absl::Status& why) {
  spdlog::warn("store write unanswered error=\"{}\"; finding out what became of it", std::string(why.message()));
  const StoreClock::time_point until = StoreClock::now() + kEtcdSettlePatience;
  std::vector<std::string> barriers;
  while (StoreClock::now() < until) {
    barriers.push_back(HeadText(NextMark()));
    pb::TxnRequest barrier;
    AddGuards(barrier, barriers.back().substr(HeadText("").size()));
    const auto answer = client_.Write(barrier, kEtcdWritePatience);
    if (!answer.ok()) {
      std::this_thread::sleep_for(kEtcdSettlePause);
      continue;
    }
    if (answer->succeeded()) {
      head_ = answer->header().revision();
      return absl::CancelledError(absl::StrCat("store: not written: ", why.message()));
    }
    const pb::KeyValue* head = answer->responses_size() == 2 ? Only(answer->responses(1)) : nullptr;
    const pb::KeyValue* fence = answer->responses_size() == 2 ? Only(answer->responses(0)) : nullptr;
    if (head == nullptr || fence == nullptr || fence->create_revision() != fence_.token) return Refusal(*answer, {});
    const bool is_write = head->value() == HeadText(mark);
    const bool is_barrier = std::find(barriers.begin(), barriers.end(), head->value()) != barriers.end();
    if (!is_write && !is_barrier) return Refusal(*answer, {});
    head_ = head->mod_revision();
    if (is_write) return head_;
    return absl::CancelledError(absl::StrCat("store: not written: ", why.message()));
  }
  return Lose(absl::UnavailableError(absl::StrCat(
      "store: it is not known whether a write took effect; this control plane steps down: ", why.message())));
}

absl::Status EtcdStore::Lose(absl::Status why) {
  if (lost_.ok()) {
    lost_ = std::move(why);
    spdlog::error("store lost error=\"{}\"", std::string(lost_.message()));
    if (on_lost_) on_lost_();
  }
  return lost_;
}

// A revision that others watch in the same etcd stays readable for as long as so many transactions take.
void EtcdStore::CompactNowAndThen() {
  if (++since_compaction_ < kEtcdCompactEvery) return;
  since_compaction_ = 0;
  const Revision up_to = std::exchange(compact_to_, head_);
  if (up_to == kAbsent) return;
  const absl::Status status = client_.Compact(up_to, kEtcdWritePatience);
  // Somebody else may have compacted further.
  if (!status.ok() && !absl::IsOutOfRange(status)) {
    spdlog::warn("store not compacted error=\"{}\"", std::string(status.message()));
  }
}

std::string EtcdStore::NextMark() { return absl::StrCat(fence_.token, "-", ++marks_); }

}  // namespace tessera::control
