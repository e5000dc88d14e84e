#include "control_plane/etcd/etcd_election.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "control_plane/etcd/etcd_trouble.h"

namespace tessera::control {
namespace {

namespace pb = etcdserverpb;

constexpr char kNoDoor[] = "-";
// The share of a lease by which we step down before its end, and the share after which it is renewed. Seldomer, and an
// election among etcd's members leaves less of the lease; more often, and etcd is asked more for nothing.
constexpr int kElectionMargin = 10, kElectionRenewals = 8;
// A call of the election; etcd's answers come in milliseconds. A renewal that takes longer is tried at another member.
constexpr std::chrono::milliseconds kElectionPatience{1000}, kRenewalPatience{500};
// A follower's question about the leader's lease, between two looks at its key.
constexpr std::chrono::milliseconds kSilencePatience{300};

}  // namespace

std::string ToText(const LeaderAddress& address) {
  return absl::StrCat(address.operators.empty() ? kNoDoor : address.operators, " ",
                      address.players.empty() ? kNoDoor : address.players);
}

std::optional<LeaderAddress> ReadLeaderAddress(const std::string& text) {
  std::vector<std::string> parts = absl::StrSplit(text, ' ');
  if (parts.size() != 2 || parts[0].empty() || parts[1].empty()) return std::nullopt;
  for (std::string& part : parts) {
    if (part == kNoDoor) part.clear();
  }
  return LeaderAddress{.operators = parts[0], .players = parts[1]};
}

EtcdElection::EtcdElection(const EtcdClient& client, const std::string& prefix, LeaderAddress self, ElectionTimes times)
    : client_(client),
      key_(prefix + "/leader"),
      serving_key_(prefix + "/serving"),
      self_(std::move(self)),
      times_(times) {}

EtcdElection::~EtcdElection() { Resign(); }

// --- Winning.

absl::StatusOr<std::optional<pb::KeyValue>> EtcdElection::Read(const std::string& key,
                                                               std::chrono::milliseconds patience) const {
  pb::RangeRequest request;
  request.set_key(key);
  auto found = client_.Range(request, patience);
  if (!found.ok()) return found.status();
  if (found->kvs_size() == 0) return std::nullopt;
  return found->kvs(0);
}

absl::StatusOr<EtcdFence> EtcdElection::Campaign(
    const std::function<void(const std::optional<LeaderAddress>&)>& followed, const std::function<bool()>& given_up) {
  Resign();
  std::optional<std::optional<LeaderAddress>> said;
  const auto say = [&](const std::optional<LeaderAddress>& leader) {
    if (!said || *said != leader) followed(leader);
    said = leader;
  };
  EtcdTrouble trouble(times_.trouble_after);
  const auto note = [&trouble](const absl::Status& status) {
    if (const auto line = trouble.Note(status, Clock::now())) spdlog::log(line->level, "{}", line->text);
  };
  LeaderProbe probe;
  LeaseWatch watch;
  while (!given_up()) {
    const auto leader = ReadLeader(kElectionPatience);
    const bool is_anothers = leader.ok() && leader->has_value() && (lease_ == 0 || (*leader)->lease() != lease_);
    if (leader.ok() && old_lease_ != 0) {
      EndOldLease();
    } else if (is_anothers) {
      say(ReadLeaderAddress((*leader)->value()));
      note(absl::OkStatus());
      if (IsGone(**leader, probe) && EndTerm(**leader, "its process is gone")) continue;
      if (IsSilent(**leader, watch) && EndTerm(**leader, "it does not renew its lease")) continue;
    } else {
      say(std::nullopt);
      const absl::Status won = leader.ok() ? TryToWin() : leader.status();
      note(won);
      if (won.ok()) return EtcdFence{.key = key_, .token = token_};
    }
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, times_.poll);
  }
  Resign();
  return absl::CancelledError("the campaign was given up");
}

bool EtcdElection::Serves(std::int64_t term) const {
  const auto serving = Read(serving_key_, kElectionPatience);
  return serving.ok() && serving->has_value() && (*serving)->value() == absl::StrCat(term);
}

// True if the leader's process is gone, though its lease stands.
bool EtcdElection::IsGone(const pb::KeyValue& leader, LeaderProbe& probe) const {
  const std::int64_t term = leader.create_revision();
  if (const auto at = ReadLeaderAddress(leader.value()); at && !probe.watches(term) && Serves(term)) {
    probe.Begin(term, at->operators.empty() ? at->players : at->operators);
  }
  return probe.watches(term) && probe.IsGone() && Serves(term);
}

// True if the leader does not renew its lease.
bool EtcdElection::IsSilent(const pb::KeyValue& leader, LeaseWatch& watch) const {
  const auto lease = client_.TimeToLive(leader.lease(), kSilencePatience);
  return lease.ok() && watch.IsSilent(leader.create_revision(), *lease, Clock::now());
}

// False: another leads by now, or it is not known; the next look tells.
bool EtcdElection::EndTerm(const pb::KeyValue& leader, const char* why) {
  pb::TxnRequest request;
  EtcdFence{.key = key_, .token = leader.create_revision()}.AddTo(request);
  request.add_success()->mutable_request_delete_range()->set_key(key_);
  const auto ended = client_.Write(request, kElectionPatience);
  if (!ended.ok() || !ended->succeeded()) return false;
  spdlog::warn("leader deposed leader=\"{}\" token={} reason=\"{}\"", leader.value(), leader.create_revision(), why);
  return true;
}

// A member of etcd that was elected meanwhile has given each lease all of its time anew, so without this the key of a
// leader that was cut off would stand for seconds after it is back, and nobody could lead.
void EtcdElection::EndOldLease() {
  const absl::Status ended = client_.Revoke(old_lease_, kElectionPatience);
  if (ended.ok() || absl::IsNotFound(ended)) old_lease_ = 0;
}

