// Inside of SnapshotHistory: what a SnapshotSender reads. Not for others.
//
// Bodies live in slots; a slot keeps its body's last changes, so that the state at any tick that somebody acknowledged
// can be found, and what rests takes no work. Slots stand in cells of a grid over x-z; each Push notes in a cell the
// slots that somebody who watches it must look at anew: which began to change, came, or went. What one client needs of
// a body, another that has acknowledged the same ticks needs too: records are kept until the next Push.
#pragma once

#include <cstddef>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/replication/codec/fast_list.h"
#include "core/replication/codec/velocity.h"
#include "core/replication/interest.h"
#include "core/replication/quantize.h"
#include "core/replication/record_cache.h"
#include "core/replication/snapshot.h"

namespace tessera::replication {

using SlotIndex = std::uint32_t;
// A tick as a history and its senders keep it: counted from the history's origin, in 32 bits, because what they look at
// for every body is what they cost. 0: none.
using Stamp = std::uint32_t;

// The stamp by an origin that is so much later; `before` for what was before it.
constexpr Stamp MovedStamp(Stamp stamp, std::uint64_t by, Stamp before) {
  return stamp > by ? static_cast<Stamp>(stamp - by) : before;
}

struct Slot {
  BodyId id;
  Epoch epoch;
  std::uint32_t place_in_cell = 0;
  // A ring of what it changed to and when, apart because most of them are only looked past; `newest` is where the last
  // one stands.
  std::vector<Stamp> ticks;
  std::vector<QuantizedState> states;
  std::size_t newest = 0;
  std::shared_ptr<const Bytes> properties;

  const QuantizedState& now() const { return states[newest]; }
  // Null where it is not kept any more, or was not here.
  const QuantizedState* At(Stamp tick) const;
};

// What every client asks of every slot that it watches, at each snapshot: close together, because memory is what that
// costs.
struct alignas(32) SlotFace {
  static constexpr std::uint16_t kNowhere = 0xffff;

  Stamp since = 0;               // of the present state
  Stamp oldest = 0;              // from which states are kept
  Stamp properties_since = 0;    // 0: there are none
  Vec3f position;                // m
  std::uint32_t generation = 0;  // one more for each body that takes the slot
  std::uint16_t cell = kNowhere;
  bool falls = false;  // freely, by its last states

  bool used() const { return cell != kNowhere; }
};
static_assert(sizeof(SlotFace) == 32);

struct Cell {
  std::vector<SlotIndex> members;
  std::vector<SlotIndex> news;  // of the last Push
};

struct SnapshotHistory::Impl {
  Impl(const Aabb& world_bounds, const Settings& settings_in)
      : settings(settings_in),
        quantizer(world_bounds, settings),
        predictor(quantizer, settings, settings.gravity_m_s2),
        velocities(settings),
        grid(world_bounds, settings.interest_radius_m),
        cells(static_cast<std::size_t>(grid.columns() * grid.rows())) {}

  void Begin(Tick tick);
  Stamp StampOf(Tick at) const { return static_cast<Stamp>(at.value() - origin + 1); }
  void Put(const BodyRecord& body);
  void Remove(BodyId id);

  // Packed if it is not yet; valid until the next call. Requires that the slot keeps the states at those ticks
  // (faces[slot].oldest).
  const RecordCache::Entry& RecordOf(const RecordCache::Key& key, bool with_velocities);
  // Before RecordOf: ask for what it will look at if it has to pack. The slot first, some time later its states.
  void PrefetchSlot(const RecordCache::Key& key) const {
    if (records.Has(key)) return;
    const auto* at = reinterpret_cast<const char*>(&slots[key.slot]);
    __builtin_prefetch(at);
    __builtin_prefetch(at + 64);
  }
  void PrefetchStates(const RecordCache::Key& key) const {
    if (records.Has(key)) return;
    const Slot& slot = slots[key.slot];
    __builtin_prefetch(&slot.ticks[slot.newest]);
    __builtin_prefetch(&slot.states[slot.newest]);
  }

  Settings settings;
  Quantizer quantizer;
  PosePredictor predictor;
  VelocityEstimator velocities;
  CellGrid grid;
  std::vector<Cell> cells;
  std::vector<std::uint32_t> noted;  // cells with news
  std::vector<Slot> slots;
  std::vector<SlotFace> faces;  // beside slots
  std::vector<SlotIndex> free;
  std::unordered_map<BodyId, SlotIndex> by_id;
  RecordCache records;
  std::uint64_t pushes = 0;
  // The tick whose stamp is 1. It moves on when they run out; senders then move theirs
  // (SnapshotSender::Impl::MoveOrigin).
  std::uint64_t origin = 0;
  Tick tick;
  Stamp now = 0, previous = 0;  // of this Push and of the one before
  // The last departure of each body that has left and not come back.
  std::unordered_map<BodyId, DepartureRecord> departed;

 private:
  SlotIndex Take(const BodyRecord& body, const QuantizedState& state);
  void Change(SlotIndex index, const QuantizedState& state);
  void PutProperties(SlotIndex index, const BodyRecord& body);
  void MoveOrigin();
  bool Falls(const Slot& slot) const;
  void Note(std::uint32_t cell, SlotIndex index);
  void Enter(SlotIndex index, std::uint32_t cell);
  void Leave(SlotIndex index);
};

}  // namespace tessera::replication
