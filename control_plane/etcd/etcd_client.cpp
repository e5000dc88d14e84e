#include "control_plane/etcd/etcd_client.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <mutex>
#include <thread>

#include "absl/strings/str_cat.h"
#include "control_plane/etcd/etcd.grpc.pb.h"

namespace tessera::control {
namespace {

namespace pb = etcdserverpb;
using EtcdClock = std::chrono::steady_clock;

// One attempt of a read: a member that hangs costs so long before the next is asked.
constexpr std::chrono::milliseconds kEtcdReadAttempt{1000};
// Between rounds in which no member answered. Shorter, and a cluster that elects its leader is flooded.
constexpr std::chrono::milliseconds kEtcdRetryPause{50};
// A connection that went silent is noticed after the sum of the two. etcd refuses pings more often than 5 s.
constexpr int kEtcdKeepaliveMs = 10'000, kEtcdKeepaliveTimeoutMs = 3'000;
// Between attempts to connect: gRPC's own grows to two minutes.
constexpr int kEtcdFirstBackoffMs = 100, kEtcdLastBackoffMs = 1'000;
// How long an attempt to connect may take, and how much of that a call waits for it before the next member is asked.
constexpr int kEtcdConnectMs = 1'000;
constexpr std::chrono::milliseconds kEtcdConnect{300};

absl::Status FromEtcd(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  const std::string& message = status.error_message();
  if (message.find("database space exceeded") != std::string::npos) {
    return absl::ResourceExhaustedError(
        absl::StrCat("etcd: ", message, "; it takes no write until it was compacted, defragmented and disarmed"));
  }
  return {static_cast<absl::StatusCode>(status.error_code()), absl::StrCat("etcd: ", message)};
}

// Whether another member may do better.
bool IsOneMembers(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) || absl::IsCancelled(status) ||
         absl::IsUnknown(status) || absl::IsInternal(status);
}

}  // namespace

struct EtcdClient::Member {
  explicit Member(const std::shared_ptr<grpc::Channel>& to)
      : channel(to), kv(pb::KV::NewStub(to)), lease(pb::Lease::NewStub(to)) {}
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<pb::KV::Stub> kv;
  std::unique_ptr<pb::Lease::Stub> lease;
};

EtcdClient::EtcdClient() = default;
EtcdClient::~EtcdClient() = default;

absl::StatusOr<std::unique_ptr<EtcdClient>> EtcdClient::Make(const EtcdAddress& address,
                                                             const EtcdCredentials& credentials) {
  if (credentials.authority.empty() && !address.is_local) {
    return absl::InvalidArgumentError(
        "etcd on another machine is reached by TLS alone, for the store holds secrets; name its authority");
  }
  if (credentials.certificate.empty() != credentials.key.empty()) {
    return absl::InvalidArgumentError("a certificate and its key go together");
  }
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kEtcdKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kEtcdKeepaliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kEtcdFirstBackoffMs);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kEtcdConnectMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kEtcdLastBackoffMs);
  arguments.SetMaxReceiveMessageSize(-1);
  const auto channel_credentials = credentials.authority.empty()
                                       ? grpc::InsecureChannelCredentials()
                                       : grpc::SslCredentials({.pem_root_certs = credentials.authority,
                                                               .pem_private_key = credentials.key,
                                                               .pem_cert_chain = credentials.certificate});
  std::unique_ptr<EtcdClient> client(new EtcdClient());
  for (const std::string& endpoint : address.endpoints) {
    client->members_.push_back(
        std::make_unique<Member>(grpc::CreateCustomChannel(endpoint, channel_credentials, arguments)));
  }
  return client;
}

// A write while it is under way.
class EtcdClient::OpenWrite {
 public:
  OpenWrite(const EtcdClient& client, grpc::ClientContext& context) : client_(client), context_(context) {
    const std::lock_guard lock(client_.mutex_);
    client_.open_writes_[&context_] = client_.term_;
  }
  ~OpenWrite() {
    const std::lock_guard lock(client_.mutex_);
    client_.open_writes_.erase(&context_);
  }
  OpenWrite(const OpenWrite&) = delete;
  OpenWrite& operator=(const OpenWrite&) = delete;

 private:
  const EtcdClient& client_;
  grpc::ClientContext& context_;
};

void EtcdClient::NoteTerm(const pb::ResponseHeader& header) const {
  const std::lock_guard lock(mutex_);
  if (header.raft_term() <= term_) return;
  term_ = header.raft_term();
  for (const auto& [context, term] : open_writes_) {
    if (term != 0) context->TryCancel();  // 0: no answer had come before it
  }
}

template <class Call>
absl::Status EtcdClient::Once(Span patience, Call&& call) const {
  const std::size_t index = in_use_.load();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + patience);
  context.AddMetadata("hasleader", "true");
  // A call to a member that was away fails at once, and nobody then drives the handshake that is under way: with TLS on
  // a busy machine it would never come to its end.
  members_[index]->channel->WaitForConnected(std::chrono::system_clock::now() + std::min(patience, kEtcdConnect));
  absl::Status status = FromEtcd(call(*members_[index], context));
  if (IsOneMembers(status)) {
    std::size_t expected = index;  // another thread may have gone on already
    in_use_.compare_exchange_strong(expected, (index + 1) % members_.size());
  }
  return status;
}

