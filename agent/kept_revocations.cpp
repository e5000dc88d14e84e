#include "agent/kept_revocations.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "trust/revocation_list.h"

namespace tessera::agent {
namespace {

absl::StatusOr<v1::Revocations> Verified(const v1::SignedRevocations& list, const std::string& key) {
  const auto by = net::VerificationKeyFrom(key, "revocations_key");
  if (!by.ok()) return by.status();
  return trust::ReadRevocations(list, *by);
}

}  // namespace

void WriteRevoked(const RevokedLives& lives, v1::WorkerOrder& order) {
  order.clear_revoked();
  const auto found = lives.find(order.instance_id());
  if (found != lives.end()) order.mutable_revoked()->Add(found->second.begin(), found->second.end());
}

absl::Status KeptRevocations::Begin(const std::string& key) {
  key_ = key;
  newest_.Clear();
  content_.Clear();
  const auto kept = state_.LoadRevocations();
  if (!kept.ok()) return absl::DataLossError(kept.status().message());
  if (!kept->has_revocations()) return absl::OkStatus();
  auto content = Verified(kept->revocations(), key_);
  if (!content.ok()) {
    return absl::DataLossError(absl::StrCat(state_.RevocationsPath(), ": ", content.status().message()));
  }
  newest_ = kept->revocations();
  content_ = *std::move(content);
  return absl::OkStatus();
}

absl::Status KeptRevocations::Take(const v1::SignedRevocations& list) {
  auto content = Verified(list, key_);
  if (!content.ok()) return content.status();
  if (content->number() == number()) return absl::OkStatus();
  if (content->number() < number()) {
    return absl::FailedPreconditionError(
        absl::StrCat("revocations.number: ", content->number(), " is older than ", number(), ", which is kept here"));
  }
  KeptRevocationsFile file;
  *file.mutable_revocations() = list;
  if (absl::Status status = state_.SaveRevocations(file); !status.ok()) return status;
  newest_ = list;
  content_ = *std::move(content);
  return absl::OkStatus();
}

RevokedLives KeptRevocations::lives() const {
  RevokedLives lives;
  for (const v1::RevokedWorker& worker : content_.workers()) {
    v1::DeadRegion& life = lives[worker.instance_id()].emplace_back();
    life.set_region(worker.region());
    life.set_incarnation(worker.incarnation());
  }
  return lives;
}

}  // namespace tessera::agent
