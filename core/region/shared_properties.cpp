#include "core/region/shared_properties.h"

#include <algorithm>
#include <cassert>

namespace tessera::region {

void SharedProperties::Changed(const KeptRecord* before, const KeptRecord& after, Tick tick) {
  if (before != nullptr ? before->bytes == after.bytes : after.bytes->empty()) return;
  const auto [at, added] = pending_.try_emplace(after.body);
  Pending& pending = at->second;
  if (added && before != nullptr) pending.shown = before->bytes;
  if (!pending.later.empty() && pending.later.back().first == tick) {
    pending.later.back().second = after.bytes;
  } else {
    pending.later.emplace_back(tick, after.bytes);
  }
}

void SharedProperties::Release(Tick committed, Tick now) {
  const auto due = [&](Tick tick) { return tick <= committed && tick + kDelay <= now; };
  for (auto& [body, pending] : pending_) {
    while (!pending.later.empty() && due(pending.later.front().first)) {
      pending.shown = std::move(pending.later.front().second);
      pending.later.pop_front();
    }
  }
  std::erase_if(pending_, [](const auto& one) { return one.second.later.empty(); });
}

const PropertyPointer& SharedProperties::ShownOf(const KeptRecord& record) const {
  const auto pending = pending_.find(record.body);
  return pending == pending_.end() ? record.bytes : pending->second.shown;
}

std::vector<GhostProperties> SharedProperties::For(RegionId to, std::span<const GhostRecord> ghosts,
                                                   const RecordTable& records) {
  std::vector<GhostProperties> tell;
  std::map<BodyId, PropertyPointer>& told = told_[to];
  std::map<BodyId, PropertyPointer> now;
  auto record = records.all().begin();
  for (const GhostRecord& ghost : ghosts) {
    record = std::lower_bound(record, records.all().end(), ghost.id,
                              [](const KeptRecord& kept, BodyId id) { return kept.body < id; });
    if (record == records.all().end()) break;
    if (record->body != ghost.id) continue;
    const PropertyPointer& shown = ShownOf(*record);
    if (shown == nullptr || shown->empty()) continue;
    const auto before = told.find(ghost.id);
    if (before == told.end() || before->second != shown) tell.push_back({ghost.id, *shown});
    now.emplace_hint(now.end(), ghost.id, shown);
  }
  told = std::move(now);
  return tell;
}

void SharedProperties::SetNeighbors(std::span<const RegionId> neighbors, bool anew) {
  std::erase_if(told_, [&](const auto& one) { return anew || !std::ranges::binary_search(neighbors, one.first); });
}

void SharedProperties::Take(std::span<const GhostProperties> properties) {
  for (const GhostProperties& one : properties) {
    seen_[one.body] = std::make_shared<const std::vector<std::uint8_t>>(one.bytes);
  }
}

void SharedProperties::KeepOnly(std::span<const Ghost> ghosts) {
  if (seen_.empty()) return;
  auto ghost = ghosts.begin();
  std::erase_if(seen_, [&](const auto& one) {
    while (ghost != ghosts.end() && ghost->record.id < one.first) ++ghost;
    return ghost == ghosts.end() || ghost->record.id != one.first;
  });
}

const std::vector<std::uint8_t>* SharedProperties::Find(BodyId id) const {
  const auto seen = seen_.find(id);
  return seen == seen_.end() ? nullptr : seen->second.get();
}

void SharedProperties::Validate([[maybe_unused]] const Bodies& bodies) const {
  assert(std::ranges::all_of(pending_, [&](const auto& one) {
    return bodies.Owns(one.first) && !one.second.later.empty() &&
           std::ranges::is_sorted(one.second.later, {}, [](const auto& later) { return later.first; });
  }));
}

}  // namespace tessera::region
