// Inside of SnapshotHistory, read by SnapshotSender. Not for others.
//
// Bodies live in slots. A slot keeps its body's last changes, so that the state at any acknowledged tick can be found,
// and a body that rests takes no work. Slots stand in cells of a grid over x-z. Each Push puts the slots that began to
// change, came or went on their cell's dirty list: senders look at those anew. Clients that have acknowledged the same
// ticks of a body need the same record, so records are kept until the next Push.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/replication/codec/predict.h"
#include "core/replication/codec/velocity.h"
#include "core/replication/interest.h"
#include "core/replication/quantize.h"
#include "core/replication/record_cache.h"
#include "core/replication/snapshot_history.h"

namespace tessera::replication {

using SlotIndex = std::uint32_t;
// A tick counted from the history's origin; 0: none. It has 32 bits because the memory that is looked at for every body
// is the cost of a history and its senders.
using Stamp = std::uint32_t;

// The stamp after the origin moved on by so many ticks; `before` for a stamp from before the new origin.
constexpr Stamp MovedStamp(Stamp stamp, std::uint64_t by, Stamp before) {
  return stamp > by ? static_cast<Stamp>(stamp - by) : before;
}

struct Slot {
  BodyId id;
  Epoch epoch;
  std::uint32_t place_in_cell = 0;
  // A ring of the body's changes: their ticks and states. They are apart because a search reads mostly ticks. `newest`
  // is the place of the last change.
  std::vector<Stamp> ticks;
  std::vector<QuantizedState> states;
  std::size_t newest = 0;
  std::shared_ptr<const Bytes> properties, own_properties, team_properties;  // as in BodyRecord
  BodyTraits traits;
  TeamId team = 0;

  const Bytes* PropertiesFor(BodyId viewer, TeamId of_team) const {
    if (viewer == id && own_properties != nullptr) return own_properties.get();
    const bool own_team = team_properties != nullptr && (viewer == id || (team != 0 && team == of_team));
    return own_team ? team_properties.get() : properties.get();
  }
  const QuantizedState& now() const { return states[newest]; }
  // Null where it is not kept any more, or was not here. `guess`: so many changes ago it may have been.
  const QuantizedState* At(Stamp tick, std::size_t guess) const;
};

// Hot data of a slot: every client reads it for every slot that it sees, at each snapshot. It is close together because
// those reads cost memory bandwidth.
struct alignas(32) HotData {
  static constexpr std::uint16_t kNoCell = 0xffff;

  Stamp since = 0;               // tick of the present state
  Stamp oldest = 0;              // tick from which states are kept
  Stamp properties_since = 0;    // 0: there are none
  Vec3f position;                // m
  std::uint32_t generation = 0;  // one more for each body that takes the slot
  std::uint16_t cell = kNoCell;
  bool falls = false;  // freely, by its last states
  Visibility visible_to = Visibility::kEveryone;

  bool used() const { return cell != kNoCell; }
};
static_assert(sizeof(HotData) == 32);

struct Cell {
  std::vector<SlotIndex> members;
  std::vector<SlotIndex> dirty;  // slots that the last Push changed so that senders have to look at them anew
};

struct SnapshotHistory::Impl {
  Impl(const Aabb& world_bounds, const SnapshotSettings& settings_in)
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

  // Where the record is, packed if that was not done yet; `found` is where the cache has it, if it has. Requires that
  // the slot keeps the states at the key's ticks (hot[slot].oldest).
  RecordCache::Place RecordOf(const RecordCache::Key& key, RecordCache::Place found, bool with_velocities) {
    const RecordCache::Place place = found == RecordCache::kNowhere ? records.Add(key) : found;
    const bool velocities_here = !with_velocities || key.ticks == 0 || records.velocities(place).here();
    if (!velocities_here || !records.pose(place).here()) Pack(key, place, with_velocities);
    return place;
  }
  // Both ask for memory that RecordOf will look at if it has to pack: first the slot, some time later its states.
  void PrefetchSlot(SlotIndex index) const {
    const auto* at = reinterpret_cast<const char*>(&slots[index]);
    __builtin_prefetch(at);
    __builtin_prefetch(at + 64);
  }
  void PrefetchStates(SlotIndex index) const {
    const Slot& slot = slots[index];
    __builtin_prefetch(&slot.ticks[slot.newest]);
    __builtin_prefetch(&slot.states[slot.newest]);
  }

  // Whether a player with this body and of this team may see the slot's body.
  bool MaySee(SlotIndex slot, BodyId own, TeamId of_team) const {
    const Visibility visible_to = hot[slot].visible_to;
    return visible_to == Visibility::kEveryone || slots[slot].id == own ||
           tessera::MaySee(visible_to, slots[slot].team, of_team);
  }

  SnapshotSettings settings;
  Quantizer quantizer;
  PosePredictor predictor;
  VelocityEstimator velocities;
  CellGrid grid;
  std::vector<Cell> cells;
  std::vector<std::uint32_t> dirty_cells;  // cells whose dirty list is not empty
  std::vector<Slot> slots;
  std::vector<HotData> hot;  // by slot
  std::vector<SlotIndex> free;
  std::unordered_map<BodyId, SlotIndex> by_id;
  RecordCache records;
  std::uint64_t pushes = 0;
  // The tick whose stamp is 1. It moves on when stamps run out; senders then move theirs
  // (SnapshotSender::Impl::MoveOrigin).
  std::uint64_t origin = 0;
  Tick tick;
  Stamp now = 0, previous = 0;  // ticks of this Push and of the one before
  // The last departure of each body that has left and not come back.
  std::unordered_map<BodyId, DepartureRecord> departed;

 private:
  void Pack(const RecordCache::Key& key, RecordCache::Place place, bool with_velocities);
  SlotIndex Take(const BodyRecord& body, const QuantizedState& state);
  void Change(SlotIndex index, const QuantizedState& state);
  void PutProperties(SlotIndex index, const BodyRecord& body);
  void MoveOrigin();
  bool Falls(const Slot& slot) const;
  void MarkDirty(std::uint32_t cell, SlotIndex index);
  void Enter(SlotIndex index, std::uint32_t cell);
  void Leave(SlotIndex index);
};

}  // namespace tessera::replication
