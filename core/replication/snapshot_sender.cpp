#include "core/replication/snapshot_sender.h"

#include <algorithm>
#include <cassert>
#include <cmath>
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
static_assert(kPriorityUnit % Viewer::kMaxPeriod == 0);
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
// Bits of a record with its head that few records have fewer than: by them it is told that all that is due cannot fit.
constexpr double kFewBits = 50;

// How many entries ahead memory is asked for, what others point to first.
constexpr std::size_t kAhead = 12;

}  // namespace

// --- Due entities ----------------------------------------------------------------------------------------------------

// Looks at a dirty entity whose turn may have come; true if it is due.
bool SnapshotSender::Impl::Look(const History& history, const Viewer& viewer, DirtyRef at, Candidate& candidate) {
  const DirtyEntity& body = dirty[at.dirty];
  const HotData& data = history.hot[at.slot];
  const bool full = body.acknowledged.tick == 0, sent_before = body.sent != 0;
  const float distance_squared = viewer.DistanceSquared(data);
  const Viewer::Ring ring = viewer.RingAt(distance_squared);
  turns[at.dirty] = full || !sent_before || at.id == viewer.own() ? SendTurn() : SendTurn(ring, at.slot);
  const bool unchanged = sent_before && std::max(data.since, data.properties_since) <= body.sent;
  if (unchanged) {
    // The client may well have it: a body that has just come to rest is sent twice, then the client has time to answer.
    const bool repeat = !full && !body.repeated;
    if (!repeat && history.now - body.sent < repeat_after) return false;
  }
  const std::uint32_t period = Viewer::Period(ring, thinning);
  const auto waited = static_cast<std::uint16_t>(history.pushes - body.since_push);
  std::uint32_t priority = waited * (kPriorityUnit / period);
  if (!sent_before) priority += (full ? kNewcomer : kOverdue) * kPriorityUnit;
  candidate.id = at.id;
  candidate.dirty = at.dirty;
  candidate.distance_squared = distance_squared;
  candidate.priority = priority;
  candidate.place = RecordCache::kNowhere;
  candidate.repeated = unchanged;
  candidate.new_properties = data.properties_since > body.acknowledged.properties;
  const bool due = priority >= (SendTurn::HasCome(history.pushes, at.slot, period) ? 1 : kOverdue) * kPriorityUnit;
  return due || full || at.id == viewer.own();
}

// Puts the entities at the list's end, which have just become dirty, where their ids belong.
void SnapshotSender::Impl::SortDirtyList() {
  if (sorted_dirty == dirty_list.size()) return;
  const auto by_id = [](const DirtyRef& a, const DirtyRef& b) { return a.id < b.id; };
  unsorted_dirty.assign(dirty_list.begin() + static_cast<std::ptrdiff_t>(sorted_dirty), dirty_list.end());
  std::sort(unsorted_dirty.begin(), unsorted_dirty.end(), by_id);
  // From the end of the list, where there is room.
  auto old = dirty_list.begin() + static_cast<std::ptrdiff_t>(sorted_dirty), to = dirty_list.end();
  for (; !unsorted_dirty.empty(); unsorted_dirty.pop_back()) {
    const auto at = std::lower_bound(dirty_list.begin(), old, unsorted_dirty.back(), by_id);
    to = std::move_backward(at, old, to);
    old = at;
    *--to = unsorted_dirty.back();
  }
}

void SnapshotSender::Impl::Prefetch() const {
  constexpr std::size_t kLine = 64;
  for (std::size_t i = 0; i < turns.size(); i += kLine / sizeof(SendTurn)) __builtin_prefetch(&turns[i]);
  for (std::size_t i = 0; i < dirty_list.size(); i += kLine / sizeof(DirtyRef)) __builtin_prefetch(&dirty_list[i]);
}

void SnapshotSender::Impl::FindCandidates(const History& history, const ClientView& view) {
  const Viewer viewer(view, settings);
  SortDirtyList();
  const SendTurn::Table has_come(history.pushes, thinning);
  looked_at.resize(dirty_list.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < dirty_list.size(); ++i) {
    looked_at[count] = static_cast<std::uint32_t>(i);
    count += has_come[turns[dirty_list[i].dirty]];
  }
  candidates.resize(std::max(candidates.size(), count));  // and they are written where they are to stay
  std::size_t found = 0;
  bool removed = false;
  for (std::size_t i = 0; i < count; ++i) {
    if (i + kAhead < count) {
      const DirtyRef& ahead = dirty_list[looked_at[i + kAhead]];
      __builtin_prefetch(&history.hot[ahead.slot]);
      __builtin_prefetch(&dirty[ahead.dirty], 1);
    }
    const DirtyRef at = dirty_list[looked_at[i]];
    DirtyEntity& body = dirty[at.dirty];
    const HotData& data = history.hot[at.slot];
    const Acknowledged& acknowledged = body.acknowledged;
    const bool had =
        acknowledged.tick != 0 && data.since <= acknowledged.tick && data.properties_since <= acknowledged.properties;
    if (body.use == DirtyEntity::Use::kGone || had) {
      if (body.use != DirtyEntity::Use::kGone) MarkClean(at.dirty);
      body.use = DirtyEntity::Use::kFree;
      free_dirty.Give(at.dirty);
      dirty_list[looked_at[i]].dirty = Entity::kClean;
      removed = true;
      continue;
    }
    if (!Look(history, viewer, at, candidates[found])) continue;
    candidates[found++].key = KeyFor(history, body);
  }
  candidates.resize(found);
  if (removed) std::erase_if(dirty_list, [](const DirtyRef& at) { return at.dirty == Entity::kClean; });
  sorted_dirty = dirty_list.size();
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

// Those that are near, and have waited long, are the most important.
float SnapshotSender::Impl::ScoreOf(const Candidate& candidate) const {
  if (candidate.id == own) return std::numeric_limits<float>::max();
  return static_cast<float>(candidate.priority) / (0.1f + std::sqrt(candidate.distance_squared));
}

// Puts the `most` most important candidates first, in order.
void SnapshotSender::Impl::SortByScore(std::size_t most) {
  order.clear();
  for (const Candidate& candidate : candidates) {
    order.emplace_back(-ScoreOf(candidate), static_cast<std::uint32_t>(order.size()));
  }
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(most, order.size()));
  if (end != order.end()) std::nth_element(order.begin(), end, order.end());
  std::sort(order.begin(), end);
}

