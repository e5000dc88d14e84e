#include "core/replication/snapshot_history.h"

#include <algorithm>
#include <cassert>

#include "core/replication/record_codec.h"
#include "core/replication/snapshot_history_impl.h"

namespace tessera::replication {
namespace {

// Stamps run out after more than a year at 60 ticks a second; then the last ones are kept, almost five hours.
constexpr std::uint64_t kLastStamp = std::uint64_t{1} << 31, kKeptStamps = std::uint64_t{1} << 20;

}  // namespace

// --- Slots -----------------------------------------------------------------------------------------------------------

const QuantizedState* Slot::At(Stamp tick, std::size_t guess) const {
  const std::size_t kept = ticks.size();
  if (guess < kept) {
    const std::size_t there = newest >= guess ? newest - guess : newest + kept - guess;
    if (ticks[there] == tick) return &states[there];
  }
  std::size_t at = newest;
  for (std::size_t left = kept; left > 0; --left) {
    if (ticks[at] <= tick) return &states[at];
    at = at == 0 ? kept - 1 : at - 1;
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
  for (const std::uint32_t cell : dirty_cells) cells[cell].dirty.clear();
  dirty_cells.clear();
}

// Gives the new tick a stamp. Everything older than kKeptStamps counts as having happened then.
void SnapshotHistory::Impl::MoveOrigin() {
  const std::uint64_t by = tick.value() - kKeptStamps - origin;
  const auto move = [by](Stamp& stamp) { stamp = MovedStamp(stamp, by, stamp == 0 ? 0 : 1); };
  for (HotData& data : hot) {
    for (Stamp* stamp : {&data.since, &data.oldest, &data.properties_since}) move(*stamp);
  }
  for (Slot& slot : slots) {
    for (Stamp& stamp : slot.ticks) move(stamp);
  }
  now = MovedStamp(now, by, 0);  // if it is that old, 0: then it equals no stamp of a slot
  origin += by;
}

// Whether its last three states are on a parabola. Where they are not, no record refers to the third sample, so more
// clients share one.
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

void SnapshotHistory::Impl::MarkDirty(std::uint32_t cell, SlotIndex index) {
  if (cells[cell].dirty.empty()) dirty_cells.push_back(cell);
  cells[cell].dirty.push_back(index);
}

void SnapshotHistory::Impl::Enter(SlotIndex index, std::uint32_t cell) {
  hot[index].cell = static_cast<std::uint16_t>(cell);
  slots[index].place_in_cell = static_cast<std::uint32_t>(cells[cell].members.size());
  cells[cell].members.push_back(index);
  MarkDirty(cell, index);
}

void SnapshotHistory::Impl::Leave(SlotIndex index) {
  std::uint16_t& cell = hot[index].cell;
  const std::uint32_t place = slots[index].place_in_cell;
  std::vector<SlotIndex>& members = cells[cell].members;
  members[place] = members.back();
  slots[members.back()].place_in_cell = place;
  members.pop_back();
  MarkDirty(cell, index);
  cell = HotData::kNoCell;
}

SlotIndex SnapshotHistory::Impl::Take(const BodyRecord& body, const QuantizedState& state) {
  if (free.empty()) {
    free.push_back(static_cast<SlotIndex>(slots.size()));
    slots.emplace_back();
    hot.emplace_back();
  }
  const SlotIndex index = free.back();
  free.pop_back();
  slots[index] = {.id = body.id,
                  .epoch = body.epoch,
                  .ticks = {now},
                  .states = {state},
                  .properties = nullptr,
                  .own_properties = nullptr,
                  .team_properties = nullptr,
                  .traits = body.traits,
                  .team = body.team};
  const Vec3d position = quantizer.PositionOf(state);
  hot[index] = {.since = now,
                .oldest = now,
                .position = Vec3f(position),
                .generation = hot[index].generation + 1,
                .visible_to = body.visible_to};
  by_id[body.id] = index;
  departed.erase(body.id);
  Enter(index, grid.CellAt(position, std::nullopt));
  return index;
}

void SnapshotHistory::Impl::Change(SlotIndex index, const QuantizedState& state) {
  Slot& slot = slots[index];
  HotData& data = hot[index];
  const bool had_changed = data.since == previous;
  const std::size_t next = slot.newest + 1;
  if (next == slot.ticks.size() && next < settings.history_ticks) {
    slot.ticks.push_back(now);
    slot.states.push_back(state);
    slot.newest = next;
  } else {
    slot.newest = next % slot.ticks.size();
    slot.ticks[slot.newest] = now;
    slot.states[slot.newest] = state;
    data.oldest = slot.ticks[(slot.newest + 1) % slot.ticks.size()];
  }
  const Vec3d position = quantizer.PositionOf(state);
  data.since = now;
  data.falls = Falls(slot);
  data.position = Vec3f(position);
  const std::uint32_t cell = grid.CellAt(position, data.cell);
  if (cell != data.cell) {
    Leave(index);
    Enter(index, cell);
  } else if (!had_changed) {
    MarkDirty(cell, index);
  }
}

void SnapshotHistory::Impl::Put(const BodyRecord& body) {
  const QuantizedState state = quantizer.Quantize(body.state);
  const auto found = by_id.find(body.id);
  // A body with other traits, or that others may see, begins anew, with a full record.
  const auto is_same = [&](SlotIndex index) {
    const Slot& slot = slots[index];
    return slot.epoch == body.epoch && slot.traits == body.traits && slot.team == body.team &&
           hot[index].visible_to == body.visible_to;
  };
  if (found != by_id.end() && is_same(found->second)) {
    Slot& slot = slots[found->second];
    if (!(slot.now() == state)) Change(found->second, state);
    return PutProperties(found->second, body);
  }
  if (found != by_id.end()) Remove(body.id);
  PutProperties(Take(body, state), body);
}

void SnapshotHistory::Impl::PutProperties(SlotIndex index, const BodyRecord& body) {
  Slot& slot = slots[index];
  const auto same = [](const std::shared_ptr<const Bytes>& a, const std::shared_ptr<const Bytes>& b) {
    return a == b || (a != nullptr && b != nullptr && *a == *b);
  };
  if (body.properties == nullptr) return;
  if (same(slot.properties, body.properties) && same(slot.own_properties, body.own_properties) &&
      same(slot.team_properties, body.team_properties)) {
    return;
  }
  slot.properties = body.properties;
  slot.own_properties = body.own_properties;
  slot.team_properties = body.team_properties;
  hot[index].properties_since = now;
  MarkDirty(hot[index].cell, index);
}

void SnapshotHistory::Impl::Remove(BodyId id) {
  const auto found = by_id.find(id);
  if (found == by_id.end()) return;
  Leave(found->second);
  free.push_back(found->second);
  by_id.erase(found);
}

// --- Records ---------------------------------------------------------------------------------------------------------

void SnapshotHistory::Impl::Pack(const RecordCache::Key& key, RecordCache::Place place, bool with_velocities) {
  const bool full = key.ticks == 0, here = records.pose(place).here();
  const Slot& slot = slots[key.slot];
  if (full) return records.set_pose(place, records.Store(PackFull(quantizer, slot.epoch, slot.now(), slot.traits)));
  // A body that moves has changed with each push, and pushes are mostly as far apart as the last two.
  const Stamp step = std::max<Stamp>(1, now - previous), since = now - hot[key.slot].since;
  const auto state_at = [&](Stamp ticks_ago) { return slot.At(now - ticks_ago, (ticks_ago - since) / step); };
  const QuantizedState* base = state_at(key.ticks);
  assert(base != nullptr);
  const Prediction prediction =
      predictor.Predict({.base = base,
                         .older = key.gap != 0 ? state_at(key.ticks + key.gap) : nullptr,
                         .oldest = key.gap2 != 0 ? state_at(key.ticks + key.gap + key.gap2) : nullptr,
                         .ticks = key.ticks,
                         .gap = key.gap,
                         .gap2 = key.gap2});
  const std::int32_t limit = quantizer.orientation_limit();
  if (!here) records.set_pose(place, records.Store(PackPose(prediction, *base, slot.now(), limit)));
  if (!with_velocities) return;
  PackedRecord packed;
  if (!slot.now().asleep) {
    packed = PackVelocities(velocities.From(*base, slot.now(), prediction, key.ticks, limit), slot.now());
  }
  records.set_velocities(place, records.Store(packed));
}

// --- Outside ---------------------------------------------------------------------------------------------------------

SnapshotHistory::SnapshotHistory(const Aabb& world_bounds, const SnapshotSettings& settings)
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
  impl_->records.Begin(impl_->slots.size());
}

}  // namespace tessera::replication
