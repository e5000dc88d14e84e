// Which bodies a client sees, and which of them it may not have as they are.
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <span>
#include <vector>

#include "core/replication/snapshot_sender_impl.h"

namespace tessera::replication {
namespace {

// A view that moves so far between two snapshots, in radii of interest, has all distances found anew.
constexpr double kJump = 0.125;

}  // namespace

void SnapshotSender::Impl::Follow(const History& history, const ClientView& view) {
  std::vector<std::uint32_t>& before = seen_before;
  before = window.cells();
  const bool turned = window.Follow(history.grid, settings.interest_radius_m, view.centre);
  const bool viewer_changed = view.own != own || view.team != team;
  const bool jumped = view.centre.has_value() != centre.has_value() ||
                      (centre.has_value() && Length(*view.centre - *centre) > kJump * settings.interest_radius_m);
  centre = view.centre;
  if (jumped || viewer_changed) std::ranges::fill(turns, SendTurn());
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
  if (seen && entities[found->second].generation == data.generation) return MarkDirty(history, found->second);
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
  MarkDirty(history, index);
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
  if (body.dirty != Entity::kClean) {
    dirty[body.dirty].use = DirtyEntity::Use::kGone;
    turns[body.dirty] = SendTurn();
  }
  free_entities.push_back(index);
  // No departure is sent of a body that is back already, in another slot.
  if (other != history.by_id.end() && other->second != body.slot && by_slot.contains(other->second)) return;
  pending_departures.insert_or_assign(record.id,
                                      PendingDeparture{.record = record, .first_sequence = next_sequence, .sent = {}});
}

void SnapshotSender::Impl::MarkDirty(const History& history, std::uint32_t index) {
  Entity& body = entities[index];
  if (body.dirty != Entity::kClean) {
    turns[body.dirty] = SendTurn();
    return;
  }
  if (!free_dirty.Take(body.dirty)) {
    body.dirty = static_cast<std::uint32_t>(dirty.size());
    dirty.emplace_back();
    turns.emplace_back();
  }
  dirty[body.dirty] = {.acknowledged = body.acknowledged,
                       .slot = body.slot,
                       .entity = index,
                       .first_sequence = next_sequence,
                       .since_push = static_cast<std::uint16_t>(history.pushes),
                       .use = DirtyEntity::Use::kSeen};
  turns[body.dirty] = SendTurn();
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

}  // namespace tessera::replication
