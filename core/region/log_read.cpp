#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/region/frame_check.h"
#include "core/region/log.h"
#include "core/region/log_format.h"
#include "core/region/log_wire.h"
#include "core/world/bytes.h"
#include "core/world/limits.h"
#include "core/world/state_check.h"

namespace tessera::region {
namespace {

using namespace log_format;

absl::Status Bad(absl::string_view what) { return absl::InvalidArgumentError(what); }

const auto kByBody = [](const StateBody& body, BodyId wanted) { return body.id < wanted; };

// Reads the parts that are the same in both kinds of message. `base` is empty for a whole state.
class MessageReader {
 public:
  MessageReader(ByteReader& in, const Catalog& catalog, const RegionState& base)
      : in_(in), catalog_(catalog), base_(base), tick_s_(1.0 / catalog.scene().tick_rate_hz) {}

  absl::Status ReadBodies(std::vector<StateBody>& bodies) {
    in_.Field("bodies");
    bodies.resize(in_.Count(3));
    std::uint64_t last = 0;
    auto before = base_.bodies.begin();
    for (StateBody& body : bodies) {
      if (!in_.Ascend(last)) return Bad("bodies: ids do not ascend");
      body.id = BodyId(last);
      while (before != base_.bodies.end() && before->id < body.id) ++before;
      const StateBody* base = before != base_.bodies.end() && before->id == body.id ? &*before : nullptr;
      if (absl::Status status = base == nullptr ? CheckKnown(body.id, catalog_) : absl::OkStatus(); !status.ok()) {
        return status;
      }
      body.epoch = Epoch(in_.Varint32());
      if (body.epoch == Epoch() && base != nullptr) body.epoch = base->epoch;
      if (body.epoch == Epoch()) return Bad(absl::StrCat("body ", last, ": epoch 0"));
      ReadState(base == nullptr ? nullptr : &base->state, body.state);
      if (!in_.ok()) return Bad(in_.error());
      if (absl::Status status = CheckState(body.id, body.state); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

  absl::Status ReadControls(std::map<PlayerNumber, PlayerControl>& controls) {
    in_.Field("controls");
    const std::size_t count = in_.Count(kMinControlBytes);
    for (std::size_t i = 0; i < count; ++i) {
      const PlayerNumber player(in_.Varint32());
      const BodyId id = PlayerBodyId(player);
      if (absl::Status status = CheckKnown(id, catalog_); !status.ok()) return status;
      PlayerControl control;
      ReadControl(in_, player, control);
      if (absl::Status status = CheckControl(id, control, catalog_); !status.ok()) return status;
      if (!controls.emplace(player, std::move(control)).second) return Bad("controls: a player twice");
    }
    return absl::OkStatus();
  }

  absl::Status ReadSpawned(std::vector<PlayerNumber>& spawned) {
    in_.Field("spawned");
    std::uint64_t last = 0;
    spawned.resize(in_.Count(1));
    for (PlayerNumber& player : spawned) {
      if (!in_.Ascend(last) || last > std::numeric_limits<std::uint32_t>::max()) {
        return Bad("spawned: players do not ascend");
      }
      player = PlayerNumber(static_cast<std::uint32_t>(last));
    }
    return absl::OkStatus();
  }

  absl::Status ReadPairs(std::vector<PairChange>& changes) {
    changes.resize(in_.Count(3));
    for (PairChange& change : changes) {
      change.pair.body_a = BodyId(in_.Varint());
      change.pair.body_b = BodyId(in_.Varint());
      const std::uint8_t flags = in_.U8();
      if (flags > (kTrigger | kBegun)) return Bad("pairs: unknown flags");
      change.pair.trigger = (flags & kTrigger) != 0;
      change.begun = (flags & kBegun) != 0;
    }
    return absl::OkStatus();
  }

  absl::Status ReadGrants(KeptGrants& grants) {
    in_.Field("grants");
    const std::size_t count = in_.Count(8);
    for (std::size_t i = 0; i < count; ++i) {
      const BodyId id(in_.Varint());
      const Epoch epoch(in_.Varint32());
      if (absl::Status status = CheckKnown(id, catalog_); !status.ok()) return status;
      if (epoch.value() < 2) return Bad(absl::StrCat("grants: body ", id.value(), ": epoch ", epoch.value()));
      KeptGrant grant;
      grant.to = RegionId(in_.Varint32());
      grant.tick = Tick(in_.Varint());
      ReadState(nullptr, grant.state);
      if (absl::Status status = CheckState(id, grant.state); !status.ok()) return status;
      if (IsPlayerBody(id)) ReadControl(in_, PlayerOf(id), grant.control);
      if (absl::Status status = CheckControl(id, grant.control, catalog_); !status.ok()) return status;
      std::vector<PairChange> pairs;
      if (absl::Status status = ReadPairs(pairs); !status.ok()) return status;
      for (const PairChange& pair : pairs) grant.touching.push_back(pair.pair);
      ReadRecord(in_, grant.record);
      if (absl::Status status = CheckRecord(id, grant.record, catalog_); !status.ok()) return status;
      if (!grants.emplace(std::pair(id, epoch), std::move(grant)).second) return Bad("grants: one twice");
    }
    return absl::OkStatus();
  }

  absl::Status ReadTombstones(std::vector<BodyClaim>& tombstones) {
    in_.Field("tombstones");
    std::uint64_t last = 0;
    tombstones.resize(in_.Count(2));
    for (BodyClaim& tombstone : tombstones) {
      if (!in_.Ascend(last)) return Bad("tombstones: ids do not ascend");
      tombstone.body = BodyId(last);
      tombstone.epoch = Epoch(in_.Varint32());
      if (absl::Status status = CheckKnown(tombstone.body, catalog_); !status.ok()) return status;
      if (tombstone.epoch == Epoch()) return Bad(absl::StrCat("tombstones: body ", last, ": epoch 0"));
    }
    return absl::OkStatus();
  }

  absl::Status ReadBlasts(std::vector<KeptBlast>& blasts) {
    in_.Field("blasts");
    std::uint64_t last = 0;
    blasts.resize(in_.Count(game::kMinBlastBytes + 1));
    for (KeptBlast& kept : blasts) {
      game::ReadBlast(in_, kept.blast);
      const std::uint8_t acted = in_.U8();
      if (!in_.ok()) return Bad(in_.error());
      if (acted > 1) return Bad("blasts: unknown flags");
      kept.acted = acted != 0;
      if (kept.blast.id <= last) return Bad("blasts: ids do not ascend");
      last = kept.blast.id;
      if (absl::Status status = game::CheckBlast(kept.blast); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

  absl::Status ReadHost(game::HostState& host) {
    in_.Field("host");
    host = game::ReadHostState(in_);
    return in_.ok() ? game::CheckHostState(host, catalog_.scene().kinds.size()) : Bad(in_.error());
  }

  absl::Status ReadAllRecords(std::map<BodyId, CarriedRecord>& records) {
    in_.Field("records");
    std::uint64_t last = 0;
    const std::size_t count = in_.Count(3);
    for (std::size_t i = 0; i < count; ++i) {
      if (!in_.Ascend(last)) return Bad("records: ids do not ascend");
      CarriedRecord& entry = records[BodyId(last)];
      ReadRecord(in_, entry);
      if (!in_.ok()) return Bad(in_.error());
      if (absl::Status status = CheckRecord(BodyId(last), entry, catalog_); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

 private:
  void ReadState(const BodyState* base, BodyState& state) {
    const std::size_t used = UnpackState(in_.rest(), base, tick_s_, state);
    if (used == 0) in_.Fail("truncated");
    in_.Bytes(used);
  }

  ByteReader& in_;
  const Catalog& catalog_;
  const RegionState& base_;
  const double tick_s_;
};

absl::StatusOr<LogHeader> ReadLogHeader(ByteReader& in) {
  in.Field("header");
  const std::uint8_t magic_a = in.U8(), magic_b = in.U8(), format = in.U8(), kind = in.U8();
  LogHeader header;
  header.whole = kind == kWhole;
  header.region = RegionId(in.Varint32());
  header.incarnation = Incarnation(in.Varint());
  header.tick = Tick(in.Varint());
  if (kind == kChanges) header.base = Tick(in.Varint());
  if (!in.ok()) return absl::DataLossError(in.error());
  if (magic_a != kMagic[0] || magic_b != kMagic[1]) return Bad("not a region's state or log");
  if (format != kLogFormat) return Bad(absl::StrCat("format ", format, ", here it is ", kLogFormat));
  if (kind != kWhole && kind != kChanges) return Bad("neither a state nor changes");
  return header;
}

// The message without its checksum.
absl::StatusOr<std::span<const std::uint8_t>> Opened(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kChecksumBytes) return absl::DataLossError("truncated");
  const std::span<const std::uint8_t> body = bytes.first(bytes.size() - kChecksumBytes);
  if (ByteReader(bytes.last(kChecksumBytes)).U64() != LogChecksum(body))
    return absl::DataLossError("the checksum does not match: damaged or cut short");
  return body;
}

absl::Status Finished(const ByteReader& in) {
  if (!in.ok()) return Bad(in.error());
  return in.remaining() == 0 ? absl::OkStatus() : Bad("trailing bytes");
}

// The contents of one message of changes.
struct Changes {
  std::vector<BodyId> gone;
  std::vector<StateBody> bodies;
  std::map<PlayerNumber, PlayerControl> controls;
  std::vector<PlayerNumber> spawned;
  std::vector<PairChange> pairs;
  KeptGrants granted;
  std::vector<std::pair<BodyId, Epoch>> settled;
  std::map<BodyId, CarriedRecord> records;
  std::vector<BodyClaim> tombstones;
  std::vector<BodyId> forgotten;
  bool blasts_changed = false, host_changed = false;
  std::vector<KeptBlast> blasts;
  game::HostState host;
};

absl::Status ReadChanges(ByteReader& in, const Catalog& catalog, const RegionState& state, Changes& changes) {
  MessageReader reader(in, catalog, state);
  std::uint64_t last = 0;
  in.Field("gone");
  changes.gone.resize(in.Count(1));
  for (BodyId& id : changes.gone) {
    if (!in.Ascend(last)) return Bad("gone: ids do not ascend");
    id = BodyId(last);
    if (state.Find(id) == nullptr) return Bad(absl::StrCat("gone: body ", last, " is not there"));
  }
  if (absl::Status status = reader.ReadBodies(changes.bodies); !status.ok()) return status;
  if (absl::Status status = reader.ReadControls(changes.controls); !status.ok()) return status;
  if (absl::Status status = reader.ReadSpawned(changes.spawned); !status.ok()) return status;
  in.Field("pairs");
  if (absl::Status status = reader.ReadPairs(changes.pairs); !status.ok()) return status;
  if (absl::Status status = reader.ReadGrants(changes.granted); !status.ok()) return status;
  in.Field("settled");
  changes.settled.resize(in.Count(2));
  for (auto& [id, epoch] : changes.settled) {
    id = BodyId(in.Varint());
    epoch = Epoch(in.Varint32());
    if (!state.grants.contains({id, epoch})) return Bad(absl::StrCat("settled: body ", id.value(), " was not granted"));
  }
  if (absl::Status status = reader.ReadAllRecords(changes.records); !status.ok()) return status;
  if (absl::Status status = reader.ReadTombstones(changes.tombstones); !status.ok()) return status;
  in.Field("forgotten");
  last = 0;
  changes.forgotten.resize(in.Count(1));
  for (BodyId& id : changes.forgotten) {
    if (!in.Ascend(last)) return Bad("forgotten: ids do not ascend");
    id = BodyId(last);
  }
  in.Field("blasts");
  const std::uint8_t blasts = in.U8();
  if (blasts > 1) return Bad("blasts: unknown flags");
  changes.blasts_changed = blasts != 0;
  if (changes.blasts_changed) {
    if (absl::Status status = reader.ReadBlasts(changes.blasts); !status.ok()) return status;
  }
  in.Field("host");
  const std::uint8_t host = in.U8();
  if (host > 1) return Bad("host: unknown flags");
  changes.host_changed = host != 0;
  if (changes.host_changed) {
    if (absl::Status status = reader.ReadHost(changes.host); !status.ok()) return status;
  }
  if (absl::Status status = Finished(in); !status.ok()) return status;
  // A body that is gone cannot have changed.
  for (const BodyId id : changes.gone) {
    const auto it = std::lower_bound(changes.bodies.begin(), changes.bodies.end(), id, kByBody);
    if (it != changes.bodies.end() && it->id == id)
      return Bad(absl::StrCat("body ", id.value(), " is gone and changed"));
  }
  return absl::OkStatus();
}

// Checks that every control is that of a body which is there after the changes.
absl::Status CheckPlaces(const Changes& changes, const RegionState& state) {
  for (const auto& [id, record] : changes.records) {
    const auto changed = std::lower_bound(changes.bodies.begin(), changes.bodies.end(), id, kByBody);
    if (changed != changes.bodies.end() && changed->id == id) continue;
    const bool gone = std::binary_search(changes.gone.begin(), changes.gone.end(), id);
    if (gone || state.Find(id) == nullptr) return Bad(absl::StrCat("records: body ", id.value(), " is not there"));
  }
  return absl::OkStatus();
}

// Leaves one control for each player's body, and none else.
absl::Status ApplyControls(const Changes& changes, const RegionState& state,
                           std::map<PlayerNumber, PlayerControl>& controls) {
  for (const BodyId id : changes.gone) {
    if (IsPlayerBody(id)) controls.erase(PlayerOf(id));
  }
  for (const auto& [player, control] : changes.controls) controls.insert_or_assign(player, control);
  const auto changed = [&](BodyId id) {
    const auto it = std::lower_bound(changes.bodies.begin(), changes.bodies.end(), id, kByBody);
    return it != changes.bodies.end() && it->id == id;
  };
  const auto gone = [&](BodyId id) { return std::binary_search(changes.gone.begin(), changes.gone.end(), id); };
  for (const StateBody& body : changes.bodies) {
    if (IsPlayerBody(body.id) && !controls.contains(PlayerOf(body.id))) return Bad("controls: one is missing");
  }
  for (const auto& [player, control] : controls) {
    const BodyId id = PlayerBodyId(player);
    if (!changed(id) && (state.Find(id) == nullptr || gone(id))) return Bad("controls: a player without a body");
  }
  return absl::OkStatus();
}

void ApplyBodies(const Changes& changes, std::vector<StateBody>& bodies) {
  std::size_t known = 0;
  auto at = bodies.begin();
  for (const StateBody& body : changes.bodies) {
    while (at != bodies.end() && at->id < body.id) ++at;
    if (at == bodies.end() || at->id != body.id) continue;
    *at = body;
    ++known;
  }
  if (!changes.gone.empty()) {
    std::erase_if(bodies, [&](const StateBody& body) {
      return std::binary_search(changes.gone.begin(), changes.gone.end(), body.id);
    });
  }
  if (known == changes.bodies.size()) return;
  std::vector<StateBody> merged;
  merged.reserve(bodies.size() + changes.bodies.size() - known);
  const auto by_id = [](const StateBody& a, const StateBody& b) { return a.id < b.id; };
  std::set_union(changes.bodies.begin(), changes.bodies.end(), bodies.begin(), bodies.end(), std::back_inserter(merged),
                 by_id);
  bodies = std::move(merged);
}

// Pairs as the changes leave them.
void ApplyPairs(std::span<const PairChange> changes, std::vector<TouchingPair>& touching) {
  for (const PairChange& change : changes) {
    const auto at = std::lower_bound(touching.begin(), touching.end(), change.pair);
    const bool there = at != touching.end() && *at == change.pair;
    if (change.begun && !there) touching.insert(at, change.pair);
    if (!change.begun && there) touching.erase(at);
  }
}

}  // namespace

absl::StatusOr<RegionState> DecodeState(std::span<const std::uint8_t> bytes, const Catalog& catalog) {
  const absl::StatusOr<std::span<const std::uint8_t>> body = Opened(bytes);
  if (!body.ok()) return body.status();
  ByteReader in(*body);
  const absl::StatusOr<LogHeader> header = ReadLogHeader(in);
  if (!header.ok()) return header.status();
  if (!header->whole) return Bad("changes, not a whole state");
  const RegionState nothing;
  MessageReader reader(in, catalog, nothing);
  RegionState state;
  state.region = header->region;
  state.incarnation = header->incarnation;
  state.tick = header->tick;
  std::vector<PairChange> pairs;
  if (absl::Status status = reader.ReadBodies(state.bodies); !status.ok()) return status;
  if (absl::Status status = reader.ReadControls(state.controls); !status.ok()) return status;
  if (absl::Status status = reader.ReadSpawned(state.spawned); !status.ok()) return status;
  in.Field("pairs");
  if (absl::Status status = reader.ReadPairs(pairs); !status.ok()) return status;
  if (absl::Status status = reader.ReadGrants(state.grants); !status.ok()) return status;
  if (absl::Status status = reader.ReadAllRecords(state.records); !status.ok()) return status;
  if (absl::Status status = reader.ReadTombstones(state.tombstones); !status.ok()) return status;
  if (absl::Status status = reader.ReadBlasts(state.blasts); !status.ok()) return status;
  if (absl::Status status = reader.ReadHost(state.host); !status.ok()) return status;
  if (absl::Status status = Finished(in); !status.ok()) return status;
  if (absl::Status status = CheckRegionState(state, catalog); !status.ok()) return status;
  for (const PairChange& change : pairs) {
    if (!state.touching.empty() && !(state.touching.back() < change.pair)) return Bad("pairs: not ascending");
    state.touching.push_back(change.pair);
  }
  return state;
}

absl::StatusOr<LogHeader> DecodeLogHeader(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  return ReadLogHeader(in);
}

// `changes` ascend.
void ApplyTombstones(const Changes& changes, std::vector<BodyClaim>& tombstones) {
  std::erase_if(tombstones, [&](const BodyClaim& one) {
    return std::ranges::binary_search(changes.forgotten, one.body) ||
           std::ranges::binary_search(changes.tombstones, one.body, {}, &BodyClaim::body);
  });
  tombstones.insert(tombstones.end(), changes.tombstones.begin(), changes.tombstones.end());
  std::ranges::sort(tombstones);
}

absl::Status ApplyChanges(std::span<const std::uint8_t> bytes, const Catalog& catalog, RegionState& state) {
  const absl::StatusOr<std::span<const std::uint8_t>> body = Opened(bytes);
  if (!body.ok()) return body.status();
  ByteReader in(*body);
  const absl::StatusOr<LogHeader> header = ReadLogHeader(in);
  if (!header.ok()) return header.status();
  if (header->whole) return Bad("a whole state, not changes");
  if (header->region != state.region || header->incarnation != state.incarnation) {
    return absl::FailedPreconditionError("changes of another region or another life of it");
  }
  if (header->base != state.tick || header->tick <= state.tick) {
    return absl::FailedPreconditionError(absl::StrCat("changes from tick ", header->base.value(), " to ",
                                                      header->tick.value(), ", here is ", state.tick.value()));
  }
  Changes changes;
  if (absl::Status status = ReadChanges(in, catalog, state, changes); !status.ok()) return status;
  if (absl::Status status = CheckPlaces(changes, state); !status.ok()) return status;
  std::map<PlayerNumber, PlayerControl> controls = state.controls;
  if (absl::Status status = ApplyControls(changes, state, controls); !status.ok()) return status;
  state.tick = header->tick;
  state.controls = std::move(controls);
  ApplyBodies(changes, state.bodies);
  std::vector<PlayerNumber> spawned;
  std::set_union(state.spawned.begin(), state.spawned.end(), changes.spawned.begin(), changes.spawned.end(),
                 std::back_inserter(spawned));
  state.spawned = std::move(spawned);
  ApplyPairs(changes.pairs, state.touching);
  for (const auto& key : changes.settled) state.grants.erase(key);
  for (auto& [key, grant] : changes.granted) state.grants.insert_or_assign(key, std::move(grant));
  ApplyTombstones(changes, state.tombstones);
  if (changes.blasts_changed) state.blasts = std::move(changes.blasts);
  if (changes.host_changed) state.host = std::move(changes.host);
  for (const BodyId id : changes.gone) state.records.erase(id);
  for (auto& [id, record] : changes.records) state.records.insert_or_assign(id, std::move(record));
  return absl::OkStatus();
}

}  // namespace tessera::region
