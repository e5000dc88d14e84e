#include "core/region/ownership.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace tessera::region {

void Ownership::Take(const GrantedBody& body, const PlayerControl& control) {
  bodies_.Own(body.id, body.epoch, body.state);
  if (IsPlayerBody(body.id)) players_.Adopt(PlayerOf(body.id), control);
  records_.Adopt(body.id, body.record);
}

void Ownership::Restore(const GrantedBody& body, const PlayerControl& control) {
  bodies_.Restore(body.id, body.epoch, body.state);
  if (IsPlayerBody(body.id)) players_.Adopt(PlayerOf(body.id), control);
  records_.Adopt(body.id, body.record);
}

void Ownership::Spawn(PlayerNumber player) {
  bodies_.Own(PlayerBodyId(player), Epoch(1), catalog_.MakePlayer(player).initial);
  players_.Adopt(player, {});
}

Epoch Ownership::EpochOf(BodyId id) const {
  const std::ptrdiff_t index = bodies_.IndexOf(id);
  assert(index >= 0);
  return bodies_.owned()[static_cast<std::size_t>(index)].epoch;
}

// Returns the inputs that wait for the body.
std::vector<PlayerInput> Ownership::Release(BodyId id) {
  records_.Release(id);
  output_.Left(id);
  return IsPlayerBody(id) ? players_.Release(PlayerOf(id)) : std::vector<PlayerInput>();
}

Ownership::HandedOver Ownership::HandOver(const DepartingBody& body) {
  const BodyId id = body.record.id;
  HandedOver result{{id, EpochOf(id), DepartureReason::kHandedOver, body.to}, Release(id)};
  reports_.Release(id);
  bodies_.BecomeGhost(body.record, body.to);
  return result;
}

Departure Ownership::Remove(BodyId id) {
  const Departure departure{id, EpochOf(id), DepartureReason::kRemoved, RegionId()};
  Release(id);
  bodies_.RemoveOwned(id);
  return departure;
}

std::vector<Departure> Ownership::ReadBack() {
  std::vector<Departure> lost;
  for (const auto& [id, epoch] : bodies_.ReadBack()) {
    lost.push_back({id, epoch, DepartureReason::kRemoved, RegionId()});
    Release(id);
  }
  return lost;
}

Departure Ownership::LetGo(BodyId id, RegionId to) {
  const Departure departure{id, EpochOf(id), DepartureReason::kHandedOver, to};
  Release(id);
  reports_.Release(id);
  bodies_.RemoveOwned(id);
  return departure;
}

PreparedGrant Ownership::Prepare(const PlannedHandover& planned, Tick tick) {
  PreparedGrant prepared{planned.to, {}, {}, {}};
  Grant& grant = prepared.grant;
  const auto per_tick = static_cast<float>(catalog_.scene().tick_rate_hz);
  for (const std::size_t index : planned.assembly) {
    const OwnedBody& body = bodies_.owned()[index];
    const BodyId id = body.def->id;
    const Epoch epoch(body.epoch.value() + 1);
    GhostRecord record;
    record.id = id;
    record.epoch = epoch;
    record.state = body.state;
    const PlayerControl* control = IsPlayerBody(id) ? players_.Find(PlayerOf(id)) : nullptr;
    if (control != nullptr) {
      record.force_n = control->next.force_n;
      record.torque_nm = control->next.torque_nm;
      grant.control = players_.MakeGrant(PlayerOf(id));
    }
    CarriedRecord carried = records_.Of(id);
    record.force_n += carried.game.push_ns * per_tick;
    record.torque_nm += carried.game.push_nms * per_tick;
    std::vector<TouchingPair> touching = reports_.Pairs(id);
    grant.bodies.push_back({id, epoch, body.state, carried});
    grant.touching.insert(grant.touching.end(), touching.begin(), touching.end());
    prepared.departing.push_back({record, planned.to});
    prepared.copies.push_back(
        {{id, epoch}, {planned.to, tick, body.state, grant.control, std::move(touching), std::move(carried)}});
  }
  return prepared;
}

void Ownership::Save(RegionState& state) const {
  state.bodies.reserve(bodies_.owned().size());
  for (const OwnedBody& body : bodies_.owned()) state.bodies.push_back({body.def->id, body.epoch, body.state});
  state.controls = players_.Controls();
  state.touching = reports_.All();
  for (const KeptRecord& entry : records_.all()) {
    state.records[entry.body] = CarriedFrom(entry);
  }
}

void Ownership::Validate() const {
  assert(std::ranges::all_of(bodies_.owned(), [this](const OwnedBody& body) {
    return !IsPlayerBody(body.def->id) || players_.Find(PlayerOf(body.def->id)) != nullptr;
  }));
  assert(std::ranges::all_of(records_.all(), [this](const KeptRecord& entry) { return bodies_.Owns(entry.body); }));
}

}  // namespace tessera::region
