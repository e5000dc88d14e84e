#include "control_plane/testing/fake_etcd.h"

#include <algorithm>
#include <set>
#include <thread>

#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

namespace pb = etcdserverpb;

constexpr int kFakeMaxOps = 128;
constexpr std::size_t kFakeMaxRequestBytes = 1536 << 10;
constexpr std::chrono::milliseconds kFakeLook{2};  // between looks whether a caller is still there

// As etcd counts them: a list and the longest one that is nested in it share the limit.
grpc::Status CheckFakeOps(const pb::TxnRequest& request, int allowed, std::set<std::string>& puts) {
  const int longest = std::max({request.compare_size(), request.success_size(), request.failure_size()});
  if (longest > allowed) return {grpc::StatusCode::INVALID_ARGUMENT, "etcdserver: too many operations in txn request"};
  for (const pb::RequestOp& op : request.success()) {
    if (op.has_request_txn()) {
      if (grpc::Status status = CheckFakeOps(op.request_txn(), allowed - longest, puts); !status.ok()) return status;
    }
    if (op.has_request_put() && !puts.insert(op.request_put().key()).second) {
      return {grpc::StatusCode::INVALID_ARGUMENT, "etcdserver: duplicate key given in txn request"};
    }
  }
  return grpc::Status::OK;
}

bool IsFakeRead(const pb::TxnRequest& request) {
  return std::all_of(request.success().begin(), request.success().end(),
                     [](const pb::RequestOp& op) { return op.has_request_range(); });
}

std::int64_t TargetOf(const pb::Compare& compare, const pb::KeyValue& found, std::int64_t& wanted) {
  switch (compare.target()) {
    case pb::Compare::CREATE:
      wanted = compare.create_revision();
      return found.create_revision();
    case pb::Compare::MOD:
      wanted = compare.mod_revision();
      return found.mod_revision();
    default:
      wanted = compare.version();
      return found.version();
  }
}

const grpc::Status kFakeAway{grpc::StatusCode::UNAVAILABLE, "etcdserver: request timed out"};
const grpc::Status kFakeFull{grpc::StatusCode::RESOURCE_EXHAUSTED, "etcdserver: mvcc: database space exceeded"};

}  // namespace

FakeEtcd::FakeEtcd() {
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(static_cast<pb::KV::Service*>(this));
  builder.RegisterService(static_cast<pb::Lease::Service*>(this));
  builder.SetMaxReceiveMessageSize(-1);
  server_ = builder.BuildAndStart();
  endpoint_ = absl::StrCat("127.0.0.1:", port);
}

FakeEtcd::~FakeEtcd() { server_->Shutdown(std::chrono::system_clock::now()); }

void FakeEtcd::FailNext(std::initializer_list<Fault> faults) {
  const std::lock_guard lock(mutex_);
  faults_.insert(faults_.end(), faults.begin(), faults.end());
}

void FakeEtcd::SetTerm(std::uint64_t term) {
  const std::lock_guard lock(mutex_);
  term_ = term;
}

void FakeEtcd::FailRenewals(bool fail) {
  const std::lock_guard lock(mutex_);
  fail_renewals_ = fail;
}

void FakeEtcd::FailRevocations(bool fail) {
  const std::lock_guard lock(mutex_);
  fail_revocations_ = fail;
}

void FakeEtcd::FailReads(bool fail) {
  const std::lock_guard lock(mutex_);
  fail_reads_ = fail;
}

void FakeEtcd::SetLeft(std::chrono::seconds left) {
  const std::lock_guard lock(mutex_);
  left_ = left.count();
}

void FakeEtcd::ExpireLeases() {
  const std::lock_guard lock(mutex_);
  while (!leases_.empty()) EndLease(leases_.begin()->first);
}

void FakeEtcd::ForgetKeys() {
  const std::lock_guard lock(mutex_);
  if (std::erase_if(entries_, [](const auto& entry) { return entry.second.lease() != 0; }) > 0) ++revision_;
}

void FakeEtcd::DeliverLate() {
  const std::lock_guard lock(mutex_);
  for (const pb::TxnRequest& request : std::exchange(late_, {})) {
    pb::TxnResponse unheard;
    TxnNow(request, unheard);
  }
}

int FakeEtcd::transactions() const {
  const std::lock_guard lock(mutex_);
  return transactions_;
}

