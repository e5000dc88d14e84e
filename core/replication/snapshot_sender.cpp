#include "core/replication/snapshot_sender.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/replication/datagram.h"
#include "core/replication/snapshot_sender_impl.h"
#include "core/world/bytes.h"

namespace tessera::replication {
namespace {

// A client may save up this much of its unused budget.
constexpr double kBurst_s = 0.1;
// A body is sent as a full record again when so many of its records were not acknowledged: the client may have
// dropped the baseline (snapshot_receiver.cpp says how many states of one are kept).
constexpr std::uint8_t kMaxUnanswered = 40;
// Priorities are whole numbers: a body that is sent with each snapshot gains this much a snapshot.
constexpr int kPriorityUnit = 16;
static_assert(kPriorityUnit % (Viewer::kFarPeriod << Viewer::kMaxThinning) == 0);
// A body is sent out of turn when it has waited so many times its period.
constexpr int kOverdue = 2;
// A body that the client does not have goes ahead of others, as if it had waited so many snapshots.
constexpr int kNewcomer = 4;
// Departures a snapshot: they are small, but a client may turn away from a whole town at once.
constexpr std::size_t kMaxDepartures = 200;
// Datagrams kept for a client that acknowledges nothing.
constexpr std::size_t kMaxSent = 4096;
constexpr std::size_t kAckBytes = 12;

// So many snapshots in a row leave out more than an eighth of what is due, or use less than half of the budget, before
// bodies that are not near are sent half as often, or twice.
constexpr std::uint32_t kThinAfter = 4, kThickenAfter = 20;
constexpr std::size_t kMuch = 8;
// Bits of a record with its head, by which it is told whether all that is due may fit, and how much of it to sort.
constexpr double kLikelyBits = 120, kFewBits = 50;

// How many entries ahead memory is asked for.
constexpr std::size_t kAhead = 8;

}  // namespace

// --- Entities --------------------------------------------------------------------------------------------------------

void SnapshotSender::Impl::Follow(const History& history, const ClientView& view) {
  std::vector<std::uint32_t>& before = seen_before;
  before = window.cells();
  const bool turned = window.Follow(history.grid, settings.interest_radius_m, view.centre);
  const bool viewer_changed = view.own != own || view.team != team;
  if (viewer_changed) ChangeViewer(view);
  const bool missed = viewer_changed || pushes_seen + 1 != history.pushes;
  if (pushes_seen == history.pushes && !turned && !viewer_changed) return;
  pushes_seen = history.pushes;
  if (missed) {
    for (const Entity& body : std::vector<Entity>(entities)) {
      if (body.used) Consider(history, body.slot);
    }
    ConsiderMembers(history, window.cells());
    return;
  }
  if (turned) {
    std::vector<std::uint32_t> other;
    std::set_symmetric_difference(before.begin(), before.end(), window.cells().begin(), window.cells().end(),
                                  std::back_inserter(other));
    ConsiderMembers(history, other);
    ConsiderDirty(history, before);  // bodies that have just left a cell that is not seen any more
  }
  ConsiderDirty(history, window.cells());
}

// Other bodies may be seen, and others' properties: all that the client sees is told anew.
void SnapshotSender::Impl::ChangeViewer(const ClientView& view) {
  own = view.own;
  team = view.team;
  for (Entity& body : entities) {
    if (!body.used) continue;
    body.acknowledged.properties = 0;
    if (body.dirty != Entity::kClean) dirty[body.dirty].acknowledged.properties = 0;
  }
}

void SnapshotSender::Impl::ConsiderDirty(const History& history, std::span<const std::uint32_t> cells) {
  considered.clear();
  for (const std::uint32_t cell : cells) {
    for (const SlotIndex slot : history.cells[cell].dirty) {
      by_slot.prefetch(slot);
      considered.push_back(slot);
    }
  }
  for (const SlotIndex slot : considered) Consider(history, slot);
}

void SnapshotSender::Impl::ConsiderMembers(const History& history, const std::vector<std::uint32_t>& cells) {
  for (const std::uint32_t cell : cells) {
    for (const SlotIndex slot : history.cells[cell].members) Consider(history, slot);
  }
}

void SnapshotSender::Impl::Consider(const History& history, SlotIndex index) {
  const HotData& data = history.hot[index];
  const bool seen = data.used() && window.Sees(data.cell) && history.MaySee(index, own, team);
  const auto found = by_slot.find(index);
  if (found == by_slot.end()) {
    if (seen) Appear(history, index);
    return;
  }
  if (seen && entities[found->second].generation == data.generation) return MarkDirty(found->second);
  Depart(history, found->second);
  if (seen) Appear(history, index);
}

void SnapshotSender::Impl::Appear(const History& history, SlotIndex slot_index) {
  const Slot& slot = history.slots[slot_index];
  pending_departures.erase(slot.id);  // its return makes the departure void
  if (free_entities.empty()) {
    free_entities.push_back(static_cast<std::uint32_t>(entities.size()));
    entities.emplace_back();
  }
  const std::uint32_t index = free_entities.back();
  free_entities.pop_back();
  entities[index] = {.id = slot.id,
                     .acknowledged = {},
                     .epoch = slot.epoch,
                     .slot = slot_index,
                     .generation = history.hot[slot_index].generation,
                     .used = true};
  by_slot[slot_index] = index;
  MarkDirty(index);
  dirty[entities[index].dirty].priority = kNewcomer * kPriorityUnit;
}

void SnapshotSender::Impl::Depart(const History& history, std::uint32_t index) {
  Entity& body = entities[index];
  DepartureRecord record{.id = body.id, .epoch = body.epoch, .to = {}};
  const auto other = history.by_id.find(body.id);
  if (other != history.by_id.end() && history.slots[other->second].epoch == body.epoch) {
    record.why = DepartureRecord::Why::kOutOfInterest;
  } else if (const auto found = history.departed.find(body.id); found != history.departed.end()) {
    record = found->second;
  }
  by_slot.erase(body.slot);
  body.used = false;
  if (body.dirty != Entity::kClean) dirty[body.dirty].use = DirtyEntity::Use::kGone;
  free_entities.push_back(index);
  // No departure is sent of a body that is back already, in another slot.
  if (other != history.by_id.end() && other->second != body.slot && by_slot.contains(other->second)) return;
  pending_departures.insert_or_assign(record.id,
                                      PendingDeparture{.record = record, .first_sequence = next_sequence, .sent = {}});
}

void SnapshotSender::Impl::MarkDirty(std::uint32_t index) {
  Entity& body = entities[index];
  if (body.dirty != Entity::kClean) return;
  if (!free_dirty.Take(body.dirty)) {
    body.dirty = static_cast<std::uint32_t>(dirty.size());
    dirty.emplace_back();
  }
  dirty[body.dirty] = {.acknowledged = body.acknowledged,
                       .slot = body.slot,
                       .entity = index,
                       .first_sequence = next_sequence,
                       .priority = kOverdue * kPriorityUnit,  // at once
                       .use = DirtyEntity::Use::kSeen};
  dirty_list.push_back({body.id, body.dirty, body.slot});
}

// The client has its present state. Its past motion does not predict how it will move when it wakes.
void SnapshotSender::Impl::MarkClean(std::uint32_t dirty_index) {
  Entity& body = entities[dirty[dirty_index].entity];
  body.acknowledged = dirty[dirty_index].acknowledged;
  body.acknowledged.gap = body.acknowledged.gap2 = 0;
  body.dirty = Entity::kClean;
}

// Follows the history to its new origin of stamps. Acknowledgements of earlier ticks are forgotten.
void SnapshotSender::Impl::MoveOrigin(std::uint64_t to) {
  const std::uint64_t by = to - origin;
  origin = to;
  const auto move = [by](Acknowledged& acknowledged) {
    acknowledged.tick = MovedStamp(acknowledged.tick, by, 0);
    acknowledged.properties = MovedStamp(acknowledged.properties, by, 0);
  };
  for (Entity& body : entities) move(body.acknowledged);
  for (DirtyEntity& body : dirty) {
    move(body.acknowledged);
    body.sent = MovedStamp(body.sent, by, 0);
  }
}

// --- Due entities ----------------------------------------------------------------------------------------------------

bool SnapshotSender::Impl::Due(const History& history, const Viewer& viewer, BodyId id, DirtyEntity& body,
                               float& distance_squared) const {
  const HotData& data = history.hot[body.slot];
  const bool full = body.acknowledged.tick == 0;
  if (body.sent != 0 && std::max(data.since, data.properties_since) <= body.sent) {
    // The client may well have it: a body that has just come to rest is sent twice, then the client has time to answer.
    const bool repeat = !full && !body.repeated;
    if (!repeat && history.now - body.sent < repeat_after) return false;
  }
  distance_squared = viewer.DistanceSquared(data);
  const std::uint32_t period = viewer.Period(distance_squared, thinning);
  body.priority =
      static_cast<std::uint16_t>(std::min(body.priority + kPriorityUnit / static_cast<int>(period), 0xffff));
  // All clients that see a body at one distance are sent it at the same ticks, so that one record serves them.
  const bool in_turn = ((history.pushes + body.slot) & (period - 1)) == 0;
  const bool due = body.priority >= (in_turn ? 1 : kOverdue) * kPriorityUnit;
  return due || full || id == viewer.own();
}

// Puts the entities at the list's end, which have just become dirty, where their ids belong.
void SnapshotSender::Impl::SortDirtyList() {
  if (sorted_dirty == dirty_list.size()) return;
  const auto by_id = [](const DirtyRef& a, const DirtyRef& b) { return a.id < b.id; };
  unsorted_dirty.assign(dirty_list.begin() + static_cast<std::ptrdiff_t>(sorted_dirty), dirty_list.end());
  std::sort(unsorted_dirty.begin(), unsorted_dirty.end(), by_id);
  // From the end of the list, where there is room.
  std::size_t old = sorted_dirty, to = dirty_list.size();
  for (std::size_t unsorted_left = unsorted_dirty.size(); unsorted_left > 0;) {
    const bool take_old = old > 0 && by_id(unsorted_dirty[unsorted_left - 1], dirty_list[old - 1]);
    dirty_list[--to] = take_old ? dirty_list[--old] : unsorted_dirty[--unsorted_left];
  }
}

void SnapshotSender::Impl::Prefetch() const {
  for (const DirtyRef& body : dirty_list) __builtin_prefetch(&dirty[body.dirty], 1);
}

void SnapshotSender::Impl::FindCandidates(const History& history, const ClientView& view) {
  const Viewer viewer(view, settings);
  SortDirtyList();
  candidates.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < dirty_list.size(); ++i) {
    if (i + kAhead < dirty_list.size()) __builtin_prefetch(&history.hot[dirty_list[i + kAhead].slot]);
    const DirtyRef at = dirty_list[i];
    DirtyEntity& body = dirty[at.dirty];
    const HotData& data = history.hot[at.slot];
    const Acknowledged& acknowledged = body.acknowledged;
    const bool had =
        acknowledged.tick != 0 && data.since <= acknowledged.tick && data.properties_since <= acknowledged.properties;
    if (body.use == DirtyEntity::Use::kGone || had) {
      if (body.use != DirtyEntity::Use::kGone) MarkClean(at.dirty);
      body.use = DirtyEntity::Use::kFree;
      free_dirty.Give(at.dirty);
      continue;
    }
    dirty_list[kept++] = at;
    float distance_squared = 0;
    if (!Due(history, viewer, at.id, body, distance_squared)) continue;
    candidates.push_back({at.id, at.dirty, distance_squared, KeyFor(history, body)});
    history.records.Prefetch(candidates.back().key);
  }
  dirty_list.resize(kept);
  sorted_dirty = kept;
}