template <class Call>
absl::Status EtcdClient::Repeatedly(Span patience, Call&& call) const {
  const EtcdClock::time_point until = EtcdClock::now() + patience;
  absl::Status why;  // an attempt that had no time left says less than those before it
  for (std::size_t tried = 1;; ++tried) {
    const auto left = std::chrono::ceil<Span>(until - EtcdClock::now());
    const absl::Status status = Once(std::clamp(left, Span(1), kEtcdReadAttempt), call);
    if (status.ok() || !IsOneMembers(status)) return status;
    if (why.ok() || !absl::IsDeadlineExceeded(status)) why = status;
    if (EtcdClock::now() + kEtcdRetryPause >= until) return absl::UnavailableError(why.message());
    if (tried % members_.size() == 0) std::this_thread::sleep_for(kEtcdRetryPause);
  }
}

absl::StatusOr<pb::RangeResponse> EtcdClient::Range(const pb::RangeRequest& request, Span patience) const {
  pb::RangeResponse response;
  absl::Status status = Repeatedly(patience, [&](Member& member, grpc::ClientContext& context) {
    response.Clear();
    return member.kv->Range(&context, request, &response);
  });
  if (!status.ok()) return status;
  NoteTerm(response.header());
  return response;
}

absl::StatusOr<pb::TxnResponse> EtcdClient::Read(const pb::TxnRequest& request, Span patience) const {
  pb::TxnResponse response;
  absl::Status status = Repeatedly(patience, [&](Member& member, grpc::ClientContext& context) {
    response.Clear();
    return member.kv->Txn(&context, request, &response);
  });
  if (!status.ok()) return status;
  return response;
}

absl::StatusOr<pb::TxnResponse> EtcdClient::Write(const pb::TxnRequest& request, Span patience) const {
  pb::TxnResponse response;
  absl::Status status = Once(patience, [&](Member& member, grpc::ClientContext& context) {
    const OpenWrite under_way(*this, context);
    return member.kv->Txn(&context, request, &response);
  });
  if (!status.ok()) return status;
  NoteTerm(response.header());
  return response;
}

absl::Status EtcdClient::Compact(std::int64_t revision, Span patience) const {
  pb::CompactionRequest request;
  request.set_revision(revision);
  return Once(patience, [&](Member& member, grpc::ClientContext& context) {
    pb::CompactionResponse response;
    return member.kv->Compact(&context, request, &response);
  });
}

absl::StatusOr<pb::LeaseGrantResponse> EtcdClient::Grant(std::chrono::seconds ttl, Span patience) const {
  pb::LeaseGrantRequest request;
  request.set_ttl(ttl.count());
  pb::LeaseGrantResponse response;
  absl::Status status = Once(patience, [&](Member& member, grpc::ClientContext& context) {
    return member.lease->LeaseGrant(&context, request, &response);
  });
  if (!status.ok()) return status;
  if (!response.error().empty()) return absl::UnavailableError(absl::StrCat("etcd: ", response.error()));
  return response;
}

absl::Status EtcdClient::Revoke(std::int64_t lease, Span patience) const {
  pb::LeaseRevokeRequest request;
  request.set_id(lease);
  return Once(patience, [&](Member& member, grpc::ClientContext& context) {
    pb::LeaseRevokeResponse response;
    return member.lease->LeaseRevoke(&context, request, &response);
  });
}

absl::StatusOr<std::chrono::seconds> EtcdClient::KeepAlive(std::int64_t lease, Span patience) const {
  pb::LeaseKeepAliveRequest request;
  request.set_id(lease);
  pb::LeaseKeepAliveResponse response;
  absl::Status status = Once(patience, [&](Member& member, grpc::ClientContext& context) {
    const auto stream = member.lease->LeaseKeepAlive(&context);
    const bool answered = stream->Write(request) && stream->Read(&response);
    if (!answered) {
      const grpc::Status why = stream->Finish();
      return why.ok() ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "the stream of the lease was ended") : why;
    }
    context.TryCancel();  // etcd would hold the stream open
    stream->Finish();
    return grpc::Status::OK;
  });
  if (!status.ok()) return status;
  NoteTerm(response.header());
  if (response.ttl() <= 0) return absl::NotFoundError("etcd: the lease is over");
  return std::chrono::seconds(response.ttl());
}

absl::StatusOr<EtcdClient::LeaseLeft> EtcdClient::TimeToLive(std::int64_t lease, Span patience) const {
  pb::LeaseTimeToLiveRequest request;
  request.set_id(lease);
  pb::LeaseTimeToLiveResponse response;
  absl::Status status = Once(patience, [&](Member& member, grpc::ClientContext& context) {
    return member.lease->LeaseTimeToLive(&context, request, &response);
  });
  if (!status.ok()) return status;
  if (response.ttl() < 0) return absl::NotFoundError("etcd: the lease is over");
  return LeaseLeft{.left = std::chrono::seconds(response.ttl()),
                   .granted = std::chrono::seconds(response.grantedttl())};
}

bool EtcdClient::IsAmbiguous(const absl::Status& status) {
  // A request that etcd refuses by these has not been proposed to the other members.
  return !absl::IsInvalidArgument(status) && !absl::IsResourceExhausted(status) && !absl::IsOutOfRange(status) &&
         !absl::IsFailedPrecondition(status) && !absl::IsNotFound(status) && !absl::IsUnauthenticated(status) &&
         !absl::IsPermissionDenied(status) && !absl::IsUnimplemented(status);
}

std::string EtcdRangeEnd(std::string prefix) {
  while (!prefix.empty() && prefix.back() == '\xff') prefix.pop_back();
  if (!prefix.empty()) prefix.back() = static_cast<char>(static_cast<unsigned char>(prefix.back()) + 1);
  return prefix;
}

}  // namespace tessera::control
