#include "control_plane/cluster/access_tokens.h"

#include <array>
#include <chrono>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/names.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"

namespace tessera::control {
namespace {

using namespace std::chrono_literals;

constexpr char kTokenPrefix[] = "token/";
constexpr std::size_t kMaxTokens = 1000;
constexpr std::chrono::seconds kLeastTtl = 1min, kMostTtl = 24h * 3650;

v1::AccessToken ViewOf(const records::AccessToken& record) {
  v1::AccessToken view;
  view.set_name(record.name());
  view.set_role(record.role());
  *view.mutable_create_time() = record.create_time();
  if (record.has_expire_time()) *view.mutable_expire_time() = record.expire_time();
  view.set_instances(record.instances());
  return view;
}

bool HasRunOut(const records::AccessToken& record, Now now) {
  return record.has_expire_time() && now.unix_time >= FromTimestamp(record.expire_time());
}

absl::Status CheckRequest(const v1::CreateTokenRequest& request) {
  if (absl::Status status = CheckName(request.name()); !status.ok()) return status;
  if (request.role() == v1::ROLE_UNSPECIFIED || !v1::Role_IsValid(request.role())) {
    return absl::InvalidArgumentError("role: must be viewer, operator or administrator");
  }
  const google::protobuf::Duration& ttl = request.ttl();
  if (request.has_ttl() && (ttl.seconds() < kLeastTtl.count() || ttl.seconds() > kMostTtl.count() || ttl.nanos() < 0 ||
                            ttl.nanos() > 999'999'999)) {
    return absl::InvalidArgumentError(absl::StrCat("ttl: must be 1 minute to 10 years, got ", ttl.seconds(), " s"));
  }
  if (absl::Status status = CheckInstances(request.instances()); !status.ok()) return status;
  if (!request.instances().empty() && request.role() == v1::ROLE_ADMINISTRATOR) {
    return absl::InvalidArgumentError("instances: an administrator's token is for the whole cluster");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status AccessTokens::Load() {
  const auto entries = state_.ListStored(kTokenPrefix);
  if (!entries.ok()) return entries.status();
  for (const StoreEntry& stored : *entries) {
    Entry entry{.record = {}, .revision = stored.revision};
    if (!ReadRecord(stored, entry.record) || stored.key != kTokenPrefix + entry.record.name()) {
      if (absl::Status status = state_.SetAside(stored); !status.ok()) return status;
      continue;
    }
    names_.emplace(entry.record.secret_hash(), entry.record.name());
    tokens_.emplace(entry.record.name(), std::move(entry));
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::CreateTokenResponse> AccessTokens::Create(const v1::CreateTokenRequest& request, Now now) {
  if (absl::Status status = CheckRequest(request); !status.ok()) return status;
  if (tokens_.contains(request.name())) {
    return absl::AlreadyExistsError(absl::StrCat("name: there is a token ", request.name(), " already"));
  }
  if (tokens_.size() >= kMaxTokens) {
    return absl::ResourceExhaustedError(absl::StrCat("there are ", kMaxTokens, " tokens already; revoke one first"));
  }
  v1::CreateTokenResponse response;
  response.set_secret(MakeAccessSecret(random_));
  Entry entry;
  entry.record.set_name(request.name());
  entry.record.set_role(request.role());
  entry.record.set_secret_hash(HashSecret(response.secret()));
  entry.record.set_instances(request.instances());
  *entry.record.mutable_create_time() = ToTimestamp(now.unix_time);
  if (request.has_ttl()) {
    const auto ttl = std::chrono::seconds(request.ttl().seconds()) + std::chrono::nanoseconds(request.ttl().nanos());
    *entry.record.mutable_expire_time() = ToTimestamp(now.unix_time + ttl);
  }
  const std::array ops{PutOp(kTokenPrefix + request.name(), entry.record.SerializeAsString(), kAbsent)};
  const auto written = state_.WriteStored(ops);
  if (!written.ok()) return written.status();
  entry.revision = *written;
  *response.mutable_token() = ViewOf(entry.record);
  names_.emplace(entry.record.secret_hash(), request.name());
  tokens_.emplace(request.name(), std::move(entry));
  state_.NoteAccessChanged();
  return response;
}

v1::ListTokensResponse AccessTokens::List() const {
  v1::ListTokensResponse response;
  for (const auto& [name, entry] : tokens_) *response.add_tokens() = ViewOf(entry.record);
  return response;
}

absl::Status AccessTokens::Revoke(const v1::RevokeTokenRequest& request) {
  const auto found = tokens_.find(request.name());
  if (found == tokens_.end())
    return absl::NotFoundError(absl::StrCat("name: no token ", OneLine(request.name(), kMaxNameBytes)));
  const std::array ops{DeleteOp(kTokenPrefix + found->first, found->second.revision)};
  if (const auto written = state_.WriteStored(ops); !written.ok()) return written.status();
  names_.erase(found->second.record.secret_hash());
  tokens_.erase(found);
  state_.NoteAccessChanged();
  return absl::OkStatus();
}

const records::AccessToken* AccessTokens::Named(const std::string& name) const {
  const auto found = tokens_.find(name);
  return found == tokens_.end() ? nullptr : &found->second.record;
}

void AccessTokens::Drop(const std::map<std::string, records::RevokedToken>& revoked) {
  if (revoked.empty()) return;
  for (auto it = tokens_.begin(); it != tokens_.end();) {
    const std::string& hash = it->second.record.secret_hash();
    if (!revoked.contains(hash)) {
      ++it;
      continue;
    }
    if (names_.erase(hash) > 0) state_.NoteAccessChanged();
    const std::array ops{DeleteOp(kTokenPrefix + it->first, it->second.revision)};
    it = state_.WriteStored(ops).ok() ? tokens_.erase(it) : std::next(it);
  }
}

const records::AccessToken* AccessTokens::Find(std::string_view secret, Now now) const {
  const auto name = names_.find(HashSecret(secret));
  if (name == names_.end()) return nullptr;
  const records::AccessToken& record = tokens_.at(name->second).record;
  return HasRunOut(record, now) ? nullptr : &record;
}

TokensByHash AccessTokens::ByHash() const {
  TokensByHash tokens;
  for (const auto& [hash, name] : names_) tokens.emplace(hash, tokens_.at(name).record);
  return tokens;
}

// By its hash: how long that takes tells nothing of a secret.
const records::AccessToken* FindToken(const TokensByHash& tokens, std::string_view secret, Now now) {
  const auto found = tokens.find(HashSecret(secret));
  return found == tokens.end() || HasRunOut(found->second, now) ? nullptr : &found->second;
}

}  // namespace tessera::control