RecordCache::Key SnapshotSender::Impl::KeyFor(const History& history, const DirtyEntity& body) {
  const RecordCache::Key full{.slot = body.slot};
  const HotData& data = history.hot[body.slot];
  const Acknowledged& had = body.acknowledged;
  if (had.tick == 0 || had.tick < data.oldest || had.unanswered >= kMaxUnanswered) return full;
  const Stamp ticks = history.now - had.tick;
  if (ticks >> RecordCache::Key::kTickBits != 0) return full;
  RecordCache::Key key{.slot = body.slot, .ticks = ticks};
  if (had.gap == 0 || had.tick < data.oldest + had.gap) return key;
  key.gap = had.gap;
  if (data.falls && had.gap2 != 0 && had.tick >= data.oldest + had.gap + had.gap2) key.gap2 = had.gap2;
  return key;
}

void SnapshotSender::Impl::EarnBudget(const History& history, const ClientView& view) {
  const double rate = settings.client_bytes_per_s * view.budget_share;
  const double elapsed_s =
      sent_tick.has_value() ? static_cast<double>(history.tick - *sent_tick) / settings.tick_rate_hz : kBurst_s;
  const double most = std::max(rate * kBurst_s, 2 * static_cast<double>(settings.max_datagram_bytes));
  // Bytes sent beyond the budget are owed, but within limits: the share may have changed by now.
  allowance_bytes = std::clamp(allowance_bytes + rate * elapsed_s, -most, most);
}

