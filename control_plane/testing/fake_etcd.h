// FakeEtcd: an etcd of one member in this process, that fails on demand.
//
// It serves KV and Lease at a free port of loopback as etcd 3.4 does: revisions, compares, nested transactions, limits
// of 128 operations in a list and 1.5 MiB a request, keys that go with their lease. It keeps no history. Leases end
// when a test says so, never by time.
//
//   FakeEtcd etcd;
//   etcd.FailNext(FakeEtcd::Fault::kLoseAnswer);   // the next transaction takes effect and is not answered
//
// Thread rule: any thread.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "control_plane/etcd/etcd.grpc.pb.h"
#include "control_plane/etcd/etcd_address.h"
#include "control_plane/etcd/etcd_client.h"

namespace tessera::control {

class FakeEtcd final : public etcdserverpb::KV::Service, public etcdserverpb::Lease::Service {
 public:
  enum class Fault {
    kNone,         // takes effect and is answered
    kLoseRequest,  // no effect, UNAVAILABLE
    kLoseAnswer,   // takes effect, UNAVAILABLE
    kArriveLate,   // UNAVAILABLE, and takes effect when DeliverLate is called
    kFull,         // no effect, etcd's answer when its disk quota is used up
    kFullAfter,    // the same answer, and yet it takes effect
    kHang,         // no effect, and no answer before the caller gives up
  };

  FakeEtcd();
  ~FakeEtcd() override;

  EtcdAddress address(const std::string& prefix = "tessera") const {
    return {.endpoints = {endpoint_}, .prefix = prefix, .is_local = true};
  }
  std::unique_ptr<EtcdClient> Connect() const { return *EtcdClient::Make(address(), {}); }

  // Answers are those of the leader of this term from now on.
  void SetTerm(std::uint64_t term);
  // The next transactions that write, one fault each.
  void FailNext(std::initializer_list<Fault> faults);
  // Renewals fail with UNAVAILABLE, or not any more.
  void FailRenewals(bool fail);
  // To end a lease fails with UNAVAILABLE, or not any more.
  void FailRevocations(bool fail);
  // Reads fail with UNAVAILABLE, or not any more: transactions without a write among them.
  void FailReads(bool fail);
  // All leases have so much left, as if nobody had renewed them, though they never end of it; else all of their time.
  void SetLeft(std::chrono::seconds left);
  // Ends all leases, as if their time were over.
  void ExpireLeases();
  // The lease goes on, says etcd, though its key is gone: what 3.4.23 has been seen to do.
  void ForgetKeys();
  // Applies what arrives late.
  void DeliverLate();

  int transactions() const;  // that were received
  std::int64_t compacted() const;
  std::vector<std::string> Keys() const;
  std::string Value(const std::string& key) const;
  void Put(const std::string& key, const std::string& value);

  grpc::Status Range(grpc::ServerContext*, const etcdserverpb::RangeRequest*, etcdserverpb::RangeResponse*) override;
  grpc::Status Txn(grpc::ServerContext*, const etcdserverpb::TxnRequest*, etcdserverpb::TxnResponse*) override;
  grpc::Status Compact(grpc::ServerContext*, const etcdserverpb::CompactionRequest*,
                       etcdserverpb::CompactionResponse*) override;
  grpc::Status LeaseGrant(grpc::ServerContext*, const etcdserverpb::LeaseGrantRequest*,
                          etcdserverpb::LeaseGrantResponse*) override;
  grpc::Status LeaseRevoke(grpc::ServerContext*, const etcdserverpb::LeaseRevokeRequest*,
                           etcdserverpb::LeaseRevokeResponse*) override;
  grpc::Status LeaseKeepAlive(grpc::ServerContext*,
                              grpc::ServerReaderWriter<etcdserverpb::LeaseKeepAliveResponse,
                                                       etcdserverpb::LeaseKeepAliveRequest>* stream) override;
  grpc::Status LeaseTimeToLive(grpc::ServerContext*, const etcdserverpb::LeaseTimeToLiveRequest*,
                               etcdserverpb::LeaseTimeToLiveResponse*) override;

 private:
  using Entries = std::map<std::string, etcdserverpb::KeyValue>;

  // With the lock held, all that follow.
  void RangeNow(const etcdserverpb::RangeRequest& request, etcdserverpb::RangeResponse& response) const;
  bool Holds(const etcdserverpb::Compare& compare) const;
  void Apply(const etcdserverpb::TxnRequest& request, etcdserverpb::TxnResponse& response, std::int64_t revision,
             bool& wrote);
  void PutNow(const etcdserverpb::PutRequest& put, std::int64_t revision);
  bool DeleteNow(const std::string& from, const std::string& to);
  void TxnNow(const etcdserverpb::TxnRequest& request, etcdserverpb::TxnResponse& response);
  void EndLease(std::int64_t lease);

  mutable std::mutex mutex_;
  Entries entries_;
  std::int64_t revision_ = 1;  // as an empty etcd's
  std::uint64_t term_ = 2;     // as a new etcd's
  std::int64_t compacted_ = 0;
  std::int64_t last_lease_ = 7000;
  std::map<std::int64_t, std::int64_t> leases_;  // to their seconds
  std::optional<std::int64_t> left_;             // seconds; the same for each of them
  std::deque<Fault> faults_;
  std::vector<etcdserverpb::TxnRequest> late_;
  bool fail_renewals_ = false, fail_revocations_ = false, fail_reads_ = false;
  int transactions_ = 0;
  std::string endpoint_;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace tessera::control
