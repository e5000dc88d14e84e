#include "core/replication/snapshot_sender.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

namespace tessera::replication {
namespace {

// For how long a client may save up what it was not sent.
constexpr double kBurst_s = 0.1;
// A client that acknowledges none of so many records of a body is told it whole again: it may have let go of the
// baseline (snapshot_receiver.cpp says how many states of one are kept).
constexpr std::uint8_t kMaxUnanswered = 40;
// Where interest has no radius, what distances are measured by.
constexpr double kUnlimitedRadius_m = 100;
// Priorities are whole numbers: so many are one snapshot's wait of a body that is told at each.
constexpr int kPriorityUnit = 4;
// Shares of the radius of interest, and with which of the snapshots bodies within them and beyond are told.
constexpr float kNear = 0.25f, kMiddle = 0.5f;
constexpr std::uint32_t kNearPeriod = 1, kMiddlePeriod = 2, kFarPeriod = 4;
static_assert(std::has_single_bit(kNearPeriod) && std::has_single_bit(kMiddlePeriod) &&
              std::has_single_bit(kFarPeriod) && kPriorityUnit % kFarPeriod == 0);
// Out of turn is told what has waited longer than its period by so much.
constexpr int kOverdue = 2;
// Ahead of what is known already, a body that the client does not know counts as having waited so many snapshots.
constexpr int kNewcomer = 4;
// Departures a snapshot: they are small, but a client may turn away from a whole town at once.
constexpr std::size_t kMaxDepartures = 200;
// Datagrams that wait to be acknowledged, of a client that acknowledges nothing.
constexpr std::size_t kMaxSent = 4096;

// How many entries ahead memory is asked for.
constexpr std::size_t kAhead = 8;

}  // namespace

Eye::Eye(const ClientView& view, const Settings& settings)
    : own(view.own),
      centre(view.centre.value_or(Vec3d())),
      per_radius_squared(static_cast<float>(1 / (settings.interest_radius_m > 0
                                                     ? settings.interest_radius_m * settings.interest_radius_m
                                                     : kUnlimitedRadius_m * kUnlimitedRadius_m))),
      placed(view.centre.has_value()),
      limited(placed && settings.interest_radius_m > 0) {}

std::uint32_t Eye::Period(float shares) const {
  if (!limited || shares <= kNear * kNear) return kNearPeriod;
  return shares <= kMiddle * kMiddle ? kMiddlePeriod : kFarPeriod;
}

// --- What is seen ----------------------------------------------------------------------------------------------------

void SnapshotSender::Impl::Follow(const History& history, const ClientView& view) {
  std::vector<std::uint32_t>& before = seen_before;
  before = window.cells();
  const bool turned = window.Follow(history.grid, settings.interest_radius_m, view.centre);
  const bool missed = pushes_seen + 1 != history.pushes;
  if (pushes_seen == history.pushes && !turned) return;
  pushes_seen = history.pushes;
  if (missed) {
    for (const Known& body : std::vector<Known>(known)) {
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
    ConsiderNews(history, before);  // what has just left a cell that is not seen any more
  }
  ConsiderNews(history, window.cells());
}

void SnapshotSender::Impl::ConsiderNews(const History& history, std::span<const std::uint32_t> cells) {
  fresh.clear();
  for (const std::uint32_t cell : cells) {
    for (const SlotIndex slot : history.cells[cell].news) {
      by_slot.prefetch(slot);
      fresh.push_back(slot);
    }
  }
  for (const SlotIndex slot : fresh) Consider(history, slot);
}

void SnapshotSender::Impl::ConsiderMembers(const History& history, const std::vector<std::uint32_t>& cells) {
  for (const std::uint32_t cell : cells) {
    for (const SlotIndex slot : history.cells[cell].members) Consider(history, slot);
  }
}

void SnapshotSender::Impl::Consider(const History& history, SlotIndex index) {
  const SlotFace& face = history.faces[index];
  const bool seen = face.used() && window.Sees(face.cell);
  const auto found = by_slot.find(index);
  if (found == by_slot.end()) {
    if (seen) Appear(history, index);
    return;
  }
  if (seen && known[found->second].generation == face.generation) return Activate(found->second);
  Depart(history, found->second);
  if (seen) Appear(history, index);
}

void SnapshotSender::Impl::Appear(const History& history, SlotIndex index) {
  const Slot& slot = history.slots[index];
  gone.erase(slot.id);  // its return says it
  if (unused.empty()) {
    unused.push_back(static_cast<std::uint32_t>(known.size()));
    known.emplace_back();
  }
  const std::uint32_t place = unused.back();
  unused.pop_back();
  known[place] = {.id = slot.id,
                  .answered = {},
                  .epoch = slot.epoch,
                  .slot = index,
                  .generation = history.faces[index].generation,
                  .used = true};
  by_slot[index] = place;
  Activate(place);
  busy[known[place].busy].priority = kNewcomer * kPriorityUnit;
}

void SnapshotSender::Impl::Depart(const History& history, std::uint32_t index) {
  Known& body = known[index];
  const SlotFace& face = history.faces[body.slot];
  DepartureRecord record{.id = body.id, .epoch = body.epoch, .to = {}};
  if (face.used() && face.generation == body.generation) {
    record.why = DepartureRecord::Why::kOutOfInterest;
  } else if (const auto found = history.departed.find(body.id); found != history.departed.end()) {
    record = found->second;
  }
  by_slot.erase(body.slot);
  body.used = false;
  if (body.busy != Known::kNowhere) busy[body.busy].use = Busy::Use::kGone;
  unused.push_back(index);
  // It is back already, in another slot.
  const auto other = history.by_id.find(body.id);
  if (other != history.by_id.end() && other->second != body.slot && by_slot.contains(other->second)) return;
  gone.insert_or_assign(record.id, Gone{.record = record, .first_sequence = next_sequence, .sent = {}});
}

void SnapshotSender::Impl::Activate(std::uint32_t index) {
  Known& body = known[index];
  if (body.busy != Known::kNowhere) return;
  if (!idle.Take(body.busy)) {
    body.busy = static_cast<std::uint32_t>(busy.size());
    busy.emplace_back();
  }
  busy[body.busy] = {.answered = body.answered,
                     .slot = body.slot,
                     .known = index,
                     .first_sequence = next_sequence,
                     .priority = kOverdue * kPriorityUnit,  // at once
                     .use = Busy::Use::kSeen};
  active.push_back({body.id, body.busy, body.slot});
}

// The client has its present state. What it did before says nothing of what it will do when it wakes.
void SnapshotSender::Impl::Rest(std::uint32_t place) {
  Known& body = known[busy[place].known];
  body.answered = busy[place].answered;
  body.answered.gap = body.answered.gap2 = 0;
  body.busy = Known::kNowhere;
}

// So that stamps are the history's: it counts from another tick now. What was acknowledged before that is forgotten.
void SnapshotSender::Impl::MoveOrigin(std::uint64_t to) {
  const std::uint64_t by = to - origin;
  origin = to;
  const auto move = [by](Answered& answered) {
    answered.acked = MovedStamp(answered.acked, by, 0);
    answered.properties = MovedStamp(answered.properties, by, 0);
  };
  for (Known& body : known) move(body.answered);
  for (Busy& body : busy) {
    move(body.answered);
    body.sent = MovedStamp(body.sent, by, 0);
  }
}

// --- What is due -----------------------------------------------------------------------------------------------------

bool SnapshotSender::Impl::Due(const History& history, const Eye& eye, BodyId id, Busy& body, float& shares) const {
  const SlotFace& face = history.faces[body.slot];
  const bool whole = body.answered.acked == 0;
  if (body.sent != 0 && std::max(face.since, face.properties_since) <= body.sent) {
    // The client may well have it: what has just come to rest is told twice, then it has time to answer.
    const bool repeat = !whole && !body.repeated;
    if (!repeat && history.now - body.sent < repeat_after) return false;
  }
  shares = eye.Shares(face);
  const std::uint32_t period = eye.Period(shares);
  body.priority =
      static_cast<std::uint16_t>(std::min(body.priority + kPriorityUnit / static_cast<int>(period), 0xffff));
  // All who see a body at one distance are told of it at the same ticks, so that one record serves them.
  const bool in_turn = ((history.pushes + body.slot) & (period - 1)) == 0;
  const bool due = body.priority >= (in_turn ? 1 : kOverdue) * kPriorityUnit;
  return due || whole || id == eye.own;
}

// Puts what began to be active where its id belongs.
void SnapshotSender::Impl::MergeActive() {
  if (sorted_active == active.size()) return;
  const auto by_id = [](const Active& a, const Active& b) { return a.id < b.id; };
  fresh_active.assign(active.begin() + static_cast<std::ptrdiff_t>(sorted_active), active.end());
  std::sort(fresh_active.begin(), fresh_active.end(), by_id);
  // From the end, where there is room.
  std::size_t old = sorted_active, to = active.size();
  for (std::size_t fresh_left = fresh_active.size(); fresh_left > 0;) {
    const bool take_old = old > 0 && by_id(fresh_active[fresh_left - 1], active[old - 1]);
    active[--to] = take_old ? active[--old] : fresh_active[--fresh_left];
  }
}

void SnapshotSender::Impl::Prefetch() const {
  for (const Active& body : active) __builtin_prefetch(&busy[body.busy], 1);
}

void SnapshotSender::Impl::FindCandidates(const History& history, const ClientView& view) {
  const Eye eye(view, settings);
  MergeActive();
  candidates.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (i + kAhead < active.size()) __builtin_prefetch(&history.faces[active[i + kAhead].slot]);
    const Active at = active[i];
    Busy& body = busy[at.busy];
    const SlotFace& face = history.faces[at.slot];
    const Answered& answered = body.answered;
    const bool had =
        answered.acked != 0 && face.since <= answered.acked && face.properties_since <= answered.properties;
    if (body.use == Busy::Use::kGone || had) {
      if (body.use != Busy::Use::kGone) Rest(at.busy);
      body.use = Busy::Use::kFree;
      idle.Give(at.busy);
      continue;
    }
    active[kept++] = at;
    float shares = 0;
    if (!Due(history, eye, at.id, body, shares)) continue;
    candidates.push_back({at.id, at.busy, shares, KeyFor(history, body)});
    history.records.Prefetch(candidates.back().key);
  }
  active.resize(kept);
  sorted_active = kept;
}

RecordCache::Key SnapshotSender::Impl::KeyFor(const History& history, const Busy& body) {
  const RecordCache::Key whole{.slot = body.slot};
  const SlotFace& face = history.faces[body.slot];
  const Answered& had = body.answered;
  if (had.acked == 0 || had.acked < face.oldest || had.unanswered >= kMaxUnanswered) return whole;
  const Stamp ticks = history.now - had.acked;
  if (ticks >> RecordCache::Key::kTickBits != 0) return whole;
  RecordCache::Key key{.slot = body.slot, .ticks = ticks};
  if (had.gap == 0 || had.acked < face.oldest + had.gap) return key;
  key.gap = had.gap;
  if (face.falls && had.gap2 != 0 && had.acked >= face.oldest + had.gap + had.gap2) key.gap2 = had.gap2;
  return key;
}

void SnapshotSender::Impl::EarnBudget(const History& history, const ClientView& view) {
  const double rate = settings.client_bytes_per_s * view.budget_share;
  const double elapsed_s =
      told_tick.has_value() ? static_cast<double>(history.tick - *told_tick) / settings.tick_rate_hz : kBurst_s;
  const double most = std::max(rate * kBurst_s, 2 * static_cast<double>(settings.max_datagram_bytes));
  // What had to go out beyond the budget is owed, but not for ever: the share may be another by now.
  allowance_bytes = std::clamp(allowance_bytes + rate * elapsed_s, -most, most);
}

// --- What is told ----------------------------------------------------------------------------------------------------

// Those that matter most first: by distance, and by how long they have waited.
void SnapshotSender::Impl::SortByScore(BodyId own) {
  std::vector<std::pair<float, std::uint32_t>> order;  // score, and which
  order.reserve(candidates.size());
  for (const Candidate& candidate : candidates) {
    const float score = candidate.id == own ? std::numeric_limits<float>::max()
                                            : busy[candidate.busy].priority / (0.1f + std::sqrt(candidate.shares));
    order.emplace_back(-score, static_cast<std::uint32_t>(order.size()));
  }
  std::sort(order.begin(), order.end());
  std::vector<Candidate> sorted;
  sorted.reserve(candidates.size());
  for (const auto& place : order) sorted.push_back(candidates[place.second]);
  candidates = std::move(sorted);
}

// The candidates that the budget holds, those that matter most first; then in the order of their ids.
void SnapshotSender::Impl::Choose(History& history, const ClientView& view, WrittenSnapshot& result) {
  chosen.clear();
  const auto most = static_cast<double>(settings.max_datagram_bytes);
  const double usable = most / (kDatagramOverheadBytes + most);
  double bits_left = std::max(0.0, (allowance_bytes - kDatagramOverheadBytes - 24) * 8 * usable);
  constexpr double kLikelyBits = 120;
  if (static_cast<double>(candidates.size()) * kLikelyBits > bits_left) SortByScore(view.own);
  const double near = settings.velocity_radius_m * settings.velocity_radius_m;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i + kAhead < candidates.size()) history.PrefetchSlot(candidates[i + kAhead].key);
    if (i + kAhead / 2 < candidates.size()) history.PrefetchStates(candidates[i + kAhead / 2].key);
    const BodyId id = candidates[i].id;
    Busy& body = busy[candidates[i].busy];
    const SlotFace& face = history.faces[body.slot];
    const RecordCache::Key& key = candidates[i].key;
    const bool velocities = key.ticks != 0 && (!view.centre.has_value() || id == view.own ||
                                               LengthSquared(Vec3d(face.position) - *view.centre) <= near);
    const RecordCache::Entry& record = history.RecordOf(key, velocities);
    const Bytes* properties =
        face.properties_since > body.answered.properties ? history.slots[body.slot].properties.get() : nullptr;
    if (properties != nullptr) bits_left -= 8 * static_cast<double>(properties->size()) + 20;
    bits_left -= 10 + record.pose_bits + (velocities ? record.velocity_bits : 0);
    if (bits_left < 0 && !chosen.empty()) {
      result.deferred = static_cast<std::uint32_t>(candidates.size() - i);
      break;
    }
    chosen.push_back({id, candidates[i].busy, velocities, key, record.pose(), record.velocities(), properties});
    body.repeated = body.sent != 0 && std::max(face.since, face.properties_since) <= body.sent;
    body.sent = history.now;
    if (key.gap2 == 0) body.answered.gap2 = 0;  // the client lets go of what is not referred to any more
    body.priority = 0;
    body.answered.unanswered = static_cast<std::uint8_t>(std::min(body.answered.unanswered + 1, 255));
  }
  const auto by_id = [](const Chosen& a, const Chosen& b) { return a.id < b.id; };
  if (!std::is_sorted(chosen.begin(), chosen.end(), by_id)) std::sort(chosen.begin(), chosen.end(), by_id);
}