// --- Writing ---------------------------------------------------------------------------------------------------------

// Puts the `most` most important candidates first, in order: those that are near, and have waited long.
void SnapshotSender::Impl::SortByScore(std::size_t most) {
  order.clear();
  for (const Candidate& candidate : candidates) {
    const float score = candidate.id == own
                            ? std::numeric_limits<float>::max()
                            : dirty[candidate.dirty].priority / (0.1f + std::sqrt(candidate.distance_squared));
    order.emplace_back(-score, static_cast<std::uint32_t>(order.size()));
  }
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(most, order.size()));
  if (end != order.end()) std::nth_element(order.begin(), end, order.end());
  std::sort(order.begin(), end);
  sorted.clear();
  for (const auto& place : order) sorted.push_back(candidates[place.second]);
  std::swap(candidates, sorted);
}

// A crowd is shown less often where it is not near, rather than each time another part of it: clients that are sent a
// body at the same snapshots share its record.
void SnapshotSender::Impl::Thin(std::size_t deferred, bool much_left) {
  const bool crowded = deferred * kMuch > candidates.size();
  crowded_for = crowded ? crowded_for + 1 : 0;
  idle_for = !crowded && deferred == 0 && much_left ? idle_for + 1 : 0;
  if (crowded_for >= kThinAfter && thinning < Viewer::kMaxThinning) {
    ++thinning;
    crowded_for = 0;
  } else if (idle_for >= kThickenAfter && thinning > 0) {
    --thinning;
    idle_for = 0;
  }
}

