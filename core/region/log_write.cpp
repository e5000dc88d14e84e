#include <algorithm>
#include <iterator>

#include "core/region/log.h"
#include "core/region/log_format.h"
#include "core/region/log_wire.h"
#include "core/world/bytes.h"
#include "core/world/state_check.h"

namespace tessera::region {
namespace {

using namespace log_format;

constexpr std::size_t kMessageRoom = 1024;  // bytes that a message mostly needs beside its bodies

void WriteHeader(ByteWriter& out, std::uint8_t kind, RegionId region, Incarnation incarnation, Tick tick) {
  out.U8(kMagic[0]);
  out.U8(kMagic[1]);
  out.U8(kLogFormat);
  out.U8(kind);
  out.Varint(region.value());
  out.Varint(incarnation.value());
  out.Varint(tick.value());
}

void WriteState(ByteWriter& out, const BodyState& state, const BodyState* base, double tick_s) {
  out.Wrote(PackState(out.Room(kMaxStateBytes + 8), state, base, tick_s));
}

template <class List>
void WriteIds(ByteWriter& out, const List& ids) {
  std::uint64_t last = 0;
  out.Varint(ids.size());
  for (const auto id : ids) {
    out.Varint(id.value() - last);
    last = id.value();
  }
}

void WritePair(ByteWriter& out, const TouchingPair& pair, bool begun) {
  out.Varint(pair.body_a.value());
  out.Varint(pair.body_b.value());
  out.U8(static_cast<std::uint8_t>((pair.trigger ? kTrigger : 0) | (begun ? kBegun : 0)));
}

void WriteControls(ByteWriter& out, const std::map<PlayerNumber, PlayerControl>& controls,
                   const std::map<PlayerNumber, PlayerControl>* base) {
  std::vector<const std::pair<const PlayerNumber, PlayerControl>*> changed;
  for (const auto& entry : controls) {
    const auto before = base == nullptr ? controls.end() : base->find(entry.first);
    if (base != nullptr && before != base->end() && before->second == entry.second) continue;
    changed.push_back(&entry);
  }
  out.Varint(changed.size());
  for (const auto* entry : changed) {
    out.Varint(entry->first.value());
    WriteControl(out, entry->second);
  }
}

void WriteGrant(ByteWriter& out, const std::pair<BodyId, Epoch>& key, const KeptGrant& grant) {
  out.Varint(key.first.value());
  out.Varint(key.second.value());
  out.Varint(grant.to.value());
  out.Varint(grant.tick.value());
  WriteState(out, grant.state, nullptr, 0);
  if (IsPlayerBody(key.first)) WriteControl(out, grant.control);
  out.Varint(grant.touching.size());
  for (const TouchingPair& pair : grant.touching) WritePair(out, pair, true);
  WriteRecord(out, grant.record);
}

// Those of `grants` that are not in `base`, then the keys of `base` that are not in `grants`.
void WriteGrants(ByteWriter& out, const KeptGrants& grants, const KeptGrants& base) {
  std::vector<const KeptGrants::value_type*> granted;
  for (const auto& entry : grants) {
    const auto before = base.find(entry.first);
    if (before == base.end() || !(before->second == entry.second)) granted.push_back(&entry);
  }
  out.Varint(granted.size());
  for (const auto* entry : granted) WriteGrant(out, entry->first, entry->second);
  std::vector<std::pair<BodyId, Epoch>> settled;
  for (const auto& [key, grant] : base) {
    if (!grants.contains(key)) settled.push_back(key);
  }
  out.Varint(settled.size());
  for (const auto& [id, epoch] : settled) {
    out.Varint(id.value());
    out.Varint(epoch.value());
  }
}

void WriteClaims(ByteWriter& out, std::span<const BodyClaim> claims) {
  std::uint64_t last = 0;
  out.Varint(claims.size());
  for (const BodyClaim& claim : claims) {
    out.Varint(claim.body.value() - last);
    last = claim.body.value();
    out.Varint(claim.epoch.value());
  }
}

// Those of `now` that are not in `base`, then the bodies of `base` that are not in `now`.
void WriteTombstones(ByteWriter& out, const std::vector<BodyClaim>& now, const std::vector<BodyClaim>& base) {
  std::vector<BodyClaim> added;
  std::ranges::set_difference(now, base, std::back_inserter(added));
  WriteClaims(out, added);
  std::vector<BodyId> forgotten;
  auto kept = now.begin();
  for (const BodyClaim& before : base) {
    while (kept != now.end() && kept->body < before.body) ++kept;
    if (kept == now.end() || kept->body != before.body) forgotten.push_back(before.body);
  }
  WriteIds(out, forgotten);
}

void WriteBlasts(ByteWriter& out, std::span<const KeptBlast> blasts) {
  out.Varint(blasts.size());
  for (const KeptBlast& kept : blasts) {
    game::Write(out, kept.blast);
    out.U8(kept.acted ? 1 : 0);
  }
}

// All that is owned, ascending.
std::vector<const OwnedBody*> EntitiesOf(const LogView& view) {
  std::vector<const OwnedBody*> all;
  all.reserve(view.owned.size() + view.bodiless.size());
  for (const OwnedBody& body : view.owned) all.push_back(&body);
  const auto id_of = [](const OwnedBody* entity) { return entity->def->id; };
  for (const OwnedBody& entity : view.bodiless) {
    all.insert(std::ranges::lower_bound(all, entity.def->id, {}, id_of), &entity);
  }
  return all;
}

std::vector<StateBody> StateBodiesOf(const std::vector<const OwnedBody*>& entities) {
  std::vector<StateBody> bodies;
  bodies.reserve(entities.size());
  for (const OwnedBody* body : entities) bodies.push_back({body->def->id, body->epoch, body->state});
  return bodies;
}

// The bodies that differ from those of the last tick in the log.
struct BodyChanges {
  struct Changed {
    std::size_t body;
    const StateBody* base;  // null: the last tick did not have it
  };
  std::vector<Changed> changed;
  std::vector<BodyId> gone;
  bool more = false;  // some were not in the last tick
};

BodyChanges ChangesOf(const std::vector<const OwnedBody*>& entities, const std::vector<StateBody>& last) {
  BodyChanges changes;
  auto before = last.begin();
  for (std::size_t i = 0; i < entities.size(); ++i) {
    const OwnedBody& body = *entities[i];
    const BodyId id = body.def->id;
    for (; before != last.end() && before->id < id; ++before) changes.gone.push_back(before->id);
    if (before == last.end() || before->id != id) {
      changes.changed.push_back({i, nullptr});
      changes.more = true;
      continue;
    }
    if (before->epoch != body.epoch || !SameBits(before->state, body.state)) changes.changed.push_back({i, &*before});
    ++before;
  }
  for (; before != last.end(); ++before) changes.gone.push_back(before->id);
  return changes;
}

void WriteBodies(ByteWriter& out, const BodyChanges& changes, const std::vector<const OwnedBody*>& entities,
                 double tick_s) {
  WriteIds(out, changes.gone);
  out.Varint(changes.changed.size());
  std::uint64_t last = 0;
  for (const BodyChanges::Changed& change : changes.changed) {
    const OwnedBody& body = *entities[change.body];
    out.Varint(body.def->id.value() - last);
    last = body.def->id.value();
    const bool same_epoch = change.base != nullptr && change.base->epoch == body.epoch;
    out.Varint(same_epoch ? 0 : body.epoch.value());
    WriteState(out, body.state, change.base == nullptr ? nullptr : &change.base->state, tick_s);
  }
}

Bytes Sealed(ByteWriter& out) {
  out.U64(LogChecksum(out.bytes()));
  return out.Take();
}

}  // namespace

Bytes EncodeState(const RegionState& state) {
  ByteWriter out;
  WriteHeader(out, kWhole, state.region, state.incarnation, state.tick);
  out.Varint(state.bodies.size());
  std::uint64_t last = 0;
  for (const StateBody& body : state.bodies) {
    out.Varint(body.id.value() - last);
    last = body.id.value();
    out.Varint(body.epoch.value());
    WriteState(out, body.state, nullptr, 0);
  }
  WriteControls(out, state.controls, nullptr);
  WriteIds(out, state.spawned);
  out.Varint(state.touching.size());
  for (const TouchingPair& pair : state.touching) WritePair(out, pair, true);
  out.Varint(state.grants.size());
  for (const auto& [key, grant] : state.grants) WriteGrant(out, key, grant);
  out.Varint(state.records.size());
  last = 0;
  for (const auto& [id, record] : state.records) {
    out.Varint(id.value() - last);
    last = id.value();
    WriteRecord(out, record);
  }
  WriteClaims(out, state.tombstones);
  WriteBlasts(out, state.blasts);
  game::Write(out, state.host);
  return Sealed(out);
}

Bytes LogWriter::Write(const LogView& now, std::span<const TouchingPair> touching) {
  if (!whole_) return WriteChanges(now);
  whole_ = false;
  last_ = RegionState();
  last_.region = now.region;
  last_.incarnation = now.incarnation;
  last_.tick = now.tick;
  last_.bodies = StateBodiesOf(EntitiesOf(now));
  last_.controls = now.controls;
  last_.spawned = now.spawned;
  last_.grants = *now.grants;
  last_.touching.assign(touching.begin(), touching.end());
  for (const KeptRecord& entry : now.records) {
    last_.records[entry.body] = CarriedFrom(entry);
  }
  last_.tombstones = now.tombstones;
  last_.blasts.assign(now.blasts.begin(), now.blasts.end());
  last_.host = now.host;
  Bytes bytes = EncodeState(last_);
  last_.touching.clear();
  last_.records.clear();
  return bytes;
}

Bytes LogWriter::WriteChanges(const LogView& now) {
  const std::vector<const OwnedBody*> entities = EntitiesOf(now);
  const BodyChanges changes = ChangesOf(entities, last_.bodies);

  ByteWriter out;
  out.Reserve(kMessageRoom + changes.changed.size() * (kMaxStateBytes + 16));
  WriteHeader(out, kChanges, now.region, now.incarnation, now.tick);
  out.Varint(last_.tick.value());
  WriteBodies(out, changes, entities, tick_s_);
  WriteControls(out, now.controls, &last_.controls);
  std::vector<PlayerNumber> spawned;
  std::set_difference(now.spawned.begin(), now.spawned.end(), last_.spawned.begin(), last_.spawned.end(),
                      std::back_inserter(spawned));
  WriteIds(out, spawned);
  out.Varint(now.pair_changes.size());
  for (const PairChange& change : now.pair_changes) WritePair(out, change.pair, change.begun);
  WriteGrants(out, *now.grants, last_.grants);
  out.Varint(now.records.size());
  std::uint64_t last = 0;
  for (const KeptRecord& entry : now.records) {
    out.Varint(entry.body.value() - last);
    last = entry.body.value();
    WriteRecord(out, CarriedFrom(entry));
  }
  WriteTombstones(out, now.tombstones, last_.tombstones);
  const bool blasts = !std::ranges::equal(now.blasts, last_.blasts);
  out.U8(blasts ? 1 : 0);
  if (blasts) WriteBlasts(out, now.blasts);
  const bool host = now.host != last_.host;
  out.U8(host ? 1 : 0);
  if (host) game::Write(out, now.host);

  last_.tick = now.tick;
  if (changes.more || !changes.gone.empty()) {
    last_.bodies = StateBodiesOf(entities);
  } else {
    for (const BodyChanges::Changed& change : changes.changed) {
      StateBody& base = last_.bodies[change.body];
      base.epoch = entities[change.body]->epoch;
      base.state = entities[change.body]->state;
    }
  }
  last_.controls = now.controls;
  last_.spawned = now.spawned;
  if (!(last_.grants.empty() && now.grants->empty())) last_.grants = *now.grants;
  last_.tombstones = now.tombstones;
  if (blasts) last_.blasts.assign(now.blasts.begin(), now.blasts.end());
  if (host) last_.host = now.host;
  return Sealed(out);
}

}  // namespace tessera::region