std::int64_t FakeEtcd::compacted() const {
  const std::lock_guard lock(mutex_);
  return compacted_;
}

std::vector<std::string> FakeEtcd::Keys() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> keys;
  for (const auto& [key, entry] : entries_) keys.push_back(key);
  return keys;
}

std::string FakeEtcd::Value(const std::string& key) const {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(key);
  return found == entries_.end() ? "" : found->second.value();
}

void FakeEtcd::Put(const std::string& key, const std::string& value) {
  const std::lock_guard lock(mutex_);
  pb::PutRequest put;
  put.set_key(key);
  put.set_value(value);
  PutNow(put, ++revision_);
}

// --- KV.

void FakeEtcd::RangeNow(const pb::RangeRequest& request, pb::RangeResponse& response) const {
  response.mutable_header()->set_revision(revision_);
  response.mutable_header()->set_raft_term(term_);
  const auto end =
      request.range_end().empty() ? entries_.upper_bound(request.key()) : entries_.lower_bound(request.range_end());
  auto at = entries_.lower_bound(request.key());
  for (; at != end && at != entries_.end(); ++at) {
    if (request.limit() > 0 && response.kvs_size() == request.limit()) break;
    pb::KeyValue& found = *response.add_kvs();
    found = at->second;
    if (request.keys_only()) found.clear_value();
  }
  response.set_more(at != end && at != entries_.end());
}

bool FakeEtcd::Holds(const pb::Compare& compare) const {
  const auto found = entries_.find(compare.key());
  std::int64_t wanted = 0;
  const std::int64_t is = TargetOf(compare, found == entries_.end() ? pb::KeyValue() : found->second, wanted);
  return compare.result() == pb::Compare::EQUAL && is == wanted;
}

void FakeEtcd::PutNow(const pb::PutRequest& put, std::int64_t revision) {
  pb::KeyValue& entry = entries_[put.key()];
  if (entry.key().empty()) entry.set_create_revision(revision);
  entry.set_key(put.key());
  entry.set_value(put.value());
  entry.set_lease(put.lease());
  entry.set_mod_revision(revision);
  entry.set_version(entry.version() + 1);
}

bool FakeEtcd::DeleteNow(const std::string& from, const std::string& to) {
  const auto first = entries_.lower_bound(from);
  const auto end = to.empty() ? entries_.upper_bound(from) : entries_.lower_bound(to);
  const bool some = first != end;
  entries_.erase(first, end);
  return some;
}

void FakeEtcd::Apply(const pb::TxnRequest& request, pb::TxnResponse& response, std::int64_t revision, bool& wrote) {
  response.set_succeeded(std::all_of(request.compare().begin(), request.compare().end(),
                                     [this](const pb::Compare& compare) { return Holds(compare); }));
  for (const pb::RequestOp& op : response.succeeded() ? request.success() : request.failure()) {
    pb::ResponseOp& answer = *response.add_responses();
    if (op.has_request_range()) {
      RangeNow(op.request_range(), *answer.mutable_response_range());
    } else if (op.has_request_put()) {
      PutNow(op.request_put(), revision);
      answer.mutable_response_put();
      wrote = true;
    } else if (op.has_request_delete_range()) {
      wrote = DeleteNow(op.request_delete_range().key(), op.request_delete_range().range_end()) || wrote;
      answer.mutable_response_delete_range();
    } else {
      Apply(op.request_txn(), *answer.mutable_response_txn(), revision, wrote);
    }
  }
}

void FakeEtcd::TxnNow(const pb::TxnRequest& request, pb::TxnResponse& response) {
  bool wrote = false;
  Apply(request, response, revision_ + 1, wrote);
  if (wrote) ++revision_;
  response.mutable_header()->set_revision(revision_);
  response.mutable_header()->set_raft_term(term_);
}

grpc::Status FakeEtcd::Range(grpc::ServerContext*, const pb::RangeRequest* request, pb::RangeResponse* response) {
  const std::lock_guard lock(mutex_);
  if (fail_reads_) return kFakeAway;
  RangeNow(*request, *response);
  return grpc::Status::OK;
}