// A crowd is shown less often where it is not near, rather than each time another part of it: clients that are sent a
// body at the same snapshots share its record.
void SnapshotSender::Impl::Thin(std::size_t due, std::size_t deferred, bool much_left) {
  const bool crowded = deferred * kMuch > due;
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

// Asks for memory that the candidates after this one will need, what leads there first: keys, then records, or, where
// nobody has packed one yet, slots and then states.
void SnapshotSender::Impl::Ask(const History& history, std::size_t i) {
  const std::size_t count = candidates.size();
  const auto look_up = [&](Candidate& candidate) {
    candidate.place = history.records.Find(candidate.key);
    if (candidate.place != RecordCache::kNowhere) {
      history.records.Prefetch(candidate.place);
    } else {
      history.PrefetchSlot(candidate.key.slot);
    }
  };
  constexpr std::size_t kLookUp = 2 * kAhead / 3, kStates = kAhead / 3;
  if (i == 0) {
    for (std::size_t first = 0; first < std::min(kLookUp, count); ++first) look_up(candidates[first]);
  }
  if (i + kAhead < count) history.records.Prefetch(candidates[i + kAhead].key);
  if (i + kLookUp < count) look_up(candidates[i + kLookUp]);
  if (i + kStates < count && candidates[i + kStates].place == RecordCache::kNowhere) {
    history.PrefetchStates(candidates[i + kStates].key.slot);
  }
}

// Adds the candidate to the chosen ones; the bits that it takes, about.
int SnapshotSender::Impl::Pick(History& history, const ClientView& view, float near, const Candidate& candidate) {
  const RecordCache::Key& key = candidate.key;
  Chosen& body = chosen.emplace_back();
  body.id = candidate.id;
  body.dirty = candidate.dirty;
  body.key = key;
  body.repeated = candidate.repeated;
  body.velocities =
      key.ticks != 0 && (!view.centre.has_value() || candidate.id == view.own || candidate.distance_squared <= near);
  const RecordCache::Place place = history.RecordOf(key, candidate.place, body.velocities);
  body.pose = history.records.pose(place);
  body.bits = 10 + body.pose.bits;
  if (body.velocities) {
    body.velocity = history.records.velocities(place);
    body.bits += body.velocity.bits;
  }
  if (candidate.new_properties) body.properties = history.slots[key.slot].PropertiesFor(view.own, view.team);
  if (body.properties != nullptr) body.bits += 8 * static_cast<int>(body.properties->size()) + 20;
  return body.bits;
}

// Leaves of the chosen ones, which are all candidates, the most important that so many bits hold, and at least one.
void SnapshotSender::Impl::DropLeast(double bits) {
  SortByScore(candidates.size());
  std::size_t kept = 0;
  for (; kept < order.size(); ++kept) {
    bits -= chosen[order[kept].second].bits;
    if (bits < 0 && kept > 0) break;
  }
  for (; kept < order.size(); ++kept) chosen[order[kept].second].dirty = Entity::kClean;
  std::erase_if(chosen, [](const Chosen& body) { return body.dirty == Entity::kClean; });
}

// Chooses the most important candidates that the budget holds, in the order of their ids.
void SnapshotSender::Impl::Choose(History& history, const ClientView& view, WrittenSnapshot& result) {
  chosen.clear();
  const auto most = static_cast<double>(settings.max_datagram_bytes);
  const double usable = most / (kDatagramOverheadBytes + most);
  const double had = std::max(0.0, (allowance_bytes - kDatagramOverheadBytes - 24) * 8 * usable);
  const std::size_t count = candidates.size();
  if (static_cast<double>(count) * kFewBits > had) {
    // They cannot all fit, so only those are looked up that may.
    SortByScore(static_cast<std::size_t>(had / kFewBits) + 1);
    sorted.clear();
    for (const auto& place : order) sorted.push_back(candidates[place.second]);
    std::swap(candidates, sorted);
    candidates.resize(std::min(count, static_cast<std::size_t>(had / kFewBits) + 1));
  }
  const float near = Viewer(view, settings).Squared(settings.velocity_radius_m);
  double bits = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    Ask(history, i);
    bits += Pick(history, view, near, candidates[i]);
  }
  if (bits > had) DropLeast(had);
  result.deferred = static_cast<std::uint32_t>(count - chosen.size());
  for (const Chosen& at : chosen) {
    DirtyEntity& body = dirty[at.dirty];
    body.repeated = at.repeated;
    body.sent = history.now;
    body.since_push = static_cast<std::uint16_t>(history.pushes);
    if (at.key.gap2 == 0) body.acknowledged.gap2 = 0;  // the client forgets a sample that is not referred to any more
    body.acknowledged.unanswered = static_cast<std::uint8_t>(std::min(body.acknowledged.unanswered + 1, 255));
  }
  const double earned = 8 * settings.client_bytes_per_s * view.budget_share / settings.tick_rate_hz;
  Thin(count, result.deferred, bits < 0.5 * earned * static_cast<double>(history.now - history.previous));
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
