#include "control_plane/cluster/revocations.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/stored_records.h"
#include "trust/revocation_list.h"

namespace tessera::control {
namespace {

constexpr char kOldBanPrefix[] = "ban/";  // a key for each ban, in stores of before there was a list

void SetHosts(const std::set<std::uint64_t>& hosts, google::protobuf::RepeatedPtrField<v1::RevokedHosts>& runs) {
  runs.Clear();
  for (const std::uint64_t host : hosts) {
    if (runs.empty() || runs.rbegin()->last() + 1 != host) runs.Add()->set_first(host);
    runs.rbegin()->set_last(host);
  }
}

template <class Message>
void SetHostsAndWorkers(const Revoked& revoked, Message& message) {
  SetHosts(revoked.hosts, *message.mutable_hosts());
  message.clear_workers();
  for (const auto& [instance, region, incarnation] : revoked.workers) {
    v1::RevokedWorker& worker = *message.add_workers();
    worker.set_instance_id(instance);
    worker.set_region(region);
    worker.set_incarnation(incarnation);
  }
}

template <class Message>
Revoked HostsAndWorkersOf(const Message& message) {
  Revoked revoked;
  for (const v1::RevokedHosts& run : message.hosts()) {
    for (std::uint64_t host = run.first(); host <= run.last(); ++host) revoked.hosts.insert(host);
  }
  for (const v1::RevokedWorker& worker : message.workers()) {
    revoked.workers.emplace(worker.instance_id(), worker.region(), worker.incarnation());
  }
  return revoked;
}

// Bans, tokens and issuers, which hosts are not shown.
template <class Message>
void ReadSealed(const Message& message, Revoked& revoked) {
  for (const records::Ban& ban : message.bans()) revoked.bans[{ban.instance_id(), ban.player_id()}] = ban;
  for (const records::RevokedToken& token : message.tokens()) revoked.tokens[token.secret_hash()] = token;
  for (const std::string& issuer : message.issuers()) revoked.issuers.insert(issuer);
}

template <class Message>
void SetSealed(const Revoked& revoked, Message& message) {
  message.clear_bans();
  message.clear_tokens();
  for (const auto& [key, ban] : revoked.bans) *message.add_bans() = ban;
  for (const auto& [hash, token] : revoked.tokens) *message.add_tokens() = token;
  message.mutable_issuers()->Assign(revoked.issuers.begin(), revoked.issuers.end());
}

}  // namespace

absl::Status Revocations::Load() {
  const auto entries = state_.ListStored(kRevocationsKey);
  if (!entries.ok()) return entries.status();
  for (const StoreEntry& entry : *entries) {
    if (entry.key != kRevocationsKey || !ReadRecord(entry, record_)) {
      return absl::DataLossError(absl::StrCat("store: ", entry.key, ": cannot be read"));
    }
    revision_ = entry.revision;
  }
  revoked_ = HostsAndWorkersOf(record_);
  ReadSealed(record_, revoked_);
  if (entries->empty()) {
    record_.set_signing_seed(random_(net::kKeyBytes));
    std::vector<StoreOp> ops;
    if (absl::Status status = TakeOldBans(ops); !status.ok()) return status;
    auto key = net::SigningKey::FromSeed(record_.signing_seed(), "signing_seed");
    if (!key.ok()) return key.status();
    key_ = *std::move(key);
    return Store(record_, revoked_, std::move(ops));
  }
  auto key = net::SigningKey::FromSeed(record_.signing_seed(), "signing_seed");
  if (!key.ok()) {
    return absl::DataLossError(absl::StrCat("store: ", kRevocationsKey, ": ", key.status().message()));
  }
  key_ = *std::move(key);
  auto list = Signed(record_);
  if (!list.ok()) return list.status();
  newest_ = *std::move(list);
  return absl::OkStatus();
}

absl::Status Revocations::TakeOldBans(std::vector<StoreOp>& ops) {
  const auto entries = state_.ListStored(kOldBanPrefix);
  if (!entries.ok()) return entries.status();
  for (const StoreEntry& entry : *entries) {
    records::Ban ban;
    if (!ReadRecord(entry, ban)) {
      return absl::DataLossError(absl::StrCat("store: ", entry.key, ": cannot be read"));
    }
    revoked_.bans[{ban.instance_id(), ban.player_id()}] = ban;
    ops.push_back(DeleteOp(entry.key, entry.revision));
  }
  if (!ops.empty()) record_.set_number(1);
  return absl::OkStatus();
}

std::string Revocations::public_key() const {
  const net::VerificationKey& key = key_.verification_key();
  return {key.begin(), key.end()};
}

absl::StatusOr<v1::SignedRevocations> Revocations::Signed(const records::Revocations& record) const {
  v1::Revocations content;
  content.set_number(record.number());
  *content.mutable_hosts() = record.hosts();
  *content.mutable_workers() = record.workers();
  records::Bans bans;
  *bans.mutable_bans() = record.bans();
  *bans.mutable_tokens() = record.tokens();
  *bans.mutable_issuers() = record.issuers();
  if (bans.ByteSizeLong() > 0) {
    content.set_sealed_bans(trust::SealFor(key_, bans.SerializeAsString(), random_(trust::kSealNonceBytes)));
  }
  return trust::SignRevocations(content, key_);
}

// An instance that has ended has no links any more, and a world that nobody knows may yet be one that runs.
void Revocations::LeaveOutEnded(Revoked& content) const {
  if (state_.recovering()) return;
  std::erase_if(content.workers, [this](const Revoked::Life& life) {
    const InstanceEntry* instance = state_.FindInstance(std::get<0>(life));
    return instance == nullptr || instance->record.state() == v1::INSTANCE_STATE_ENDED;
  });
}

absl::Status Revocations::Store(records::Revocations next, Revoked content, std::vector<StoreOp> ops) {
  SetHostsAndWorkers(content, next);
  SetSealed(content, next);
  auto list = Signed(next);
  if (!list.ok()) return list.status();
  ops.push_back(PutOp(kRevocationsKey, next.SerializeAsString(), revision_));
  const auto written = state_.WriteStored(ops);
  if (!written.ok()) return written.status();
  revision_ = *written;
  record_ = std::move(next);
  revoked_ = std::move(content);
  newest_ = *std::move(list);
  for (HostEntry& host : state_.EachHost()) state_.MarkDesired(host);
  return absl::OkStatus();
}

absl::Status Revocations::Change(Revoked next) {
  LeaveOutEnded(next);
  records::Revocations record = record_;
  record.set_number(record.number() + 1);
  return Store(std::move(record), std::move(next));
}

absl::Status Revocations::AddHost(const HostEntry& host) {
  if (revoked_.hosts.contains(host.number)) return absl::OkStatus();
  Revoked next = revoked_;
  next.hosts.insert(host.number);
  for (const auto& [number, index] : host.workers) {
    const InstanceEntry& instance = state_.instance(number);
    const WorkerEntry& worker = instance.workers[index];
    next.workers.emplace(instance.record.id(), worker.region, worker.incarnation);
  }
  return Change(std::move(next));
}

// An old backup has a token with its expiry, so one that is over needs no name.
absl::Status Revocations::AddToken(const records::AccessToken& token, Now now) {
  Revoked next = revoked_;
  std::erase_if(next.tokens, [&](const auto& named) {
    return named.second.has_expire_time() && now.unix_time >= FromTimestamp(named.second.expire_time());
  });
  if (next.tokens.size() >= kMaxRevokedTokens) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the list of revocations names ", kMaxRevokedTokens, " access tokens already"));
  }
  records::RevokedToken& named = next.tokens[token.secret_hash()];
  named.set_secret_hash(token.secret_hash());
  if (token.has_expire_time()) *named.mutable_expire_time() = token.expire_time();
  return Change(std::move(next));
}