std::vector<DepartureRecord> SnapshotSender::Impl::DueDepartures(const History& history) {
  std::vector<DepartureRecord> due;
  for (auto& [id, body] : gone) {
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
    sent.push_back({tick, std::move(datagram.known), std::move(datagram.departures)});
    datagram.known.clear();
    if (!spare.empty()) {
      datagram.known = std::move(spare.back());
      spare.pop_back();
    }
    ++next_sequence;
  }
  while (sent.size() > kMaxSent) ForgetOldest();
}

void SnapshotSender::Impl::ForgetOldest() {
  std::vector<std::uint32_t>& known_in_it = sent.front().told;
  if (known_in_it.capacity() > 0 && spare.size() < 8) {
    known_in_it.clear();
    spare.push_back(std::move(known_in_it));
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
  const bool silent = told_tick.has_value() && history.tick < *told_tick + settings.idle_ticks;
  if (silent && candidates.empty() && departures.empty() && last_input == told_input && margin == told_margin) {
    return result;
  }
  EarnBudget(history, view);
  Choose(history, view, result);
  told_tick = history.tick;
  told_input = last_input;
  told_margin = margin;
  writer.Begin({.fingerprint = history.quantizer.fingerprint(),
                .sequence = next_sequence,
                .tick = history.tick,
                .last_input = last_input,
                .input_margin_ticks = margin});
  for (const DepartureRecord& departure : departures) writer.Departure(departure);
  bool all_whole = !chosen.empty();
  for (const Chosen& body : chosen) {
    const SampleTicks samples{body.key.ticks, body.key.gap, body.key.gap2};
    all_whole = all_whole && samples.ticks == 0;
    writer.Body({body.id, body.busy, samples, history.records.View(body.pose),
                 body.velocities ? history.records.View(body.velocity) : PackedView(), body.properties});
  }
  result.full = all_whole;
  result.bodies = static_cast<std::uint32_t>(chosen.size());
  Remember(writer.Finish(), history.tick, result);
  return result;
}

// --- Outside ---------------------------------------------------------------------------------------------------------

SnapshotSender::SnapshotSender(const Settings& settings) : impl_(std::make_unique<Impl>(settings)) {}
SnapshotSender::~SnapshotSender() = default;
SnapshotSender::SnapshotSender(SnapshotSender&&) noexcept = default;
SnapshotSender& SnapshotSender::operator=(SnapshotSender&&) noexcept = default;

WrittenSnapshot SnapshotSender::Write(const SnapshotHistory& history, const ClientView& view, std::uint32_t last_input,
                                      std::int32_t input_margin_ticks) {
  assert(history.impl_->pushes > 0);
  return impl_->Write(*history.impl_, view, last_input, input_margin_ticks);
}

void SnapshotSender::Prefetch() const { impl_->Prefetch(); }

}  // namespace tessera::replication
