// EtcdClient: calls to an etcd (v3 API, gRPC), one of whose members answers.
//
// A read is tried at one member after the other until its time is over. A write is tried once, since nobody knows
// whether one that was not answered has taken effect: IsAmbiguous parts these from those that etcd refused. Every call
// has a deadline, and asks for a member that sees a leader, so that one that was cut off refuses.
//
// A write that is under way when etcd's members elect another leader may be lost, and then nobody answers it. Each
// answer has the number of the term that it is of, so once one of a later term comes, from whichever call, the writes
// of earlier ones are ended: as CANCELLED, and as ambiguous as they were.
//
//   auto client = EtcdClient::Make({.endpoints = {"10.0.0.1:2379"}, ...}, {.authority = pem});
//   auto found = (*client)->Range(request, std::chrono::seconds(2));
//
// Thread rule: any thread; calls block.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/etcd/etcd.pb.h"
#include "control_plane/etcd/etcd_address.h"

namespace grpc {
class ClientContext;
}

namespace tessera::control {

struct EtcdCredentials {
  std::string authority;         // PEM, of etcd's certificates; empty: no TLS
  std::string certificate, key;  // PEM, of this client; empty: none
};

class EtcdClient {
 public:
  using Span = std::chrono::milliseconds;

  // Connects when it is first used. INVALID_ARGUMENT: without TLS to another machine (the store holds secrets), or a
  // certificate without its key.
  static absl::StatusOr<std::unique_ptr<EtcdClient>> Make(const EtcdAddress& address,
                                                          const EtcdCredentials& credentials);
  ~EtcdClient();
  EtcdClient(const EtcdClient&) = delete;
  EtcdClient& operator=(const EtcdClient&) = delete;

  // --- Reads, linearizable. UNAVAILABLE: no member answered within `patience`.
  absl::StatusOr<etcdserverpb::RangeResponse> Range(const etcdserverpb::RangeRequest& request, Span patience) const;
  // A transaction that holds nothing but ranges.
  absl::StatusOr<etcdserverpb::TxnResponse> Read(const etcdserverpb::TxnRequest& request, Span patience) const;

  struct LeaseLeft {
    std::chrono::seconds left{0};  // rounded down
    std::chrono::seconds granted{0};
  };
  // Tried once. What somebody else's lease has left; NOT_FOUND: it is over.
  absl::StatusOr<LeaseLeft> TimeToLive(std::int64_t lease, Span patience) const;

  // --- Writes, tried once.
  absl::StatusOr<etcdserverpb::TxnResponse> Write(const etcdserverpb::TxnRequest& request, Span patience) const;
  absl::Status Compact(std::int64_t revision, Span patience) const;
  absl::StatusOr<etcdserverpb::LeaseGrantResponse> Grant(std::chrono::seconds ttl, Span patience) const;
  absl::Status Revoke(std::int64_t lease, Span patience) const;
  // The seconds that the lease has from now on; NOT_FOUND: it is over.
  absl::StatusOr<std::chrono::seconds> KeepAlive(std::int64_t lease, Span patience) const;

  // True if a write that failed so may have taken effect, or may yet.
  static bool IsAmbiguous(const absl::Status& status);

 private:
  struct Member;
  EtcdClient();
  // Calls `call(Member&, grpc::ClientContext&)` at the member in use; after a failure that another might not have, the
  // next one is in use.
  template <class Call>
  absl::Status Once(Span patience, Call&& call) const;
  template <class Call>
  absl::Status Repeatedly(Span patience, Call&& call) const;

  class OpenWrite;
  void NoteTerm(const etcdserverpb::ResponseHeader& header) const;

  std::vector<std::unique_ptr<Member>> members_;
  mutable std::atomic<std::size_t> in_use_{0};

  mutable std::mutex mutex_;                                           // guards what follows
  mutable std::uint64_t term_ = 0;                                     // the latest that an answer was of
  mutable std::map<grpc::ClientContext*, std::uint64_t> open_writes_;  // with the latest term when they were sent
};

// The smallest key that is greater than all that start with `prefix`, which is not empty.
std::string EtcdRangeEnd(std::string prefix);

}  // namespace tessera::control
