#include "core/replication/snapshot_history.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "core/replication/record_codec.h"

namespace tessera::replication {

// --- Slots -----------------------------------------------------------------------------------------------------------

const QuantizedState* Slot::At(Tick tick) const {
  std::size_t at = newest;
  for (std::size_t left = changes.size(); left > 0; --left) {
    if (changes[at].tick <= tick) return &changes[at].state;
    at = at == 0 ? changes.size() - 1 : at - 1;
  }
  return nullptr;
}

void SnapshotHistory::Impl::Begin(Tick now) {
  assert(pushes == 0 || now > tick);
  previous_tick = tick;
  tick = now;
  ++pushes;
  for (const std::uint32_t cell : noted) cells[cell].news.clear();
  noted.clear();
  const std::size_t records_before = std::max<std::size_t>(records.size(), 64);
  records.clear();
  if (record_table_.size() < 4 * records_before) record_table_.resize(std::bit_ceil(4 * records_before));
}

void SnapshotHistory::Impl::Note(std::uint32_t cell, SlotIndex index) {
  if (cells[cell].news.empty()) noted.push_back(cell);
  cells[cell].news.push_back(index);
}

void SnapshotHistory::Impl::Enter(SlotIndex index, std::uint32_t cell) {
  faces[index].cell = cell;
  slots[index].place_in_cell = static_cast<std::uint32_t>(cells[cell].members.size());
  cells[cell].members.push_back(index);
  Note(cell, index);
}

void SnapshotHistory::Impl::Leave(SlotIndex index) {
  std::uint32_t& cell = faces[index].cell;
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
    free.push_back(static_cast<SlotIndex>(slots.size()));
    slots.emplace_back();
    faces.emplace_back();
  }
  const SlotIndex index = free.back();
  free.pop_back();
  slots[index] = {.id = body.id, .epoch = body.epoch, .changes = {{tick, state}}, .seen = tick, .properties = nullptr};
  const Vec3d position = quantizer.PositionOf(state);
  faces[index] = {.since = tick,
                  .oldest = tick,
                  .properties_since = {},
                  .position = Vec3f(position),
                  .generation = faces[index].generation + 1};
  by_id[body.id] = index;
  departed.erase(body.id);
  Enter(index, grid.CellAt(position, std::nullopt));
  return index;
}

void SnapshotHistory::Impl::Change(SlotIndex index, const QuantizedState& state) {
  Slot& slot = slots[index];
  SlotFace& face = faces[index];
  const bool had_changed = face.since == previous_tick;
  const std::size_t next = slot.newest + 1;
  if (next == slot.changes.size() && next < settings.history_ticks) {
    slot.changes.push_back({tick, state});
    slot.newest = next;
  } else {
    slot.newest = next % slot.changes.size();
    slot.changes[slot.newest] = {tick, state};
    face.oldest = slot.changes[(slot.newest + 1) % slot.changes.size()].tick;
  }
  const Vec3d position = quantizer.PositionOf(state);
  face.since = tick;
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
    slot.seen = tick;
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
  faces[index].properties_since = tick;
  Note(faces[index].cell, index);
}

void SnapshotHistory::Impl::Remove(BodyId id) {
  const auto found = by_id.find(id);
  if (found == by_id.end()) return;
  Leave(found->second);
  free.push_back(found->second);
  by_id.erase(found);
}

void SnapshotHistory::Impl::RemoveUnseen() {
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (faces[i].used() && slots[i].seen != tick) Remove(slots[i].id);
  }
}

// --- Records ---------------------------------------------------------------------------------------------------------

// Where the record is, or is to be.
SnapshotHistory::Impl::RecordPlace& SnapshotHistory::Impl::PlaceOf(SlotIndex slot, const SampleTicks& samples) {
  if (records.size() * 2 >= record_table_.size()) GrowRecordTable();
  std::uint64_t hash = (samples.ticks * 0x9e3779b97f4a7c15 + samples.gap) * 0xbf58476d1ce4e5b9 + samples.gap2;
  hash = (hash ^ (hash >> 29) ^ slot) * 0x94d049bb133111eb;
  const std::uint64_t key = (hash << 32) | slot;
  for (std::size_t at = hash >> 40;; ++at) {
    RecordPlace& place = record_table_[at & (record_table_.size() - 1)];
    if (place.push != pushes) {
      place.key = key;
      return place;
    }
    if (place.key == key && records[place.record].samples == samples) return place;
  }
}

void SnapshotHistory::Impl::GrowRecordTable() {
  std::vector<RecordPlace> old(std::max<std::size_t>(256, 2 * record_table_.size()));
  old.swap(record_table_);
  for (const RecordPlace& place : old) {
    if (place.push != pushes) continue;
    RecordPlace& now = PlaceOf(static_cast<SlotIndex>(place.key), records[place.record].samples);
    now = place;
  }
}

std::uint32_t SnapshotHistory::Impl::RecordOf(SlotIndex index, const SampleTicks& samples, bool with_velocities) {
  RecordPlace& place = PlaceOf(index, samples);
  const bool here = place.push == pushes, whole = samples.ticks == 0;
  if (here && (whole || !with_velocities || records[place.record].velocities.has_value())) return place.record;
  const Slot& slot = slots[index];
  if (!here) {
    place.push = pushes;
    place.record = static_cast<std::uint32_t>(records.size());
    records.push_back({.samples = samples});
  }
  SharedRecord& record = records[place.record];
  if (whole) {
    record.pose = PackWhole(quantizer, slot.epoch, slot.now());
    return place.record;
  }
  const std::uint64_t now = tick.value();
  const QuantizedState* base = slot.At(Tick(now - samples.ticks));
  const auto before = [&](std::uint64_t gap) { return slot.At(Tick(now - samples.ticks - gap)); };
  assert(base != nullptr);
  const Prediction prediction =
      predictor.Predict({.base = base,
                         .older = samples.gap != 0 ? before(samples.gap) : nullptr,
                         .oldest = samples.gap2 != 0 ? before(samples.gap + samples.gap2) : nullptr,
                         .ticks = samples.ticks,
                         .gap = samples.gap,
                         .gap2 = samples.gap2});
  const std::int32_t limit = quantizer.orientation_limit();
  if (!here) record.pose = PackPose(prediction, *base, slot.now(), limit);
  if (with_velocities && !slot.now().asleep) {
    record.velocities =
        PackVelocities(velocities.From(*base, slot.now(), prediction, samples.ticks, limit), slot.now());
  }
  return place.record;
}

// --- Outside ---------------------------------------------------------------------------------------------------------

SnapshotHistory::SnapshotHistory(const Aabb& world_bounds, const Settings& settings)
    : impl_(std::make_unique<Impl>(world_bounds, settings)) {
  assert(settings.history_ticks >= 2);
}
SnapshotHistory::~SnapshotHistory() = default;

void SnapshotHistory::Push(Tick tick, std::span<const BodyRecord> bodies, std::span<const DepartureRecord> departures) {
  impl_->Begin(tick);
  for (const DepartureRecord& departure : departures) impl_->departed[departure.id] = departure;
  for (const BodyRecord& body : bodies) impl_->Put(body);
  impl_->RemoveUnseen();
}

void SnapshotHistory::PushChanges(Tick tick, std::span<const BodyRecord> bodies,
                                  std::span<const DepartureRecord> departures) {
  impl_->Begin(tick);
  for (const DepartureRecord& departure : departures) {
    impl_->departed[departure.id] = departure;
    impl_->Remove(departure.id);
  }
  for (const BodyRecord& body : bodies) impl_->Put(body);
}

}  // namespace tessera::replication
