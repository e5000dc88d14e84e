#include "control_plane/cluster/game_events.h"

#include <algorithm>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/game_fields.h"
#include "core/world/utf8.h"

namespace tessera::control {
namespace {

constexpr char kHeads[] = "events/", kEvents[] = "event/";

std::string EventHeadKey(std::uint64_t instance) { return absl::StrCat(kHeads, instance); }
std::string EventsOf(std::uint64_t instance) { return absl::StrCat(kEvents, instance, "/"); }
// Keys ascend with the numbers.
std::string EventKey(std::uint64_t instance, std::uint64_t number) {
  return absl::StrCat(EventsOf(instance), absl::Dec(number, absl::kZeroPad20));
}

std::uint64_t LifeOf(const records::Instance& record) { return record.restored().last_incarnation(); }

// An event that was stored already when the world began again with a checkpoint comes once more with its old number.
bool IsRepeated(const records::GameEvents& head, const v1::ReportedGameEvent& event) {
  return event.tick() <= head.restored_tick() && event.number() <= head.restored_taken();
}

v1::PublishedEvent FromReport(const v1::ReportedGameEvent& reported, Now now) {
  v1::PublishedEvent event;
  *event.mutable_time() = ToTimestamp(now.unix_time);
  event.set_tick(reported.tick());
  event.set_body(reported.body());
  event.set_name(ValidUtf8(reported.name()));
  *event.mutable_values() = DecodeGameFields(reported.values());
  event.set_missed(reported.missed());
  return event;
}

}  // namespace

absl::Status GameEvents::Load() {
  const auto heads = state_.ListStored(kHeads);
  if (!heads.ok()) return heads.status();
  for (const StoreEntry& entry : *heads) {
    Log& log = logs_[NumberOf(entry.key, kHeads)];
    if (ReadRecord(entry, log.head)) {
      log.revision = entry.revision;
      continue;
    }
    log.head.Clear();
    if (absl::Status status = state_.SetAside(entry); !status.ok()) return status;
  }
  for (auto& [number, log] : logs_) {
    const auto events = state_.ListStored(EventsOf(number));
    if (!events.ok()) return events.status();
    for (const StoreEntry& entry : *events) {
      Kept kept;
      kept.revision = entry.revision;
      if (ReadRecord(entry, kept.event)) {
        log.events.push_back(std::move(kept));
      } else if (absl::Status status = state_.SetAside(entry); !status.ok()) {
        return status;
      }
    }
    // Where the head was set aside, the numbers go on from the newest event; some may come a second time.
    if (log.revision == kAbsent && !log.events.empty()) log.head.set_last_event(log.events.back().event.number());
  }
  // A control plane that died while it forgot an instance left them.
  std::vector<std::uint64_t> orphans;
  for (const auto& [number, log] : logs_) {
    if (!state_.instances().contains(number) && state_.set_aside().empty()) orphans.push_back(number);
  }
  for (const std::uint64_t number : orphans) Forget(number);
  for (InstanceEntry& instance : state_.EachInstance()) {
    if (const auto log = logs_.find(instance.number); log != logs_.end()) {
      instance.published_events = log->second.head.last_event();
    }
  }
  return absl::OkStatus();
}

bool GameEvents::Store(InstanceEntry& instance, Log& log, const records::GameEvents& head,
                       std::vector<v1::PublishedEvent> added) {
  std::vector<StoreOp> ops{PutOp(EventHeadKey(instance.number), head.SerializeAsString(), log.revision)};
  for (const v1::PublishedEvent& event : added) {
    ops.push_back(PutOp(EventKey(instance.number, event.number()), event.SerializeAsString(), kAbsent));
  }
  const std::size_t all = log.events.size() + added.size();
  const std::size_t dropped = std::min(log.events.size(), all - std::min(all, kMaxPublishedKept));
  for (std::size_t i = 0; i < dropped; ++i) {
    ops.push_back(DeleteOp(EventKey(instance.number, log.events[i].event.number()), log.events[i].revision));
  }
  const auto written = state_.WriteStored(ops);
  if (!written.ok()) {
    LogTrouble(state_, instance, "events of the game cannot be stored for now", written.status());
    return false;
  }
  log.head = head;
  log.revision = *written;
  log.events.erase(log.events.begin(), log.events.begin() + static_cast<std::ptrdiff_t>(dropped));
  for (v1::PublishedEvent& event : added) log.events.push_back({std::move(event), *written});
  instance.published_events = head.last_event();
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
  return true;
}

void GameEvents::Take(InstanceEntry& instance, const v1::WorkerReport& report, Now now) {
  if (report.game_events().empty() || instance.record.game_hash().empty()) return;
  NoteRestore(instance, now);
  Log& log = logs_[instance.number];
  records::GameEvents head = log.head;
  if (log.revision == kAbsent) head.set_life(LifeOf(instance.record));
  std::vector<v1::PublishedEvent> added;
  for (const v1::ReportedGameEvent& reported : report.game_events()) {
    if (reported.number() <= head.taken()) continue;
    if (added.size() >= kMaxPublishedTaken) break;
    head.set_taken(reported.number());
    if (IsRepeated(head, reported)) continue;
    head.set_last_event(head.last_event() + 1);
    added.push_back(FromReport(reported, now));
    added.back().set_number(head.last_event());
  }
  if (head.taken() != log.head.taken()) Store(instance, log, head, std::move(added));
}

void GameEvents::NoteRestore(InstanceEntry& instance, Now now) {
  const auto found = logs_.find(instance.number);
  if (found == logs_.end() || found->second.revision == kAbsent) return;
  Log& log = found->second;
  if (log.head.life() == LifeOf(instance.record)) return;
  const std::uint64_t tick = instance.record.restored().tick();
  records::GameEvents head = log.head;
  head.set_life(LifeOf(instance.record));
  // Nobody knows which events are in the checkpoints of a life that reported nothing.
  const bool silent = head.taken() == 0 && head.restored_taken() != 0;
  if (silent || tick <= head.restored_tick()) {
    head.set_restored_taken(std::max(head.taken(), head.restored_taken()));
    head.set_restored_tick(std::min(tick, head.restored_tick()));
  } else {
    head.set_restored_taken(head.taken());
    head.set_restored_tick(tick);
  }
  head.set_taken(0);
  head.set_last_event(head.last_event() + 1);
  v1::PublishedEvent notice;
  notice.set_number(head.last_event());
  *notice.mutable_time() = ToTimestamp(now.unix_time);
  notice.set_tick(tick);
  notice.mutable_restored()->set_tick(tick);
  const auto valid = std::find_if(log.events.rbegin(), log.events.rend(),
                                  [tick](const Kept& kept) { return kept.event.tick() <= tick; });
  const std::uint64_t oldest = log.events.empty() ? head.last_event() : log.events.front().event.number();
  notice.mutable_restored()->set_valid_up_to(valid == log.events.rend() ? oldest - 1 : valid->event.number());
  std::vector<v1::PublishedEvent> added;
  added.push_back(std::move(notice));
  Store(instance, log, head, std::move(added));
}

// The regions of a world that began again number events anew, so nothing of an older life is called stored.
std::uint64_t GameEvents::StoredUpTo(const InstanceEntry& instance) const {
  const auto log = logs_.find(instance.number);
  return log == logs_.end() || log->second.head.life() != LifeOf(instance.record) ? 0 : log->second.head.taken();
}

absl::StatusOr<std::vector<v1::PublishedEvent>> GameEvents::After(const InstanceEntry& instance, std::uint64_t number,
                                                                  std::size_t most) const {
  static const Log kNothing;
  const auto found = logs_.find(instance.number);
  const Log& log = found == logs_.end() ? kNothing : found->second;
  if (number > log.head.last_event()) {
    return absl::OutOfRangeError(absl::StrCat("after: there is no event ", number, " of ", instance.record.id(),
                                              ", the newest is ", log.head.last_event()));
  }
  const std::uint64_t oldest = log.events.empty() ? 1 : log.events.front().event.number();
  if (number != 0 && number + 1 < oldest) {
    return absl::OutOfRangeError(absl::StrCat("after: events ", number + 1, " to ", oldest - 1, " of ",
                                              instance.record.id(), " are not kept any more, the oldest is ", oldest));
  }
  const auto first =
      std::ranges::upper_bound(log.events, number, {}, [](const Kept& kept) { return kept.event.number(); });
  std::vector<v1::PublishedEvent> events;
  for (auto kept = first; kept != log.events.end() && events.size() < most; ++kept) events.push_back(kept->event);
  return events;
}

void GameEvents::Forget(std::uint64_t instance) {
  const auto found = logs_.find(instance);
  if (found == logs_.end()) return;
  std::vector<StoreOp> ops;
  for (const Kept& kept : found->second.events) {
    ops.push_back(DeleteOp(EventKey(instance, kept.event.number()), kept.revision));
  }
  if (found->second.revision != kAbsent) ops.push_back(DeleteOp(EventHeadKey(instance), found->second.revision));
  // Records that stay behind are removed when the next control plane starts.
  if (!ops.empty()) state_.WriteStored(ops).IgnoreError();
  logs_.erase(found);
}

}  // namespace tessera::control