absl::Status Revocations::AddIssuer(const std::string& public_key) {
  if (revoked_.issuers.contains(public_key)) return absl::OkStatus();
  if (revoked_.issuers.size() >= kMaxRevokedIssuers) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the list of revocations names ", kMaxRevokedIssuers, " issuers already"));
  }
  Revoked next = revoked_;
  next.issuers.insert(public_key);
  return Change(std::move(next));
}

absl::Status Revocations::LiftIssuer(const std::string& public_key) {
  if (!revoked_.issuers.contains(public_key)) return absl::OkStatus();
  Revoked next = revoked_;
  next.issuers.erase(public_key);
  return Change(std::move(next));
}

bool Revocations::Lacks(std::uint64_t number) const {
  return number > record_.number() || (number > record_.lost_after() && number <= record_.lost_up_to());
}

absl::StatusOr<bool> Revocations::TakeUp(const v1::SignedRevocations& list) {
  const auto content = trust::ReadRevocations(list, key_.verification_key());
  if (!content.ok()) return content.status();
  const std::uint64_t number = content->number();
  if (!Lacks(number)) return false;
  Revoked next = HostsAndWorkersOf(*content);
  if (!content->sealed_bans().empty()) {
    const auto plain = trust::Unseal(key_, content->sealed_bans());
    if (!plain.ok()) return plain.status();
    records::Bans bans;
    if (!bans.ParseFromString(*plain)) return absl::DataLossError("revocations.sealed_bans: cannot be read");
    ReadSealed(bans, next);
  }
  const bool lost = number <= record_.lost_up_to();
  if (lost && !state_.recovering()) {
    next.hosts.insert(revoked_.hosts.begin(), revoked_.hosts.end());
    next.workers.insert(revoked_.workers.begin(), revoked_.workers.end());
    for (const auto& [key, ban] : revoked_.bans) next.bans[key] = ban;
    next.tokens.insert(revoked_.tokens.begin(), revoked_.tokens.end());
    next.issuers.insert(revoked_.issuers.begin(), revoked_.issuers.end());
  }
  records::Revocations record = record_;
  record.set_number(std::max(record.number(), number) + 1);
  if (lost) record.set_lost_after(number);
  if (absl::Status status = Store(std::move(record), std::move(next)); !status.ok()) return status;
  state_.Log(absl::StrCat("revocations taken up from a host number=", number, " hosts=", revoked_.hosts.size(),
                          " workers=", revoked_.workers.size(), " bans=", revoked_.bans.size(),
                          " tokens=", revoked_.tokens.size(), " issuers=", revoked_.issuers.size()),
             Severity::kWarning);
  return true;
}

}  // namespace tessera::control
