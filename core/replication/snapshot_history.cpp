#include "core/replication/snapshot_history.h"

#include <algorithm>
#include <cassert>

#include "core/replication/record_codec.h"

namespace tessera::replication {
namespace {

// More than a year at 60 ticks a second; and so many are kept when they have run out: almost five hours.
constexpr std::uint64_t kLastStamp = std::uint64_t{1} << 31, kKeptStamps = std::uint64_t{1} << 20;

}  // namespace

// --- Slots -----------------------------------------------------------------------------------------------------------

const QuantizedState* Slot::At(Stamp tick) const {
  std::size_t at = newest;
  for (std::size_t left = ticks.size(); left > 0; --left) {
    if (ticks[at] <= tick) return &states[at];
    at = at == 0 ? ticks.size() - 1 : at - 1;
  }
  return nullptr;
}

void SnapshotHistory::Impl::Begin(Tick at) {
  assert(pushes == 0 || at > tick);
  if (pushes == 0) origin = at.value();
  tick = at;
  if (tick.value() - origin > kLastStamp) MoveOrigin();
  previous = now;
  now = StampOf(tick);
  ++pushes;
  for (const std::uint32_t cell : noted) cells[cell].news.clear();
  noted.clear();
  records.Begin();
}

// So that the new tick has a stamp. What is older than kKeptStamps all counts as of then.
void SnapshotHistory::Impl::MoveOrigin() {
  const std::uint64_t by = tick.value() - kKeptStamps - origin;
  const auto move = [by](Stamp& stamp) { stamp = MovedStamp(stamp, by, stamp == 0 ? 0 : 1); };
  for (SlotFace& face : faces) {
    for (Stamp* stamp : {&face.since, &face.oldest, &face.properties_since}) move(*stamp);
  }
  for (Slot& slot : slots) {
    for (Stamp& stamp : slot.ticks) move(stamp);
  }
  now = MovedStamp(now, by, 0);  // nothing counts as of then alone
  origin += by;
}

// Whether its last three states are on a parabola. Where they are not, no client is told by its third sample, and more
// of them share a record.
bool SnapshotHistory::Impl::Falls(const Slot& slot) const {
  const std::size_t kept = slot.ticks.size();
  if (kept < 3) return false;
  const std::size_t older = (slot.newest + kept - 1) % kept, oldest = (slot.newest + kept - 2) % kept;
  return predictor.Falls({.base = &slot.states[slot.newest],
                          .older = &slot.states[older],
                          .oldest = &slot.states[oldest],
                          .ticks = 1,
                          .gap = slot.ticks[slot.newest] - slot.ticks[older],
                          .gap2 = slot.ticks[older] - slot.ticks[oldest]});
}

void SnapshotHistory::Impl::Note(std::uint32_t cell, SlotIndex index) {
  if (cells[cell].news.empty()) noted.push_back(cell);
  cells[cell].news.push_back(index);
}

void SnapshotHistory::Impl::Enter(SlotIndex index, std::uint32_t cell) {
  faces[index].cell = static_cast<std::uint16_t>(cell);
  slots[index].place_in_cell = static_cast<std::uint32_t>(cells[cell].members.size());
  cells[cell].members.push_back(index);
  Note(cell, index);
}

void SnapshotHistory::Impl::Leave(SlotIndex index) {
  std::uint16_t& cell = faces[index].cell;
  const std::uint32_t place = slots[index].place_in_cell;
  std::vector<SlotIndex>& members = cells[cell].members;
  members[place] = members.back();
  slots[members.back()].place_in_cell = place;
  members.pop_back();
  Note(cell, index);
  cell = SlotFace::kNowhere;
}

SlotIndex SnapshotHistory::Impl::Take(const BodyRecord& body, const QuantizedState& state) {
  if (free.empty()) {
    assert(slots.size() < std::size_t{1} << RecordCache::Key::kSlotBits);
    free.push_back(static_cast<SlotIndex>(slots.size()));
    slots.emplace_back();
    faces.emplace_back();
  }
  const SlotIndex index = free.back();
  free.pop_back();
  slots[index] = {.id = body.id, .epoch = body.epoch, .ticks = {now}, .states = {state}, .properties = nullptr};
  const Vec3d position = quantizer.PositionOf(state);
  faces[index] = {.since = now, .oldest = now, .position = Vec3f(position), .generation = faces[index].generation + 1};
  by_id[body.id] = index;
  departed.erase(body.id);
  Enter(index, grid.CellAt(position, std::nullopt));
  return index;
}

void SnapshotHistory::Impl::Change(SlotIndex index, const QuantizedState& state) {
  Slot& slot = slots[index];
  SlotFace& face = faces[index];
  const bool had_changed = face.since == previous;
  const std::size_t next = slot.newest + 1;
  if (next == slot.ticks.size() && next < settings.history_ticks) {
    slot.ticks.push_back(now);
    slot.states.push_back(state);
    slot.newest = next;
  } else {
    slot.newest = next % slot.ticks.size();
    slot.ticks[slot.newest] = now;
    slot.states[slot.newest] = state;
    face.oldest = slot.ticks[(slot.newest + 1) % slot.ticks.size()];
  }
  const Vec3d position = quantizer.PositionOf(state);
  face.since = now;
  face.falls = Falls(slot);
  face.position = Vec3f(position);
  const std::uint32_t cell = grid.CellAt(position, face.cell);
  if (cell != face.cell) {
    Leave(index);
    Enter(index, cell);
  } else if (!had_changed) {
    Note(cell, index);
  }
}

void SnapshotHistory::Impl::Put(const BodyRecord& body) {
  const QuantizedState state = quantizer.Quantize(body.state);
  const auto found = by_id.find(body.id);
  if (found != by_id.end() && slots[found->second].epoch == body.epoch) {
    Slot& slot = slots[found->second];
    if (!(slot.now() == state)) Change(found->second, state);
    return PutProperties(found->second, body);
  }
  if (found != by_id.end()) Remove(body.id);
  PutProperties(Take(body, state), body);
}

void SnapshotHistory::Impl::PutProperties(SlotIndex index, const BodyRecord& body) {
  Slot& slot = slots[index];
  if (body.properties == slot.properties || body.properties == nullptr) return;
  if (slot.properties != nullptr && *slot.properties == *body.properties) return;
  slot.properties = body.properties;
  faces[index].properties_since = now;
  Note(faces[index].cell, index);
}

void SnapshotHistory::Impl::Remove(BodyId id) {
  const auto found = by_id.find(id);
  if (found == by_id.end()) return;
  Leave(found->second);
  free.push_back(found->second);
  by_id.erase(found);
}

// --- Records ---------------------------------------------------------------------------------------------------------

const RecordCache::Entry& SnapshotHistory::Impl::RecordOf(const RecordCache::Key& key, bool with_velocities) {
  RecordCache::Entry& entry = records.Find(key);
  const bool whole = key.ticks == 0, here = entry.pose().here();
  if (here && (whole || !with_velocities || entry.velocities().here())) return entry;
  const Slot& slot = slots[key.slot];
  if (whole) {
    entry.set_pose(records.Store(PackWhole(quantizer, slot.epoch, slot.now())));
    return entry;
  }
  const Stamp base_tick = now - key.ticks;
  const QuantizedState* base = slot.At(base_tick);
  const auto before = [&](Stamp gap) { return slot.At(base_tick - gap); };
  assert(base != nullptr);
  const Prediction prediction =
      predictor.Predict({.base = base,
                         .older = key.gap != 0 ? before(key.gap) : nullptr,
                         .oldest = key.gap2 != 0 ? before(Stamp{key.gap} + key.gap2) : nullptr,
                         .ticks = key.ticks,
                         .gap = key.gap,
                         .gap2 = key.gap2});
  const std::int32_t limit = quantizer.orientation_limit();
  if (!here) entry.set_pose(records.Store(PackPose(prediction, *base, slot.now(), limit)));
  if (!with_velocities) return entry;
  PackedRecord packed;
  if (!slot.now().asleep) {
    packed = PackVelocities(velocities.From(*base, slot.now(), prediction, key.ticks, limit), slot.now());
  }
  entry.set_velocities(records.Store(packed));
  return entry;
}

// --- Outside ---------------------------------------------------------------------------------------------------------

SnapshotHistory::SnapshotHistory(const Aabb& world_bounds, const Settings& settings)
    : impl_(std::make_unique<Impl>(world_bounds, settings)) {
  assert(settings.history_ticks >= 2);
}
SnapshotHistory::~SnapshotHistory() = default;

void SnapshotHistory::Push(Tick tick, std::span<const BodyRecord> bodies, std::span<const DepartureRecord> departures) {
  impl_->Begin(tick);
  for (const DepartureRecord& departure : departures) {
    impl_->departed[departure.id] = departure;
    impl_->Remove(departure.id);
  }
  for (const BodyRecord& body : bodies) impl_->Put(body);
}

}  // namespace tessera::replication
