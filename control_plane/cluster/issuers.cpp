#include "control_plane/cluster/issuers.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/names.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"

namespace tessera::control {
namespace {

constexpr char kClusterIdKey[] = "cluster_id", kIssuerPrefix[] = "issuer/";
constexpr std::size_t kMaxIssuers = 100;  // one a game, and another while its key is changed

trust::TicketKeyId IssuerKeyId(const std::string& public_key) {
  trust::TicketPublicKey key{};
  std::copy_n(public_key.begin(), key.size(), key.begin());
  return trust::KeyIdOf(key);
}

bool IsIssuerKey(const std::string& public_key) { return public_key.size() == trust::TicketPublicKey().size(); }

v1::Issuer IssuerView(const records::Issuer& record) {
  v1::Issuer view;
  view.set_name(record.name());
  view.set_public_key(record.public_key());
  view.set_instances(record.instances());
  *view.mutable_create_time() = record.create_time();
  return view;
}

}  // namespace

absl::Status Issuers::Load() {
  const auto ids = state_.ListStored(kClusterIdKey);
  if (!ids.ok()) return ids.status();
  for (const StoreEntry& stored : *ids) {
    records::ClusterId record;
    if (!ReadRecord(stored, record) || record.id().size() != trust::TicketCluster().size()) {
      return absl::DataLossError(absl::StrCat("store: ", stored.key, ": cannot be read"));
    }
    cluster_id_ = record.id();
  }
  const auto entries = state_.ListStored(kIssuerPrefix);
  if (!entries.ok()) return entries.status();
  for (const StoreEntry& stored : *entries) {
    Entry entry{.record = {}, .revision = stored.revision};
    if (!ReadRecord(stored, entry.record) || stored.key != kIssuerPrefix + entry.record.name() ||
        !IsIssuerKey(entry.record.public_key())) {
      if (absl::Status status = state_.SetAside(stored); !status.ok()) return status;
      continue;
    }
    names_.emplace(IssuerKeyId(entry.record.public_key()), entry.record.name());
    issuers_.emplace(entry.record.name(), std::move(entry));
  }
  return absl::OkStatus();
}

absl::Status Issuers::CheckRequest(const v1::AddIssuerRequest& request) const {
  if (absl::Status status = CheckName(request.name()); !status.ok()) return status;
  if (!IsIssuerKey(request.public_key())) {
    return absl::InvalidArgumentError(
        absl::StrCat("public_key: ", request.public_key().size(), " bytes are no Ed25519 key, which has 32"));
  }
  if (absl::Status status = CheckInstances(request.instances()); !status.ok()) return status;
  if (issuers_.contains(request.name())) {
    return absl::AlreadyExistsError(absl::StrCat("name: there is an issuer ", request.name(), " already"));
  }
  if (const auto same = names_.find(IssuerKeyId(request.public_key())); same != names_.end()) {
    return absl::AlreadyExistsError(absl::StrCat("public_key: it is issuer ", same->second, "'s already"));
  }
  if (issuers_.size() >= kMaxIssuers) {
    return absl::ResourceExhaustedError(absl::StrCat("there are ", kMaxIssuers, " issuers already; remove one first"));
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::AddIssuerResponse> Issuers::Add(const v1::AddIssuerRequest& request, Now now) {
  if (absl::Status status = CheckRequest(request); !status.ok()) return status;
  Entry entry;
  entry.record.set_name(request.name());
  entry.record.set_public_key(request.public_key());
  entry.record.set_instances(request.instances());
  *entry.record.mutable_create_time() = ToTimestamp(now.unix_time);
  std::vector<StoreOp> ops{PutOp(kIssuerPrefix + request.name(), entry.record.SerializeAsString(), kAbsent)};
  std::string id = cluster_id_;
  if (id.empty()) {
    id = random_(trust::TicketCluster().size());
    records::ClusterId drawn;
    drawn.set_id(id);
    ops.push_back(PutOp(kClusterIdKey, drawn.SerializeAsString(), kAbsent));
  }
  const auto written = state_.WriteStored(ops);
  if (!written.ok()) return written.status();
  cluster_id_ = std::move(id);
  entry.revision = *written;
  v1::AddIssuerResponse response;
  *response.mutable_issuer() = IssuerView(entry.record);
  response.set_cluster_id(cluster_id_);
  names_.emplace(IssuerKeyId(request.public_key()), request.name());
  issuers_.emplace(request.name(), std::move(entry));
  return response;
}

v1::ListIssuersResponse Issuers::List() const {
  v1::ListIssuersResponse response;
  for (const auto& [name, entry] : issuers_) *response.add_issuers() = IssuerView(entry.record);
  response.set_cluster_id(cluster_id_);
  return response;
}

absl::Status Issuers::Remove(const v1::RemoveIssuerRequest& request) {
  const auto found = issuers_.find(request.name());
  if (found == issuers_.end()) {
    return absl::NotFoundError(absl::StrCat("name: no issuer ", OneLine(request.name(), kMaxNameBytes)));
  }
  const std::vector<StoreOp> ops{DeleteOp(kIssuerPrefix + found->first, found->second.revision)};
  if (const auto written = state_.WriteStored(ops); !written.ok()) return written.status();
  names_.erase(IssuerKeyId(found->second.record.public_key()));
  issuers_.erase(found);
  return absl::OkStatus();
}

const records::Issuer* Issuers::Named(const std::string& name) const {
  const auto found = issuers_.find(name);
  return found == issuers_.end() ? nullptr : &found->second.record;
}

void Issuers::Drop(const std::set<std::string>& revoked) {
  if (revoked.empty()) return;
  for (auto it = issuers_.begin(); it != issuers_.end();) {
    const std::string& key = it->second.record.public_key();
    if (!revoked.contains(key)) {
      ++it;
      continue;
    }
    names_.erase(IssuerKeyId(key));
    const std::vector<StoreOp> ops{DeleteOp(kIssuerPrefix + it->first, it->second.revision)};
    it = state_.WriteStored(ops).ok() ? issuers_.erase(it) : std::next(it);
  }
}

const records::Issuer* Issuers::Find(const trust::TicketKeyId& key) const {
  const auto name = names_.find(key);
  return name == names_.end() ? nullptr : &issuers_.at(name->second).record;
}

}  // namespace tessera::control
