#include "core/region/ownership.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/region/game_motion.h"

namespace tessera::region {

namespace {

bool IsBodiless(BodyId id, const CarriedRecord& record) { return id == kInstanceBody || record.game.removed; }

}  // namespace

void Ownership::Take(const GrantedBody& body, const PlayerControl& control) { Enter(body, control, false); }
void Ownership::Restore(const GrantedBody& body, const PlayerControl& control) { Enter(body, control, true); }

void Ownership::Enter(const GrantedBody& body, const PlayerControl& control, bool restored) {
  if (IsBodiless(body.id, body.record)) {
    bodies_.OwnBodiless(body.id, body.epoch, body.state);
    return records_.Adopt(body.id, body.record);
  }
  if (restored) {
    bodies_.Restore(body.id, body.epoch, body.state);
  } else {
    bodies_.Own(body.id, body.epoch, body.state, body.record.game.jumped);
  }
  if (IsPlayerBody(body.id)) players_.Adopt(PlayerOf(body.id), control);
  records_.Adopt(body.id, body.record);
  if (catalog_.has_game()) blasts_.Came(body.id);
  bodies_.Tune(body.id, body.record.game.tuning);
}

BodyState Ownership::InstanceState(const Catalog& catalog) {
  BodyState state;
  state.position = catalog.InstancePlace();
  return state;
}

// The name is told at once: whoever makes the body, it has this name.
void Ownership::Spawn(PlayerNumber player, const PropertySet& begins) {
  bodies_.Own(PlayerBodyId(player), Epoch(1), catalog_.MakePlayer(player).initial);
  players_.Adopt(player, {});
  records_.Commit(PlayerBodyId(player), begins, {});
}

// Returns the inputs that wait for the body.
std::vector<PlayerInput> Ownership::Release(BodyId id) {
  records_.Release(id);
  output_.Left(id);
  shared_.Left(id);
  return IsPlayerBody(id) ? players_.Release(PlayerOf(id)) : std::vector<PlayerInput>();
}

Ownership::HandedOver Ownership::HandOver(const DepartingBody& body) {
  const BodyId id = body.record.id;
  HandedOver result{{id, bodies_.EpochOf(id), DepartureReason::kHandedOver, body.to}, Release(id)};
  if (bodies_.FindBodiless(id) != nullptr) {
    bodies_.RemoveBodiless(id);
    return result;
  }
  reports_.Release(id);
  bodies_.BecomeGhost(body.record, body.to);
  return result;
}

Departure Ownership::Remove(BodyId id) {
  const Departure departure{id, bodies_.EpochOf(id), DepartureReason::kRemoved, RegionId()};
  Release(id);
  bodies_.RemoveOwned(id);
  return departure;
}

Departure Ownership::Retire(BodyId id) {
  const Epoch epoch = bodies_.EpochOf(id);
  const BodyState state = bodies_.world().StateOf(id);
  CarriedRecord left;
  left.game.removed = true;
  left.game.mail.last_number = records_.Of(id).game.mail.last_number;
  left.game.mail.outbox = records_.Of(id).game.mail.outbox;
  const Departure departure = Remove(id);
  bodies_.OwnBodiless(id, epoch, state);
  records_.Adopt(id, left);
  return departure;
}

Epoch Ownership::RemoveBodiless(BodyId id) {
  const Epoch epoch = bodies_.EpochOf(id);
  Release(id);
  bodies_.RemoveBodiless(id);
  return epoch;
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
  const Departure departure{id, bodies_.EpochOf(id), DepartureReason::kHandedOver, to};
  Release(id);
  if (bodies_.FindBodiless(id) != nullptr) {
    bodies_.RemoveBodiless(id);
    return departure;
  }
  reports_.Release(id);
  bodies_.RemoveOwned(id);
  return departure;
}

PreparedGrant Ownership::Prepare(const PlannedHandover& planned, Tick tick) {
  PreparedGrant prepared{planned.to, {}, {}, {}};
  Grant& grant = prepared.grant;
  const auto per_tick = static_cast<float>(catalog_.scene().tick_rate_hz);
  for (const std::size_t index : planned.assembly) {
    const OwnedBody& body = bodies_.EntityAt(index);
    const BodyId id = body.def->id;
    const Epoch epoch(body.epoch.value() + 1);
    GhostRecord record;
    record.id = id;
    record.epoch = epoch;
    record.state = body.state;
    if (const PlayerControl* mover = players_.MoverOf(id); mover != nullptr) {
      record.force_n = mover->next.force_n;
      record.torque_nm = mover->next.torque_nm;
    }
    if (IsPlayerBody(id)) grant.control = players_.MakeGrant(PlayerOf(id));
    CarriedRecord carried = records_.Of(id);
    blasts_.Mark(carried.game);
    AddGame(carried.game, per_tick, record);
    std::vector<TouchingPair> touching = reports_.Pairs(id);
    grant.bodies.push_back({id, epoch, body.state, carried});
    grant.touching.insert(grant.touching.end(), touching.begin(), touching.end());
    prepared.departing.push_back({record, planned.to});
    prepared.copies.push_back({{id, epoch},
                               {planned.to, tick, body.state, IsPlayerBody(id) ? grant.control : PlayerControl(),
                                std::move(touching), std::move(carried)}});
  }
  return prepared;
}

void Ownership::Save(RegionState& state) const {
  state.bodies.reserve(bodies_.owned().size() + bodies_.bodiless().size());
  for (const OwnedBody& body : bodies_.owned()) state.bodies.push_back({body.def->id, body.epoch, body.state});
  for (const OwnedBody& entity : bodies_.bodiless()) {
    const auto at = std::ranges::lower_bound(state.bodies, entity.def->id, {}, &StateBody::id);
    state.bodies.insert(at, {entity.def->id, entity.epoch, entity.state});
  }
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
