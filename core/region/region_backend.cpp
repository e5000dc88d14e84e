// The talk of the game with its backend, as Region's callers see it. Events for the backend are in the
// world's record, messages of the backend in the records of their targets, so both go wherever those go.
#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/region/region.h"
#include "core/region/region_parts.h"

namespace tessera::region {
namespace {

// The grant of a record that is being handed over has left: its new owner is to be asked.
bool IsAtHome(BodyId id, const RegionParts& parts) {
  return parts.bodies.Owns(id) && !parts.failover.under_way() &&
         FindDeparting(parts.grants_out.departing(), id) == nullptr;
}

void PutRecord(BodyId id, const game::GameRecord& record, RegionParts& parts) {
  const KeptRecord* const now = parts.records.Find(id);
  const std::optional<KeptRecord> before = now == nullptr ? std::nullopt : std::optional(*now);
  parts.records.Put(id, record);
  if (const KeptRecord* const after = parts.records.Find(id)) {
    parts.output.Changed(before ? &*before : nullptr, *after, parts.tick + 1);
  }
}

}  // namespace

absl::Status Region::TakeFromBackend(BodyId target, std::uint64_t number, const game::Message& message) {
  RegionParts& parts = *parts_;
  if (parts.game.host() == nullptr) return absl::FailedPreconditionError("the world runs no game");
  const KeptRecord* const kept = parts.records.Find(target);
  if (parts.tombstones.Has(target) || (kept != nullptr && kept->game.removed)) {
    return absl::FailedPreconditionError(absl::StrCat("body ", target.value(), " is gone"));
  }
  if (!IsAtHome(target, parts)) return {absl::StatusCode::kNotFound, ""};
  game::GameRecord record = kept == nullptr ? game::GameRecord() : kept->game;
  switch (record.mail.TakeFromBackend(number, message, parts.tick)) {
    case game::Mail::Arrival::kRefused:
      return {absl::StatusCode::kResourceExhausted, ""};
    case game::Mail::Arrival::kRepeated:
      return {absl::StatusCode::kAlreadyExists, ""};
    case game::Mail::Arrival::kNew:
      break;
  }
  PutRecord(target, record, parts);
  return absl::OkStatus();
}

std::vector<game::Published::Event> Region::published() const {
  std::vector<game::Published::Event> events;
  const KeptRecord* const kept = parts_->bodies.Owns(kInstanceBody) ? parts_->records.Find(kInstanceBody) : nullptr;
  if (kept == nullptr) return events;
  const Tick committed = committed_tick();
  for (const game::Published::Event& event : kept->game.published.waiting) {
    if (event->tick > committed) break;
    events.push_back(event);
  }
  return events;
}

void Region::AcknowledgePublished(std::uint64_t number) {
  RegionParts& parts = *parts_;
  const KeptRecord* const kept = IsAtHome(kInstanceBody, parts) ? parts.records.Find(kInstanceBody) : nullptr;
  if (kept == nullptr || kept->game.published.waiting.empty()) return;
  if (kept->game.published.waiting.front()->number > number) return;
  game::GameRecord record = kept->game;
  record.published.Acknowledge(number);
  PutRecord(kInstanceBody, record, parts);
}

}  // namespace tessera::region