// Chooses the most important candidates that the budget holds, and puts them in the order of their ids.
void SnapshotSender::Impl::Choose(History& history, const ClientView& view, WrittenSnapshot& result) {
  chosen.clear();
  const auto most = static_cast<double>(settings.max_datagram_bytes);
  const double usable = most / (kDatagramOverheadBytes + most);
  double bits_left = std::max(0.0, (allowance_bytes - kDatagramOverheadBytes - 24) * 8 * usable);
  const double had = bits_left;
  if (static_cast<double>(candidates.size()) * kLikelyBits > bits_left) {
    SortByScore(static_cast<std::size_t>(bits_left / kFewBits) + 1);
  }
  const double near = settings.velocity_radius_m * settings.velocity_radius_m;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i + kAhead < candidates.size()) history.PrefetchSlot(candidates[i + kAhead].key);
    if (i + kAhead / 2 < candidates.size()) history.PrefetchStates(candidates[i + kAhead / 2].key);
    const BodyId id = candidates[i].id;
    DirtyEntity& body = dirty[candidates[i].dirty];
    const HotData& data = history.hot[body.slot];
    const RecordCache::Key& key = candidates[i].key;
    const bool velocities = key.ticks != 0 && (!view.centre.has_value() || id == view.own ||
                                               LengthSquared(Vec3d(data.position) - *view.centre) <= near);
    const RecordCache::Entry& record = history.RecordOf(key, velocities);
    const Bytes* properties = data.properties_since > body.acknowledged.properties
                                  ? history.slots[body.slot].PropertiesFor(view.own, view.team)
                                  : nullptr;
    if (properties != nullptr) bits_left -= 8 * static_cast<double>(properties->size()) + 20;
    bits_left -= 10 + record.pose_bits + (velocities ? record.velocity_bits : 0);
    if (bits_left < 0 && !chosen.empty()) {
      result.deferred = static_cast<std::uint32_t>(candidates.size() - i);
      break;
    }
    chosen.push_back({id, candidates[i].dirty, velocities, key, record.pose(), record.velocities(), properties});
    body.repeated = body.sent != 0 && std::max(data.since, data.properties_since) <= body.sent;
    body.sent = history.now;
    if (key.gap2 == 0) body.acknowledged.gap2 = 0;  // the client forgets a sample that is not referred to any more
    body.priority = 0;
    body.acknowledged.unanswered = static_cast<std::uint8_t>(std::min(body.acknowledged.unanswered + 1, 255));
  }
  const double earned = 8 * settings.client_bytes_per_s * view.budget_share / settings.tick_rate_hz;
  Thin(result.deferred, had - bits_left < 0.5 * earned * static_cast<double>(history.now - history.previous));
  const auto by_id = [](const Chosen& a, const Chosen& b) { return a.id < b.id; };
  if (!std::is_sorted(chosen.begin(), chosen.end(), by_id)) std::sort(chosen.begin(), chosen.end(), by_id);
}

