#include "control_plane/cluster/tickets.h"

#include <algorithm>
#include <span>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "control_plane/access.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"
#include "control_plane/secrets.h"
#include "core/world/proto_math.h"

namespace tessera::control {
namespace {

constexpr char kTicketPrefix[] = "ticket/";

std::string UsedTicketKey(const std::string& issuer, const std::string& player_id) {
  // Names of issuers have no zero byte.
  return kTicketPrefix + absl::BytesToHexString(HashSecret(issuer + std::string(1, '\0') + player_id));
}

absl::Status TicketRefused(const std::string& why) { return absl::UnauthenticatedError("ticket: " + why); }
absl::Status OldTicket() { return TicketRefused("it was used, or a newer one of its player was"); }

absl::Status CheckTicketProperties(const trust::Ticket& ticket, const records::Instance& record) {
  std::vector<PropertyDef> defs;
  defs.reserve(static_cast<std::size_t>(record.properties_size()));
  for (const v1::Property& declared : record.properties()) {
    defs.push_back({declared.name(), FromProto(declared).value_or(PropertyValue())});
  }
  PropertySet begins;
  for (const auto& [name, value] : ticket.properties) {
    if (const absl::Status status = begins.Set(defs, name, value); !status.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("ticket: properties: ", status.message()));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckSignature(const trust::ShownTicket& shown, const records::Issuer* issuer) {
  if (issuer == nullptr) return TicketRefused("no issuer of this cluster has its key");
  trust::TicketPublicKey key{};
  std::copy_n(issuer->public_key().begin(), key.size(), key.begin());
  if (trust::IsSignedBy(shown, key)) return absl::OkStatus();
  return TicketRefused(absl::StrCat("issuer ", issuer->name(), " has not signed it"));
}

bool Tickets::IsOld(const records::Issuer& issuer, const trust::Ticket& ticket) const {
  const auto known = used_.find(UsedTicketKey(issuer.name(), ticket.player_id));
  return known != used_.end() && ticket.number <= known->second.number;
}

absl::Status Tickets::Load(Now now) {
  const auto entries = state_.ListStored(kTicketPrefix);
  if (!entries.ok()) return entries.status();
  for (const StoreEntry& stored : *entries) {
    records::UsedTicket record;
    if (!ReadRecord(stored, record) || stored.key != UsedTicketKey(record.issuer(), record.player_id())) {
      if (absl::Status status = state_.SetAside(stored); !status.ok()) return status;
      continue;
    }
    used_[stored.key] = {record.number(), now.steady, stored.revision};
    in_order_.emplace_back(now.steady, stored.key);
  }
  return absl::OkStatus();
}

absl::StatusOr<trust::Ticket> Tickets::Check(const std::string& text, const records::Instance& record, Now now) const {
  auto shown = trust::ParseTicket(text);
  if (!shown.ok()) return shown.status();
  trust::Ticket& ticket = shown->ticket;
  const records::Issuer* issuer = issuers_.Find(ticket.key);
  // A copy is the cheapest to send, so it is to be the cheapest to refuse.
  if (issuer != nullptr && IsOld(*issuer, ticket)) return OldTicket();
  if (absl::Status status = CheckSignature(*shown, issuer); !status.ok()) return status;
  if (!std::equal(ticket.cluster.begin(), ticket.cluster.end(), issuers_.cluster_id().begin(),
                  issuers_.cluster_id().end(),
                  [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); })) {
    return TicketRefused("it is for another cluster");
  }
  if (!ticket.instance.empty() && ticket.instance != record.id()) {
    return TicketRefused(absl::StrCat("it is for instance ", ticket.instance, ", this is ", record.id()));
  }
  if (!IsFor(issuer->instances(), record.id())) {
    return TicketRefused(
        absl::StrCat("issuer ", issuer->name(), " signs for the instances ", issuer->instances(), " alone"));
  }
  if (absl::Status status = trust::CheckTime(ticket, now.unix_time); !status.ok()) return status;
  if (absl::Status status = CheckTicketProperties(ticket, record); !status.ok()) return status;
  return std::move(ticket);
}

absl::Status Tickets::Use(const trust::Ticket& ticket, Now now) {
  const records::Issuer* issuer = issuers_.Find(ticket.key);
  if (issuer == nullptr) return TicketRefused("no issuer of this cluster has its key");
  if (IsOld(*issuer, ticket)) return OldTicket();
  const std::string key = UsedTicketKey(issuer->name(), ticket.player_id);
  const auto known = used_.find(key);
  if (known == used_.end() && used_.size() >= kMaxUsedTickets) {
    return absl::ResourceExhaustedError(absl::StrCat("ticket: ", used_.size(), " were shown lately; try again later"));
  }
  records::UsedTicket record;
  record.set_issuer(issuer->name());
  record.set_player_id(ticket.player_id);
  record.set_number(ticket.number);
  *record.mutable_time() = ToTimestamp(now.unix_time);
  const std::vector<StoreOp> ops{
      PutOp(key, record.SerializeAsString(), known == used_.end() ? kAbsent : known->second.revision)};
  const auto written = state_.WriteStored(ops);
  if (!written.ok()) return written.status();
  used_[key] = {ticket.number, now.steady, *written};
  in_order_.emplace_back(now.steady, key);
  return absl::OkStatus();
}

void Tickets::Prune(Now now) {
  std::map<std::string, Revision> old;
  std::size_t seen = 0;
  for (const auto& [since, key] : in_order_) {
    if (old.size() >= kTicketsForgottenAtOnce || now.steady - since < kTicketMemory) break;
    ++seen;
    const auto used = used_.find(key);
    if (used != used_.end() && used->second.since == since) old.emplace(key, used->second.revision);
  }
  std::vector<StoreOp> ops;
  ops.reserve(old.size());
  for (const auto& [key, revision] : old) ops.push_back(DeleteOp(key, revision));
  // Tickets that cannot be deleted now are tried again with the next call.
  if (!ops.empty() && !state_.WriteStored(ops).ok()) return;
  for (const StoreOp& op : ops) used_.erase(op.key);
  in_order_.erase(in_order_.begin(), in_order_.begin() + static_cast<std::ptrdiff_t>(seen));
}

}  // namespace tessera::control
