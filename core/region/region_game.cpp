#include "core/region/region_game.h"

#include <optional>
#include <utility>

#include "game_sdk/api/api.h"

namespace tessera::region {
namespace {

std::uint32_t CallbackOf(const physics::PairEvent& event) {
  if (event.trigger) return event.begin ? game::kOnBodyEntered : game::kOnBodyLeft;
  return event.begin ? game::kOnBodyContact : game::kOnBodyContactEnded;
}

}  // namespace

std::vector<Departure> RegionGame::Run(Tick tick, std::span<const physics::PairEvent> events) {
  if (host_ == nullptr) return {};
  tick_ = tick;
  tombstones_.Forget(tick, scene().tick_rate_hz);
  std::vector<game::GameEvent> called;
  called.reserve(2 * events.size());
  for (const physics::PairEvent& event : events) {
    called.push_back({CallbackOf(event), event.body_a, event.body_b});
    called.push_back({CallbackOf(event), event.body_b, event.body_a});
  }
  host_->Run(tick, called, *this);
  return std::exchange(removed_, {});
}

void RegionGame::Commit(BodyId id, const PropertySet& changed, const game::GameRecord& record, bool together) {
  const KeptRecord* const now = records_.Find(id);
  const std::optional<KeptRecord> before = now == nullptr ? std::nullopt : std::optional(*now);
  records_.Commit(id, changed, record);
  const KeptRecord* const after = records_.Find(id);
  if (after != nullptr) output_.Changed(before ? &*before : nullptr, *after, tick_);
  if (together) output_.Bound(id, tick_);
}

void RegionGame::Spawn(BodyId id, const BodyState& state) {
  ownership_.Spawn(id, state);
  output_.Spawned(id, tick_);
}

void RegionGame::Remove(BodyId id) {
  const Departure departure = ownership_.Remove(id);
  tombstones_.Add(id, departure.epoch, tick_);
  removed_.push_back(departure);
}

const BodyDef* RegionGame::Find(BodyId id) const {
  const std::ptrdiff_t place = bodies_.PlaceOf(id);
  if (place >= 0) return &bodies_.DefAt(static_cast<std::size_t>(place));
  const BodyDef* def = catalog_.Find(id);
  return def != nullptr && def->motion == Motion::kStatic ? def : nullptr;
}

void RegionGame::ForEachOwned(absl::FunctionRef<void(BodyId, const BodyDef&)> visit) const {
  for (const OwnedBody& body : bodies_.owned()) visit(body.def->id, *body.def);
}

// The table holds sound bytes only: what comes from outside is checked by CheckRecord.
PropertySet RegionGame::ChangedOf(BodyId id) const {
  const KeptRecord* record = records_.Find(id);
  if (record == nullptr || record->bytes->empty()) return {};
  return PropertySet::Decode(*record->bytes, scene().properties).value_or(PropertySet());
}

game::GameRecord RegionGame::RecordOf(BodyId id) const {
  const KeptRecord* record = records_.Find(id);
  return record == nullptr ? game::GameRecord() : record->game;
}

}  // namespace tessera::region