// ABORTED: somebody else was faster. Else it is not known who won; the key will say.
absl::Status EtcdElection::TryToWin() {
  if (lease_ == 0) {
    granted_sent_ = Clock::now();
    const auto granted = client_.Grant(times_.ttl, kElectionPatience);
    if (!granted.ok()) return granted.status();
    lease_ = granted->id();
    granted_ttl_ = std::chrono::seconds(granted->ttl());
  }
  pb::TxnRequest request;
  EtcdFence{.key = key_, .token = 0}.AddTo(request);
  pb::PutRequest& put = *request.add_success()->mutable_request_put();
  put.set_key(key_);
  put.set_value(ToText(self_));
  put.set_lease(lease_);
  request.add_failure()->mutable_request_range()->set_key(key_);
  const auto answer = client_.Write(request, kElectionPatience);
  if (absl::IsNotFound(answer.status())) lease_ = 0;  // it ran out meanwhile
  if (!answer.ok()) return answer.status();
  if (answer->succeeded()) {
    token_ = answer->header().revision();
  } else {
    const bool answered = answer->responses_size() == 1 && answer->responses(0).response_range().kvs_size() == 1;
    const pb::KeyValue* found = answered ? &answer->responses(0).response_range().kvs(0) : nullptr;
    if (found == nullptr || found->lease() != lease_) {
      Resign();
      return absl::AbortedError("another control plane was faster");
    }
    token_ = found->create_revision();  // by a campaign of ours that was not answered
  }
  return BeginToLead();
}

absl::Status EtcdElection::BeginToLead() {
  {
    const std::lock_guard lock(mutex_);
    lost_ = stopping_ = false;
    Extend(granted_sent_, granted_ttl_);
  }
  if (Left() <= Clock::duration::zero()) {
    Resign();
    return absl::DeadlineExceededError("the lease ended before it was known to be won");
  }
  renewer_ = std::thread([this, lease = lease_, token = token_] { Renew(lease, token); });
  return absl::OkStatus();
}

// --- Leading.

void EtcdElection::SetServing(bool serving) {
  pb::TxnRequest request;
  EtcdFence{.key = key_, .token = token_}.AddTo(request);
  if (serving) {
    pb::PutRequest& put = *request.add_success()->mutable_request_put();
    put.set_key(serving_key_);
    put.set_value(absl::StrCat(token_));
    put.set_lease(lease_);
  } else {
    request.add_success()->mutable_request_delete_range()->set_key(serving_key_);
  }
  const auto said = client_.Write(request, kElectionPatience);
  if (!said.ok()) spdlog::warn("serving={} not said error=\"{}\"", serving, std::string(said.status().message()));
}

// With the lock held.
void EtcdElection::Extend(Clock::time_point sent, std::chrono::seconds ttl) {
  until_ = std::max(until_, sent + ttl - std::chrono::milliseconds(ttl) / kElectionMargin);
  renew_every_ = std::chrono::milliseconds(ttl) / kElectionRenewals;
}

EtcdElection::Clock::duration EtcdElection::Left() const {
  const std::lock_guard lock(mutex_);
  return lost_ ? Clock::duration::zero() : until_ - Clock::now();
}

void EtcdElection::Renew(std::int64_t lease, std::int64_t token) {
  std::unique_lock lock(mutex_);
  Clock::time_point next = Clock::now() + renew_every_;
  while (true) {
    wake_.wait_until(lock, std::min(next, until_), [this] { return stopping_ || lost_; });
    if (stopping_ || lost_) return;
    if (Clock::now() >= until_) {
      spdlog::error("leadership lost reason=\"the lease could not be renewed in time\"");
      break;
    }
    lock.unlock();
    const Clock::time_point sent = Clock::now();
    const auto ttl = client_.KeepAlive(lease, kRenewalPatience);
    const auto leader = ReadLeader(kElectionPatience);
    lock.lock();
    const bool is_ours = leader.ok() && leader->has_value() && (*leader)->create_revision() == token;
    if (absl::IsNotFound(ttl.status()) || (leader.ok() && !is_ours)) {
      spdlog::error("leadership lost reason=\"the lease is over\"");
      break;
    }
    const bool renewed = ttl.ok() && is_ours;
    if (renewed) Extend(sent, *ttl);
    next = renewed ? sent + renew_every_ : Clock::now() + times_.poll;
  }
  lost_ = true;
  wake_.notify_all();
}

bool EtcdElection::Confirm(std::chrono::milliseconds patience) {
  const auto leader = ReadLeader(patience);
  if (!leader.ok()) return false;
  if (leader->has_value() && (*leader)->create_revision() == token_) return true;
  const std::lock_guard lock(mutex_);
  if (!std::exchange(lost_, true)) spdlog::error("leadership lost reason=\"the lease is over\"");
  wake_.notify_all();
  return false;
}

void EtcdElection::WaitUntilLost(const std::function<bool()>& given_up) {
  std::unique_lock lock(mutex_);
  while (!lost_ && Clock::now() < until_ && !given_up()) wake_.wait_for(lock, times_.poll);
}

void EtcdElection::Abandon() {
  const std::lock_guard lock(mutex_);
  lost_ = true;
  wake_.notify_all();
}

void EtcdElection::Resign() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = lost_ = true;
    until_ = Clock::time_point::min();
    wake_.notify_all();
  }
  if (renewer_.joinable()) renewer_.join();
  if (const std::int64_t lease = std::exchange(lease_, 0); lease != 0) {
    old_lease_ = lease;
    EndOldLease();
  }
}

}  // namespace tessera::control