std::vector<DepartureRecord> SnapshotSender::Impl::DueDepartures(const History& history) {
  std::vector<DepartureRecord> due;
  for (auto& [id, body] : pending_departures) {
    if (due.size() >= kMaxDepartures) break;
    if (body.sent.has_value() && static_cast<std::uint64_t>(history.tick - *body.sent) < repeat_after) continue;
    body.sent = history.tick;
    due.push_back(body.record);
  }
  return due;
}

void SnapshotSender::Impl::Remember(std::span<WrittenDatagram> datagrams, Tick tick, WrittenSnapshot& result) {
  result.datagrams.reserve(datagrams.size());
  for (WrittenDatagram& datagram : datagrams) {
    allowance_bytes -= static_cast<double>(datagram.bytes.size()) + kDatagramOverheadBytes;
    result.datagrams.push_back(std::move(datagram.bytes));
    sent.push_back({tick, std::move(datagram.bodies), std::move(datagram.departures)});
    datagram.bodies.clear();
    if (!spare.empty()) {
      datagram.bodies = std::move(spare.back());
      spare.pop_back();
    }
    ++next_sequence;
  }
  while (sent.size() > kMaxSent) ForgetOldest();
}

void SnapshotSender::Impl::ForgetOldest() {
  std::vector<std::uint32_t>& bodies = sent.front().bodies;
  if (bodies.capacity() > 0 && spare.size() < 8) {
    bodies.clear();
    spare.push_back(std::move(bodies));
  }
  sent.pop_front();
}

WrittenSnapshot SnapshotSender::Impl::Write(History& history, const ClientView& view, std::uint32_t last_input,
                                            std::int32_t margin) {
  WrittenSnapshot result;
  Prefetch();
  if (origin != history.origin) MoveOrigin(history.origin);
  repeat_after = static_cast<std::uint64_t>(round_trip_ticks * 1.25) + 2;
  Follow(history, view);
  FindCandidates(history, view);
  const std::vector<DepartureRecord> departures = DueDepartures(history);
  const bool silent = sent_tick.has_value() && history.tick < *sent_tick + settings.idle_ticks;
  if (silent && candidates.empty() && departures.empty() && last_input == sent_input && margin == sent_margin) {
    return result;
  }
  EarnBudget(history, view);
  Choose(history, view, result);
  sent_tick = history.tick;
  sent_input = last_input;
  sent_margin = margin;
  writer.Begin({.fingerprint = history.quantizer.fingerprint(),
                .sequence = next_sequence,
                .tick = history.tick,
                .last_input = last_input,
                .input_margin_ticks = margin});
  for (const DepartureRecord& departure : departures) writer.Departure(departure);
  result.full = !chosen.empty();
  for (const Chosen& body : chosen) {
    const SampleTicks samples{body.key.ticks, body.key.gap, body.key.gap2};
    result.full = result.full && samples.ticks == 0;
    writer.Body({body.id, body.dirty, samples, history.records.View(body.pose),
                 body.velocities ? history.records.View(body.velocity) : PackedView(), body.properties});
  }
  result.bodies = static_cast<std::uint32_t>(chosen.size());
  Remember(writer.Finish(), history.tick, result);
  return result;
}

// --- Outside ---------------------------------------------------------------------------------------------------------

SnapshotSender::SnapshotSender(const SnapshotSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
SnapshotSender::~SnapshotSender() = default;
SnapshotSender::SnapshotSender(SnapshotSender&&) noexcept = default;
SnapshotSender& SnapshotSender::operator=(SnapshotSender&&) noexcept = default;

WrittenSnapshot SnapshotSender::Write(const SnapshotHistory& history, const ClientView& view, std::uint32_t last_input,
                                      std::int32_t input_margin_ticks) {
  assert(history.impl_->pushes > 0);
  return impl_->Write(*history.impl_, view, last_input, input_margin_ticks);
}

absl::Status SnapshotSender::Acknowledge(std::span<const std::uint8_t> ack) {
  if (ack.empty()) return absl::OkStatus();  // nothing has come yet
  if (ack.size() != kAckBytes) {
    return absl::InvalidArgumentError(absl::StrCat("ack: ", ack.size(), " bytes instead of ", kAckBytes));
  }
  ByteReader in(ack);
  const std::uint32_t newest = in.U32();
  return impl_->Acknowledge(newest, in.U64());
}

void SnapshotSender::Prefetch() const { impl_->Prefetch(); }

}  // namespace tessera::replication
