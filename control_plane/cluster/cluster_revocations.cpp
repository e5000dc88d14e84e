// Cluster's part in the list of revocations: what agents say of theirs, and what follows from one that was taken up.
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/life.h"

namespace tessera::control {

// Also while the cluster recovers: the list comes before the orders that the host holds. True: it was such a message.
bool Cluster::TakesRevocations(HostEntry& host, const v1::AgentMessage& message, Now now) {
  if (message.kind_case() == v1::AgentMessage::kKeptRevocations) {
    host.kept_revocations = message.kept_revocations();
    return true;
  }
  if (message.kind_case() != v1::AgentMessage::kRevocations) return false;
  hosts_.Heard(host, now);
  TakeUpRevocations(host, message.revocations(), now);
  return true;
}

// The host itself may be one that the list names.
void Cluster::TakeUpRevocations(const HostEntry& host, const v1::SignedRevocations& list, Now now) {
  const std::string name = host.record.name();
  const auto taken = revocations_.TakeUp(list);
  if (!taken.ok()) {
    state_->Log(absl::StrCat("revocations refused host=", name, ": ", taken.status().message()), Severity::kWarning);
    return;
  }
  if (!*taken) return;
  InstanceNumbers touched;
  RemoveRevoked(touched);
  if (recovery_.active()) return;  // instances are led on once it is known what runs
  SendBannedAway(now);
  reconciler_.Reconcile(now, touched);
}

void Cluster::RemoveRevoked(InstanceNumbers& touched) {
  DropRevokedAccess();
  std::vector<HostEntry*> revoked;
  for (HostEntry& host : state_->EachHost()) {
    if (revocations_.revoked().hosts.contains(host.number)) revoked.push_back(&host);
  }
  for (HostEntry* host : revoked) (void)hosts_.Remove(*host, touched);  // not stored: the next timer tries again
}

void Cluster::DropRevokedAccess() {
  tokens_.Drop(revocations_.revoked().tokens);
  issuers_.Drop(revocations_.revoked().issuers);
}

// A list that is full keeps nobody's access.
absl::Status Cluster::NoteRevoked(const absl::Status& named, const std::string& what) {
  if (!absl::IsResourceExhausted(named)) return named;
  state_->Log(absl::StrCat(what, " is revoked, and would come back with an older backup: ", named.message()),
              Severity::kWarning);
  return absl::OkStatus();
}

// The list comes first: what it names is dropped from the store whenever that takes it.
absl::Status Cluster::RevokeToken(Now now, const v1::RevokeTokenRequest& request) {
  const records::AccessToken* token = tokens_.Named(request.name());
  if (token == nullptr) return tokens_.Revoke(request);
  const absl::Status named = revocations_.AddToken(*token, now);
  if (absl::Status status = NoteRevoked(named, absl::StrCat("token ", request.name())); !status.ok()) return status;
  return tokens_.Revoke(request);
}

absl::StatusOr<v1::AddIssuerResponse> Cluster::AddIssuer(Now now, const v1::AddIssuerRequest& request) {
  if (absl::Status status = issuers_.CheckRequest(request); !status.ok()) return status;
  if (absl::Status status = revocations_.LiftIssuer(request.public_key()); !status.ok()) return status;
  return issuers_.Add(request, now);
}

absl::Status Cluster::RemoveIssuer(const v1::RemoveIssuerRequest& request) {
  const records::Issuer* issuer = issuers_.Named(request.name());
  if (issuer == nullptr) return issuers_.Remove(request);
  const absl::Status named = revocations_.AddIssuer(issuer->public_key());
  if (absl::Status status = NoteRevoked(named, absl::StrCat("issuer ", request.name())); !status.ok()) return status;
  return issuers_.Remove(request);
}

// Whoever is banned and plays all the same: the ban is younger than the record of the instance.
void Cluster::SendBannedAway(Now now) {
  for (InstanceEntry& instance : state_->EachInstance()) {
    if (IsFinal(instance.record.state())) continue;
    const Players before = instance.players;
    for (const records::StoredPlayer* known : before.All()) {
      const v1::Player& player = known->player();
      if (player.left() || player.player_id().empty()) continue;
      const std::string* reason = bans_.ReasonOf(instance.record.id(), player.player_id());
      if (reason == nullptr) continue;
      if (const auto kicked = players_.Kick(instance, player.number(), *reason, now); !kicked.ok()) {
        LogTrouble(*state_, instance, "a banned player cannot be sent away for now", kicked.status());
      }
    }
  }
}

// A host that does not keep the newest list may let in what was revoked.
void Cluster::RenewLease(HostEntry& host, const v1::LeaseRequest& request, Now now) {
  if (revocations_.KeptBy(host)) return failovers_.RenewLease(host, request, now);
  if (std::exchange(host.leases_withheld_for, revocations_.number()) == revocations_.number()) return;
  state_->Log(absl::StrCat("leases withheld until the host keeps the newest revocations host=", host.record.name(),
                           " keeps=", host.kept_revocations, " newest=", revocations_.number()),
              Severity::kWarning);
}

}  // namespace tessera::control
