#include "core/region/blast_table.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/region/ascends.h"
#include "core/world/state_check.h"
#include "game_sdk/api/api.h"

namespace tessera::region {
namespace {

using game::Blast;
using game::BlastMark;
using game::GameRecord;

// A body is owned by its cell's region, but for so much beyond the border.
constexpr double kBeyondCell_m = 10;

auto IdOf(const KeptBlast& kept) { return kept.blast.id; }

bool HasBlast(std::span<const KeptBlast> kept, std::uint64_t id) {
  return std::ranges::binary_search(kept, id, {}, IdOf);
}

}  // namespace

void BlastTable::Make(Blast blast, Tick now) {
  made_[blast.id] = now;
  waits_ = true;
  const auto at = std::ranges::lower_bound(kept_, blast.id, {}, IdOf);
  kept_.insert(at, {std::move(blast), false});
}

void BlastTable::Receive(std::span<const MessagePacket> packets, Tick now) {
  for (const MessagePacket& packet : packets) {
    if (packet.kind != PacketKind::kBlast || HasBlast(kept_, packet.number)) continue;
    ByteReader in(packet.properties);
    Blast blast;
    game::ReadBlast(in, blast);
    if (!in.ok() || blast.ends < now) continue;
    waits_ = true;
    const auto at = std::ranges::lower_bound(kept_, blast.id, {}, IdOf);
    kept_.insert(at, {std::move(blast), false});
  }
}

// Nobody sees a body that stands aside, and nothing touches it.
void BlastTable::ActOn(const Blast& blast, const OwnedBody& body, RecordTable& records,
                       std::vector<game::GameEvent>& events) const {
  const BodyDef& def = *body.def;
  if (def.kinematic || (blast.layers >> def.layer.index & 1) == 0) return;
  if (std::ranges::binary_search(records.hidden(), def.id)) return;
  const auto hit = game::HitOf(blast, body.state.position, def.mass_kg);
  if (!hit) return;
  GameRecord record = records.Of(def.id).game;
  const Vec3f push_ns = record.push_ns + Vec3f(hit->impulse_ns);
  if (!CheckForce(def.id, push_ns * static_cast<float>(scene_.tick_rate_hz), {}).ok()) return;
  record.push_ns = push_ns;
  record.wakes = true;
  records.Put(def.id, record);
  game::GameEvent event{game::kOnBodyBlast, def.id, blast.by};
  event.blown = {blast.at, hit->share, blast.name};
  events.push_back(std::move(event));
}

// Bodies that came since the last step are settled for what had acted here by then.
void BlastTable::SettleFresh(Tick now, const Bodies& bodies, RecordTable& records,
                             std::vector<game::GameEvent>& events) {
  for (auto at = fresh_.begin(); at != fresh_.end();) {
    const std::ptrdiff_t index = bodies.IndexOf(*at);
    if (index < 0) {
      at = fresh_.erase(at);
      continue;
    }
    const OwnedBody& body = bodies.owned()[static_cast<std::size_t>(index)];
    GameRecord settled;
    settled.blasts = records.Of(*at).game.blasts;
    std::vector<BlastMark> to_come = settled.blasts;  // marks of blasts that this region may yet hear of
    for (const KeptBlast& known : kept_) {
      if (!known.acted) continue;
      if (!IsSettledFor(settled, known.blast.id)) ActOn(known.blast, body, records, events);
      std::erase_if(to_come, [&](const BlastMark& mark) { return mark.id == known.blast.id; });
    }
    std::erase_if(to_come, [now](const BlastMark& mark) { return mark.ends < now; });
    // With marks of blasts that are to come it is looked at again.
    const bool again = !to_come.empty();
    GameRecord record = records.Of(*at).game;
    record.blasts = std::move(to_come);
    records.Put(*at, record);
    at = again ? std::next(at) : fresh_.erase(at);
  }
}

std::vector<game::GameEvent> BlastTable::Act(Tick now, const Bodies& bodies, RecordTable& records) {
  std::vector<game::GameEvent> events;
  if (kept_.empty() && fresh_.empty()) return events;
  std::erase_if(kept_, [&](const KeptBlast& kept) { return kept.blast.ends < now; });
  SettleFresh(now, bodies, records, events);
  for (KeptBlast& kept : kept_) {
    if (kept.acted || kept.blast.due > now) continue;
    for (const OwnedBody& body : bodies.owned()) {
      const KeptRecord* const record = records.Find(body.def->id);
      if (record != nullptr && IsSettledFor(record->game, kept.blast.id)) continue;
      ActOn(kept.blast, body, records, events);
    }
    kept.acted = true;
  }
  // All that has acted is settled for those that are looked at again.
  for (const BodyId id : fresh_) {
    GameRecord record = records.Of(id).game;
    MarkSettled(kept_, record);
    records.Put(id, record);
  }
  return events;
}

bool BlastTable::GoesTo(RegionId neighbor, const Blast& blast, const Neighborhood& neighborhood) const {
  const PartitionMap& map = neighborhood.map();
  const double own = map.DistanceTo(neighborhood.self(), blast.at);
  return own <= blast.radius_m + kBeyondCell_m || map.DistanceTo(neighbor, blast.at) < own;
}

void BlastTable::Send(Tick now, std::optional<Tick> standby_has, const Neighborhood& neighborhood,
                      const Borders& borders, OutgoingMessages& outgoing) {
  if (kept_.empty()) {
    made_.clear();
    sent_.clear();
    waits_ = false;
    return;
  }
  std::erase_if(made_, [&](const auto& made) { return !standby_has || made.second <= *standby_has; });
  waits_ = !made_.empty();
  for (const KeptBlast& kept : kept_) {
    waits_ = waits_ || !kept.acted;
    if (made_.contains(kept.blast.id)) continue;
    for (const RegionId neighbor : neighborhood.neighbors()) {
      if (!borders.IsUp(neighbor) || !GoesTo(neighbor, kept.blast, neighborhood)) continue;
      if (!sent_[neighbor].insert(kept.blast.id).second) continue;
      MessagePacket packet;
      packet.kind = PacketKind::kBlast;
      packet.from = kInstanceBody;
      packet.number = kept.blast.id;
      packet.origin = neighborhood.self();
      packet.sent = packet.made = now;
      ByteWriter out;
      Write(out, kept.blast);
      packet.properties = out.Take();
      outgoing.Add(neighbor, std::move(packet));
    }
  }
}

void BlastTable::Validate([[maybe_unused]] const Bodies& bodies) const {
  assert(Ascends(kept_, IdOf));
  assert(std::ranges::all_of(
      made_, [this](const auto& made) { return std::ranges::binary_search(kept_, made.first, {}, IdOf); }));
}

}  // namespace tessera::region