grpc::Status FakeEtcd::Txn(grpc::ServerContext* context, const pb::TxnRequest* request, pb::TxnResponse* response) {
  if (request->ByteSizeLong() > kFakeMaxRequestBytes) {
    return {grpc::StatusCode::INVALID_ARGUMENT, "etcdserver: request is too large"};
  }
  std::set<std::string> puts;
  if (grpc::Status status = CheckFakeOps(*request, kFakeMaxOps, puts); !status.ok()) return status;
  std::unique_lock lock(mutex_);
  ++transactions_;
  if (fail_reads_ && IsFakeRead(*request)) return kFakeAway;
  if (IsFakeRead(*request) || faults_.empty()) {
    TxnNow(*request, *response);
    return grpc::Status::OK;
  }
  const Fault fault = faults_.front();
  faults_.pop_front();
  if (fault == Fault::kNone) {
    TxnNow(*request, *response);
    return grpc::Status::OK;
  }
  if (fault == Fault::kHang) {
    lock.unlock();
    while (!context->IsCancelled()) std::this_thread::sleep_for(kFakeLook);
    return kFakeAway;
  }
  if (fault == Fault::kLoseAnswer || fault == Fault::kFullAfter) TxnNow(*request, *response);
  if (fault == Fault::kArriveLate) late_.push_back(*request);
  return fault == Fault::kFull || fault == Fault::kFullAfter ? kFakeFull : kFakeAway;
}

grpc::Status FakeEtcd::Compact(grpc::ServerContext*, const pb::CompactionRequest* request, pb::CompactionResponse*) {
  const std::lock_guard lock(mutex_);
  if (request->revision() <= compacted_) {
    return {grpc::StatusCode::OUT_OF_RANGE, "etcdserver: mvcc: required revision has been compacted"};
  }
  if (request->revision() > revision_) {
    return {grpc::StatusCode::OUT_OF_RANGE, "etcdserver: mvcc: required revision is a future revision"};
  }
  compacted_ = request->revision();
  return grpc::Status::OK;
}

// --- Leases.

void FakeEtcd::EndLease(std::int64_t lease) {
  leases_.erase(lease);
  if (std::erase_if(entries_, [lease](const auto& entry) { return entry.second.lease() == lease; }) > 0) ++revision_;
}

grpc::Status FakeEtcd::LeaseGrant(grpc::ServerContext*, const pb::LeaseGrantRequest* request,
                                  pb::LeaseGrantResponse* response) {
  const std::lock_guard lock(mutex_);
  leases_[++last_lease_] = request->ttl();
  response->set_id(last_lease_);
  response->set_ttl(request->ttl());
  return grpc::Status::OK;
}

grpc::Status FakeEtcd::LeaseRevoke(grpc::ServerContext*, const pb::LeaseRevokeRequest* request,
                                   pb::LeaseRevokeResponse*) {
  const std::lock_guard lock(mutex_);
  if (fail_revocations_) return {grpc::StatusCode::UNAVAILABLE, "no revocations"};
  if (!leases_.contains(request->id())) {
    return {grpc::StatusCode::NOT_FOUND, "etcdserver: requested lease not found"};
  }
  EndLease(request->id());
  return grpc::Status::OK;
}

grpc::Status FakeEtcd::LeaseTimeToLive(grpc::ServerContext*, const pb::LeaseTimeToLiveRequest* request,
                                       pb::LeaseTimeToLiveResponse* response) {
  const std::lock_guard lock(mutex_);
  const auto lease = leases_.find(request->id());
  response->set_id(request->id());
  response->set_ttl(lease == leases_.end() ? -1 : left_.value_or(lease->second));
  response->set_grantedttl(lease == leases_.end() ? 0 : lease->second);
  return grpc::Status::OK;
}

grpc::Status FakeEtcd::LeaseKeepAlive(
    grpc::ServerContext*, grpc::ServerReaderWriter<pb::LeaseKeepAliveResponse, pb::LeaseKeepAliveRequest>* stream) {
  pb::LeaseKeepAliveRequest request;
  while (stream->Read(&request)) {
    pb::LeaseKeepAliveResponse response;
    {
      const std::lock_guard lock(mutex_);
      if (fail_renewals_) return kFakeAway;
      const auto lease = leases_.find(request.id());
      response.set_id(request.id());
      response.set_ttl(lease == leases_.end() ? 0 : lease->second);
    }
    if (!stream->Write(response)) break;
  }
  return grpc::Status::OK;
}

}  // namespace tessera::control
