#include "core/region/region_game.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/physics/mass_properties.h"
#include "core/physics/trig.h"
#include "game_sdk/api/api.h"

namespace tessera::region {
namespace {

std::uint32_t CallbackOf(const physics::PairEvent& event) {
  if (event.trigger) return event.begin ? game::kOnBodyEntered : game::kOnBodyLeft;
  return event.begin ? game::kOnBodyContact : game::kOnBodyContactEnded;
}

}  // namespace

std::vector<Departure> RegionGame::Run(Tick tick, std::span<const physics::PairEvent> events,
                                       const game::PlayerChanges& players) {
  if (host_ == nullptr) return {};
  tick_ = tick;
  tombstones_.Forget(tick, scene().tick_rate_hz);
  std::erase_if(retired_, [this](const auto& entry) { return bodies_.FindBodiless(entry.first) == nullptr; });
  UnpackEvents();
  std::vector<game::GameEvent> called = blasts_.Act(tick, bodies_, records_);
  called.reserve(called.size() + 2 * events.size());
  for (const physics::PairEvent& event : events) {
    game::GameEvent of_a{CallbackOf(event), event.body_a, event.body_b};
    game::GameEvent of_b{CallbackOf(event), event.body_b, event.body_a};
    if (event.begin && !event.trigger) {
      if (const std::optional<physics::Contact> contact = bodies_.world().ContactBetween(event.body_a, event.body_b)) {
        const Vec3d normal(contact->normal);
        const double impulse = Length(Vec3d(contact->impulse_on_b));
        of_a.contact = {contact->point, -normal, impulse};
        of_b.contact = {contact->point, normal, impulse};
      }
    }
    called.push_back(of_a);
    called.push_back(of_b);
  }
  // Nobody sees one whom the game may yet refuse, and nobody will if this region dies before its standby knows.
  if (host_->Has(game::kOnJoin)) {
    for (const PlayerNumber player : players.joined) output_.Spawned(PlayerBodyId(player), tick);
  }
  host_->Run(tick, called, *this, players);
  return std::exchange(removed_, {});
}

void RegionGame::Adopt(std::uint32_t number) {
  if (number == this->number() || !IsNext(number)) return;
  if (host_ != nullptr) next_->TakeOver(*host_);
  host_ = std::exchange(next_, nullptr);
}

void RegionGame::AdoptHost(const game::HostState& state) {
  if (host_ != nullptr) host_->Adopt(state, [](const game::GameEvent&) { return true; });
}

void RegionGame::AdoptEvents(const game::HostState& state, absl::FunctionRef<bool(BodyId)> comes,
                             absl::FunctionRef<bool(const BodyDef&, BodyId)> takes) {
  if (host_ == nullptr) return;
  host_->Adopt(state, [&](const game::GameEvent& event) {
    const BodyId carrier = game::CarrierOf(event, *this);
    if (comes(carrier)) return true;
    const BodyDef* const self = Find(event.self);
    return carrier != event.self && self != nullptr && takes(*self, carrier);
  });
}

void RegionGame::PackEvents(std::span<const BodyId> bodies) {
  if (host_ == nullptr || !host_->waits()) return;
  for (const BodyId id : bodies) {
    const std::vector<game::GameEvent> events = host_->TakeWaiting(id, *this);
    if (events.empty()) continue;
    game::GameRecord record = RecordOf(id);
    record.waiting = events;
    records_.Put(id, record);
  }
}

void RegionGame::UnpackEvents() {
  const std::vector<BodyId> eventful(records_.eventful().begin(), records_.eventful().end());
  for (const BodyId id : eventful) {
    game::GameRecord record = RecordOf(id);
    host_->Wait(std::exchange(record.waiting, {}));
    records_.Put(id, record);
  }
}

// Nothing is to be taken over from an older game.
void RegionGame::NoteMade(BodyId id) {
  if (number() == 0) return;
  game::GameRecord record = RecordOf(id);
  record.game = number();
  records_.Commit(id, ChangedOf(id), record);
}

void RegionGame::Commit(BodyId id, const PropertySet& changed, game::GameRecord record, bool together) {
  if (together) output_.Bound(id, tick_);
  const RecordTable::Replaced replaced = records_.Commit(id, changed, std::move(record));
  if (!replaced.changed) return;
  const KeptRecord* const before = replaced.before ? &*replaced.before : nullptr;
  const KeptRecord& after = *records_.Find(id);
  output_.Changed(before, after, tick_);
  if (id != kInstanceBody) shared_.Changed(before, after, tick_);
  static const BodyTuning kUntuned;
  const BodyTuning& was = before != nullptr ? before->game.tuning : kUntuned;
  if (was != after.game.tuning) ownership_.Tune(id, after.game.tuning);
}

void RegionGame::Spawn(BodyId id, const BodyState& state) {
  ownership_.Spawn(id, state);
  output_.Spawned(id, tick_);
}

// Those of other regions whom the body touches hear from it that it is gone: nobody could tell them in its name later.
void RegionGame::EndTouches(BodyId id) {
  for (const TouchingPair& pair : reports_.Pairs(id)) {
    const BodyId other = pair.body_a == id ? pair.body_b : pair.body_a;
    host_->TellByMessage({pair.trigger ? game::kOnBodyLeft : game::kOnBodyContactEnded, other, id}, *this);
  }
}

// One that still has messages under way leaves its tombstone when they are acknowledged.
void RegionGame::Remove(BodyId id) {
  EndTouches(id);
  const KeptRecord* const record = records_.Find(id);
  if (record != nullptr && !record->game.mail.outbox.empty()) {
    removed_.push_back(ownership_.Retire(id));
    retired_[id] = tick_;
    return;
  }
  const Departure departure = ownership_.Remove(id);
  // Orders name players who have left, so their bodies need none.
  if (!IsPlayerBody(id)) tombstones_.Add(id, departure.epoch, tick_);
  removed_.push_back(departure);
}

const BodyDef* RegionGame::Find(BodyId id) const {
  const std::ptrdiff_t place = bodies_.PlaceOf(id);
  if (place >= 0) return &bodies_.DefAt(static_cast<std::size_t>(place));
  const BodyDef* def = catalog_.Find(id);
  return def != nullptr && def->motion == Motion::kStatic ? def : nullptr;
}

Vec3d RegionGame::CenterOfMassOf(const BodyDef& def) const { return physics::CenterOfMass(def); }

bool RegionGame::IsAnchored(BodyId id) const {
  bool anchored = false;
  const auto look = [&](const JointDef& joint) {
    anchored = anchored || joint.body_b == BodyId() || !catalog_.Known(joint.body_a) || !catalog_.Known(joint.body_b);
  };
  for (const BodyId member : bodies_.AssemblyOf(id)) catalog_.ForEachJoint(member, look);
  return anchored;
}

std::vector<BodyId> RegionGame::Jointed() const {
  std::vector<BodyId> jointed(records_.jointed().begin(), records_.jointed().end());
  std::erase_if(jointed, [this](BodyId id) { return bodies_.IndexOf(id) < 0; });
  return jointed;
}

std::vector<BodyId> RegionGame::Steering() const { return {records_.steering().begin(), records_.steering().end()}; }

// Some of a prefab's may be gone.
std::vector<BodyId> RegionGame::AssemblyOf(BodyId id) const {
  std::vector<BodyId> members;
  for (const BodyId member : bodies_.AssemblyOf(id)) {
    if (member == id || bodies_.PlaceOf(member) >= 0) members.push_back(member);
  }
  return members;
}

bool RegionGame::AreConnected(BodyId a, BodyId b) const {
  const auto of_both = [&](const JointDef& joint) {
    return (joint.body_a == a && joint.body_b == b) || (joint.body_a == b && joint.body_b == a);
  };
  bool connected = std::ranges::any_of(bodies_.game_joints(), of_both);
  catalog_.ForEachJoint(a, [&](const JointDef& joint) { connected = connected || of_both(joint); });
  return connected;
}

bool RegionGame::IsRemoved(BodyId id) const {
  return tombstones_.Has(id) || (id != kInstanceBody && bodies_.FindBodiless(id) != nullptr);
}

void RegionGame::ForEachOwned(absl::FunctionRef<void(BodyId, const BodyDef&)> visit) const {
  for (const OwnedBody& body : bodies_.owned()) visit(body.def->id, *body.def);
}

const PlayerInput* RegionGame::InputOf(PlayerNumber player) const {
  const PlayerControl* const control = players_.Find(player);
  return control == nullptr || control->last_input == 0 ? nullptr : &control->next;
}

Vec3d RegionGame::LookOf(const PlayerInput& input) const {
  const physics::SinCos yaw = physics::SinCosOf(input.yaw_rad), pitch = physics::SinCosOf(input.pitch_rad);
  return {-yaw.sin * pitch.cos, pitch.sin, -yaw.cos * pitch.cos};
}

std::vector<BodyId> RegionGame::PlayerBodies() const {
  std::vector<BodyId> players;
  for (const OwnedBody& body : PlayersAmong(bodies_.owned())) players.push_back(body.def->id);
  return players;
}

// Both tables hold sound bytes only: what comes from outside is checked by CheckRecord and CheckFrame.
PropertySet RegionGame::ChangedOf(BodyId id) const {
  const KeptRecord* record = records_.Find(id);
  const std::vector<std::uint8_t>* bytes = record != nullptr ? record->bytes.get() : shared_.Find(id);
  if (bytes == nullptr || bytes->empty()) return {};
  const auto& declared = id == kInstanceBody ? scene().instance_properties : scene().properties;
  return PropertySet::Decode(*bytes, declared).value_or(PropertySet());
}

PropertySet RegionGame::KnownOfInstance() const {
  return PropertySet::Decode(messages_.InstanceProperties(tick_), scene().instance_properties).value_or(PropertySet());
}

const game::GameRecord& RegionGame::RecordOf(BodyId id) const {
  static const game::GameRecord kNone;
  const KeptRecord* record = records_.Find(id);
  return record == nullptr ? kNone : record->game;
}

}  // namespace tessera::region
