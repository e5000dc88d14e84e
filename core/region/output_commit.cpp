#include "core/region/output_commit.h"

#include <algorithm>
#include <cassert>

namespace tessera::region {

bool CountsAsChange(const KeptRecord* before, const KeptRecord& after) {
  if (before == nullptr) {
    return !after.bytes->empty() || !after.game.timers.empty() || after.game.expires != Tick() ||
           !after.game.player.empty();
  }
  const game::GameRecord &a = before->game, &b = after.game;
  return before->bytes != after.bytes || a.timers != b.timers || a.last_timer != b.last_timer ||
         a.expires != b.expires || a.last_question != b.last_question || a.tuning.visible_to != b.tuning.visible_to ||
         !(a.player == b.player);
}

void OutputCommit::Changed(const KeptRecord* before, const KeptRecord& after, Tick tick) {
  if (!CountsAsChange(before, after)) return;
  const auto [at, added] = entries_.try_emplace(after.body);
  Entry& entry = at->second;
  if (added && before != nullptr) entry.told = {before->bytes, before->game.player};
  Told told{after.bytes, after.game.player};
  if (!entry.later.empty() && entry.later.back().first == tick) {
    entry.later.back().second = std::move(told);
  } else {
    entry.later.emplace_back(tick, std::move(told));
  }
}

void OutputCommit::Left(BodyId id) {
  entries_.erase(id);
  waiting_.erase(id);
}

void OutputCommit::Release(std::optional<Tick> standby_has, Tick now) {
  // Some have gone back to where they belong.
  std::erase_if(waiting_, [now](const auto& one) { return one.second.last + 1 < now; });
  if (!standby_has) {
    entries_.clear();
    waiting_.clear();
    return;
  }
  for (auto& [id, entry] : entries_) {
    while (!entry.later.empty() && entry.later.front().first <= *standby_has) {
      entry.told = std::move(entry.later.front().second);
      entry.later.pop_front();
    }
    if (entry.spawned <= *standby_has) entry.spawned = Tick();
    if (entry.bound <= *standby_has) entry.bound = Tick();
  }
  std::erase_if(entries_, [](const auto& one) {
    const Entry& entry = one.second;
    return entry.later.empty() && entry.spawned == Tick() && entry.bound == Tick();
  });
}

bool OutputCommit::MustWait(std::span<const BodyId> assembly, Tick now) {
  if (entries_.empty() && waiting_.empty()) return false;
  const bool held = std::ranges::any_of(assembly, [this](BodyId id) {
    const auto entry = entries_.find(id);
    return entry != entries_.end() && entry->second.bound != Tick();
  });
  bool wait = held;
  for (const BodyId id : assembly) {
    if (!held) {
      waiting_.erase(id);
      continue;
    }
    Wait& waits = waiting_.try_emplace(id, Wait{now, now}).first->second;
    waits.last = now;
    wait = wait && now - waits.since < static_cast<std::int64_t>(kMaxHandoverWait);
  }
  return wait;
}

bool OutputCommit::IsHidden(BodyId id) const {
  const auto entry = entries_.find(id);
  return entry != entries_.end() && entry->second.spawned != Tick();
}

const OutputCommit::PropertyBytes& OutputCommit::PropertiesOf(const KeptRecord& record) const {
  const auto entry = entries_.find(record.body);
  return entry == entries_.end() || entry->second.later.empty() ? record.bytes : entry->second.told.properties;
}

const game::SharedPlayerRecord& OutputCommit::PlayerOf(const KeptRecord& record) const {
  const auto entry = entries_.find(record.body);
  return entry == entries_.end() || entry->second.later.empty() ? record.game.player : entry->second.told.player;
}

void OutputCommit::Validate() const {
  assert(std::ranges::all_of(entries_, [](const auto& one) {
    const Entry& entry = one.second;
    return std::ranges::is_sorted(entry.later, {}, [](const auto& later) { return later.first; });
  }));
}

}  // namespace tessera::region
