#include "core/region/bodies.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/physics/body_path.h"
#include "core/region/ascends.h"
#include "core/world/state_check.h"

namespace tessera::region {
namespace {

// Number of solves that prime the contacts of restored bodies. A pile of 1240 moves by .05 mm in the next tick then, by
// .8 mm after none.
constexpr int kPrimingSolves = 6;

// Ghosts that lie settled do not touch each other here: what they do to each other is among the loads on them.
constexpr physics::ExclusionGroup kSettledGhosts{1};

// Before the first step, bodies whose bounds are so near to each other's count as near, m.
constexpr double kAbout_m = 0.1;

}  // namespace

Bodies::Bodies(const Catalog& catalog, const physics::WorldSettings& settings, Tick tick)
    : catalog_(catalog), world_(settings) {
  for (const BodyDef& def : catalog.scene().bodies) {
    if (def.motion != Motion::kStatic) continue;
    world_.Add(def, def.initial);
    if (def.path != nullptr) on_paths_.push_back(&def);
  }
  FollowPaths(tick);
}

void Bodies::FollowPaths(Tick tick) {
  if (on_paths_.empty() || on_paths_at_ == tick) return;
  const double rate_hz = catalog_.scene().tick_rate_hz;
  for (const BodyDef* def : on_paths_) world_.SetState(def->id, physics::StateOn(*def->path, tick, rate_hz));
  on_paths_at_ = tick;
}

std::ptrdiff_t Bodies::IndexOf(BodyId id) const {
  if (places_noted_) {
    const std::ptrdiff_t place = PlaceOf(id);
    return place < std::ssize(owned_) ? place : -1;
  }
  const auto it = std::ranges::lower_bound(owned_ids_, id);
  return it != owned_ids_.end() && *it == id ? it - owned_ids_.begin() : -1;
}

const Ghost* Bodies::FindGhost(BodyId id) const {
  if (places_noted_) {
    const std::ptrdiff_t place = PlaceOf(id) - std::ssize(owned_);
    return place >= 0 ? &ghosts_[static_cast<std::size_t>(place)] : nullptr;
  }
  const auto it = std::lower_bound(ghosts_.begin(), ghosts_.end(), id,
                                   [](const Ghost& g, BodyId wanted) { return g.record.id < wanted; });
  return it != ghosts_.end() && it->record.id == id ? &*it : nullptr;
}

std::ptrdiff_t Bodies::PlaceOf(BodyId id) const {
  if (places_noted_) {
    const auto it = places_.find(id);
    return it == places_.end() ? -1 : static_cast<std::ptrdiff_t>(it->second);
  }
  if (const std::ptrdiff_t index = IndexOf(id); index >= 0) return index;
  const Ghost* ghost = FindGhost(id);
  return ghost == nullptr ? -1 : std::ssize(owned_) + (ghost - ghosts_.data());
}

const BodyDef& Bodies::DefAt(std::size_t place) const {
  return place < owned_.size() ? *owned_[place].def : *ghosts_[place - owned_.size()].def;
}

const BodyState& Bodies::StateAt(std::size_t place) const {
  return place < owned_.size() ? owned_[place].state : ghosts_[place - owned_.size()].record.state;
}

const OwnedBody* Bodies::FindBodiless(BodyId id) const {
  const auto at = std::ranges::find_if(bodiless_, [id](const OwnedBody& entity) { return entity.def->id == id; });
  return at == bodiless_.end() ? nullptr : &*at;
}

Epoch Bodies::EpochOf(BodyId id) const {
  if (const std::ptrdiff_t index = IndexOf(id); index >= 0) return owned_[static_cast<std::size_t>(index)].epoch;
  const OwnedBody* entity = FindBodiless(id);
  return entity == nullptr ? Epoch() : entity->epoch;
}

std::vector<std::size_t> Bodies::OwnedAssembly(std::size_t index) const {
  std::vector<std::size_t> members;
  for (const BodyId id : AssemblyOf(owned_[index].def->id)) {
    const std::ptrdiff_t member = IndexOf(id);
    if (member >= 0) members.push_back(static_cast<std::size_t>(member));
  }
  return members;
}

void Bodies::OwnedChanged() {
  places_noted_ = false;
  changed_since_step_ = true;
  ++ownership_revision_;
}

// Bodies that are in the world keep their entries, so that only places that changed cost more than a look. Those of the
// others are taken out with them.
void Bodies::NotePlaces() {
  if (places_noted_) return;
  std::uint32_t place = 0;
  const auto note = [&](BodyId id) {
    const auto [noted, added] = places_.try_emplace(id, place);
    if (added || noted->second != place) {
      noted->second = place;
      world_.SetTag(id, place);
    }
    ++place;
  };
  for (const BodyId id : owned_ids_) note(id);
  for (const Ghost& ghost : ghosts_) note(ghost.record.id);
  places_noted_ = true;
  assert(places_.size() == places());
}

void Bodies::Own(BodyId id, Epoch epoch, const BodyState& state, bool jumped) {
  assert(!Owns(id));
  OwnedChanged();
  const BodyDef* def = DefOf(id);
  if (const Ghost* ghost = FindGhost(id); ghost != nullptr) {
    ghosts_.erase(ghosts_.begin() + (ghost - ghosts_.data()));
    world_.SetSupportHint(id, {});
    world_.SetExclusionGroup(id, physics::ExclusionGroup::kNone);
    if (jumped) {
      world_.Teleport(id, state);
    } else {
      Write(id, state);
    }
  } else {
    AddToWorld(*def, state);
  }
  const auto place = std::ranges::lower_bound(owned_ids_, id) - owned_ids_.begin();
  owned_ids_.insert(owned_ids_.begin() + place, id);
  radii_m_.insert(radii_m_.begin() + place, RadiusOf(id));
  owned_.insert(owned_.begin() + place, OwnedBody{def, epoch, world_.StateOf(id), def->gravity_scale});
}

void Bodies::Restore(BodyId id, Epoch epoch, const BodyState& state) {
  Own(id, epoch, state);
  prime_contacts_ = true;
}

void Bodies::BecomeGhost(const GhostRecord& record, RegionId owner) {
  const std::ptrdiff_t index = IndexOf(record.id);
  assert(index >= 0);
  OwnedChanged();
  Ghost ghost{record, owner, owned_[static_cast<std::size_t>(index)].def, true, false};
  TakeOutOwned(index);
  const auto at = std::lower_bound(ghosts_.begin(), ghosts_.end(), record.id,
                                   [](const Ghost& g, BodyId wanted) { return g.record.id < wanted; });
  ghosts_.insert(at, ghost);
}

void Bodies::RemoveOwned(BodyId id) {
  const std::ptrdiff_t index = IndexOf(id);
  assert(index >= 0);
  OwnedChanged();
  TakeOutOwned(index);
  RemoveFromWorld(id);
}

void Bodies::TakeOutOwned(std::ptrdiff_t index) {
  owned_.erase(owned_.begin() + index);
  owned_ids_.erase(owned_ids_.begin() + index);
  radii_m_.erase(radii_m_.begin() + index);
}

void Bodies::Teleport(BodyId id, const BodyState& state) {
  const std::ptrdiff_t index = IndexOf(id);
  assert(index >= 0);
  world_.Teleport(id, state);
  owned_[static_cast<std::size_t>(index)].state = world_.StateOf(id);
}

void Bodies::Drive(BodyId id, const BodyState& state) {
  const std::ptrdiff_t index = IndexOf(id);
  assert(index >= 0);
  Write(id, state);
  owned_[static_cast<std::size_t>(index)].state = world_.StateOf(id);
}

void Bodies::TuneInWorld(const BodyDef& def, const BodyTuning& tuning) {
  world_.SetGravityScale(def.id, GravityScaleOf(def, tuning));
  world_.SetMaterial(def.id, MaterialOf(def, tuning));
}

void Bodies::Tune(BodyId id, const BodyTuning& tuning) {
  const std::ptrdiff_t index = IndexOf(id);
  assert(index >= 0);
  OwnedBody& body = owned_[static_cast<std::size_t>(index)];
  body.gravity_scale = GravityScaleOf(*body.def, tuning);
  TuneInWorld(*body.def, tuning);
}

void Bodies::OwnBodiless(BodyId id, Epoch epoch, const BodyState& state) {
  assert(!Owns(id));
  BodyDef& def = bodiless_defs_[id];
  def.id = id;
  const auto at = std::ranges::lower_bound(bodiless_, id, {}, [](const OwnedBody& entity) { return entity.def->id; });
  bodiless_.insert(at, OwnedBody{&def, epoch, state});
}

void Bodies::RemoveBodiless(BodyId id) {
  std::erase_if(bodiless_, [id](const OwnedBody& entity) { return entity.def->id == id; });
  bodiless_defs_.erase(id);
}

void Bodies::ForgetGrants() {
  for (Ghost& ghost : ghosts_) ghost.just_granted = false;
}

void Bodies::PlaceGhosts(std::span<const Ghost> reported) {
  std::vector<Ghost> placed;
  placed.reserve(reported.size());
  auto old = ghosts_.begin();
  const auto pass_over = [&] {
    if (old->just_granted) {
      old->just_granted = false;
      placed.push_back(*old);
    } else {
      RemoveFromWorld(old->record.id);
    }
    ++old;
  };
  for (const Ghost& ghost : reported) {
    const BodyId id = ghost.record.id;
    while (old != ghosts_.end() && old->record.id < id) pass_over();
    placed.push_back(ghost);
    const GhostRecord& record = ghost.record;
    if (old != ghosts_.end() && old->record.id == id) {
      placed.back().def = old->def;
      if (record.jumped) {
        world_.Teleport(id, record.state);
      } else {
        Write(id, record.state);
      }
      if (record.tuning != old->record.tuning) TuneInWorld(*old->def, record.tuning);
      ++old;
    } else {
      placed.back().def = DefOf(id);
      AddToWorld(*placed.back().def, record.state);
      if (!record.tuning.empty()) TuneInWorld(*placed.back().def, record.tuning);
    }
    const bool supported = record.externally_supported || record.load_ns != Vec3f() || record.load_nms != Vec3f();
    world_.SetSupportHint(id, {.external = supported, .island_load = record.island_load});
    world_.SetExclusionGroup(id, record.settled ? kSettledGhosts : physics::ExclusionGroup::kNone);
  }
  while (old != ghosts_.end()) pass_over();
  const auto same = [](const Ghost& a, const Ghost& b) { return a.record.id == b.record.id; };
  if (!std::equal(placed.begin(), placed.end(), ghosts_.begin(), ghosts_.end(), same)) places_noted_ = false;
  ghosts_ = std::move(placed);
}

void Bodies::Place(BodyId id, const BodyState& state) {
  const std::ptrdiff_t index = IndexOf(id);
  assert(index >= 0);
  const bool parked = world_.IsParked(id);
  if (parked) world_.Unpark(id);
  world_.SetState(id, state);
  if (parked) world_.Park(id);
  owned_[static_cast<std::size_t>(index)].state = world_.StateOf(id);
}

bool Bodies::Park(BodyId id) {
  if (!world_.Has(id) || world_.IsParked(id)) return false;
  world_.Park(id);
  reread_.push_back(id);
  return true;
}

void Bodies::Unpark(BodyId id) {
  if (!world_.Has(id)) return;
  world_.Unpark(id);
  reread_.push_back(id);
}

void Bodies::NotePoses(Tick tick, double tick_s, std::size_t ticks) {
  noted_ghosts_.clear();
  noted_fixed_.clear();
  for (const Ghost& ghost : ghosts_) noted_ghosts_.push_back(ghost.record.id);
  for (const BodyDef* def : on_paths_) noted_fixed_.push_back(def->id);
  std::ranges::sort(noted_fixed_);
  world_.NotePoses(tick, tick_s, {owned_ids_, noted_ghosts_, noted_fixed_}, ticks);
}

void Bodies::Step(double tick_s, Tick tick) {
  FollowPaths(tick);
  if (std::exchange(prime_contacts_, false)) world_.PrimeContacts(tick_s, kPrimingSolves);
  world_.Step(tick_s);
  FollowPaths(tick + 1);
  stepped_ = true;
  stepped_places_ = places();
  changed_since_step_ = false;
  if (!catalog_.has_game()) return;
  stepped_ids_ = owned_ids_;
  for (const Ghost& ghost : ghosts_) stepped_ids_.push_back(ghost.record.id);
}

std::vector<std::pair<BodyId, Epoch>> Bodies::ReadBack() {
  absurd_.clear();
  if (places_noted_ && !changed_since_step_) {
    ReadStepped();
  } else {
    ReadAll();
  }
  reread_.clear();
  if (!world_.isolated().empty()) {
    for (const BodyId id : world_.isolated()) absurd_.push_back(id);
    std::ranges::sort(absurd_);
    absurd_.erase(std::unique(absurd_.begin(), absurd_.end()), absurd_.end());
  }
  return absurd_.empty() ? std::vector<std::pair<BodyId, Epoch>>() : TakeOutAbsurd();
}

void Bodies::ReadAll() {
  for (OwnedBody& body : owned_) {
    body.state = world_.StateOf(body.def->id);
    if (!IsSane(body.state)) absurd_.push_back(body.def->id);
  }
  for (const Ghost& ghost : ghosts_) {
    if (!IsSane(world_.StateOf(ghost.record.id))) absurd_.push_back(ghost.record.id);
  }
  std::ranges::sort(absurd_);
}

// Whatever else happens to the state of an owned body in the world is noted here when it happens.
void Bodies::ReadStepped() {
  const auto read = [&](std::size_t place, const BodyState& state) {
    if (place >= places()) return;
    if (place < owned_.size()) owned_[place].state = state;
    if (!IsSane(state)) absurd_.push_back(IdAt(place));
  };
  world_.ForEachStepped([&](std::uint32_t tag, const BodyState& state) { read(tag, state); });
  for (const BodyId id : reread_) {
    if (const std::ptrdiff_t place = PlaceOf(id); place >= 0) read(static_cast<std::size_t>(place), world_.StateOf(id));
  }
  std::ranges::sort(absurd_);
}

std::vector<std::pair<BodyId, Epoch>> Bodies::TakeOutAbsurd() {
  std::vector<std::pair<BodyId, Epoch>> lost;
  for (const BodyId id : absurd_) {
    if (const std::ptrdiff_t index = IndexOf(id); index >= 0) {
      lost.emplace_back(id, owned_[static_cast<std::size_t>(index)].epoch);
    }
  }
  for (const auto& [id, epoch] : lost) RemoveOwned(id);
  std::erase_if(ghosts_, [&](const Ghost& ghost) {
    if (!std::ranges::binary_search(absurd_, ghost.record.id)) return false;
    places_noted_ = false;
    changed_since_step_ = true;
    RemoveFromWorld(ghost.record.id);
    return true;
  });
  return lost;
}

void Bodies::AddNear(BodyId id, std::vector<std::uint32_t>* near) const {
  if (stepped_) return world_.AddNear(id, near);
  // The world looks for pairs in its first step.
  for (const BodyId found : world_.Overlapping(world_.BoundsOf(id).Expanded(kAbout_m))) {
    near->push_back(static_cast<std::uint32_t>(PlaceOf(found)));  // -1: kNoTag
  }
}

std::span<const physics::PairImpulse> Bodies::ImpulsesNearBorders(absl::FunctionRef<bool(std::size_t)> near,
                                                                  bool any_near) const {
  enum : std::uint8_t { kOwn = 1, kNear = 2 };
  const auto bits_at = [&](std::size_t i) -> std::uint8_t { return near(i) ? kOwn | kNear : kOwn; };
  if (!changed_since_step_) {
    if (!any_near && ghosts_.empty()) return {};
    std::vector<std::uint8_t> bits(places(), kNear);
    for (std::size_t i = 0; i < owned_.size(); ++i) bits[i] = bits_at(i);
    return world_.ImpulsesOf(bits);
  }
  // Bodies that came or went since the step shifted places: the world has noted the ones of before. Those that went
  // are nobody's concern. Without a game they go one in a million, and nobody has kept which they were.
  if (stepped_ids_.empty()) {
    return world_.ImpulsesOf(std::vector<std::uint8_t>(stepped_places_, kOwn | kNear));
  }
  std::vector<std::uint8_t> bits(stepped_places_, 0);
  for (std::size_t i = 0; i < stepped_ids_.size(); ++i) {
    const std::ptrdiff_t place = PlaceOf(stepped_ids_[i]);
    if (place < 0) continue;
    bits[i] = place < std::ssize(owned_) ? bits_at(static_cast<std::size_t>(place)) : std::uint8_t{kNear};
  }
  return world_.ImpulsesOf(bits);
}

void Bodies::Validate() const {
  assert(Ascends(owned_, [](const OwnedBody& body) { return body.def->id; }));
  assert(Ascends(ghosts_, [](const Ghost& ghost) { return ghost.record.id; }));
  assert(Ascends(bodiless_, [](const OwnedBody& entity) { return entity.def->id; }));
  assert(std::ranges::none_of(bodiless_, [this](const OwnedBody& entity) { return IndexOf(entity.def->id) >= 0; }));
  assert(radii_m_.size() == owned_.size());
  assert(std::ranges::equal(owned_, owned_ids_, {}, [](const OwnedBody& body) { return body.def->id; }));
  assert(std::ranges::all_of(owned_, [this](const OwnedBody& body) {
    return world_.Has(body.def->id) && FindGhost(body.def->id) == nullptr;
  }));
  assert(std::ranges::all_of(
      ghosts_, [this](const Ghost& ghost) { return world_.Has(ghost.record.id) && ghost.def->id == ghost.record.id; }));
}

const BodyDef* Bodies::DefOf(BodyId id) {
  const bool player = IsPlayerBody(id);
  if (!player && !IsSpawned(id)) return catalog_.Find(id);
  const auto it = made_defs_.find(id);
  if (it != made_defs_.end()) return &it->second;
  BodyDef def = player ? catalog_.MakePlayer(PlayerOf(id)) : MakeSpawned(catalog_.scene(), id);
  return &made_defs_.emplace(id, std::move(def)).first->second;
}

void Bodies::AddToWorld(const BodyDef& def, const BodyState& state) {
  world_.Add(def, state);
  unconnected_.push_back(def.id);
}

void Bodies::RemoveFromWorld(BodyId id) {
  world_.Remove(id);
  places_.erase(id);
  left_.push_back(id);
  made_defs_.erase(id);
}

void Bodies::Write(BodyId id, const BodyState& state) {
  if (!SameBits(state, world_.StateOf(id))) world_.SetState(id, state);
}

double Bodies::RadiusOf(BodyId id) const {
  const Aabb box = world_.BoundsOf(id);
  const Vec3d center = world_.StateOf(id).position;
  const Vec3d far{std::max(box.max.x - center.x, center.x - box.min.x),
                  std::max(box.max.y - center.y, center.y - box.min.y),
                  std::max(box.max.z - center.z, center.z - box.min.z)};
  return Length(far);
}

}  // namespace tessera::region
