#include "core/region/bodies.h"

#include <algorithm>
#include <cassert>

#include "core/world/state_check.h"

namespace tessera::region {

Bodies::Bodies(const Catalog& catalog, const physics::Settings& settings) : catalog_(catalog), world_(settings) {
  for (const BodyDef& def : catalog.scene().bodies) {
    if (def.motion == Motion::kStatic) world_.Add(def, def.initial);
  }
}

std::ptrdiff_t Bodies::IndexOf(BodyId id) const {
  if (places_noted_) {
    const std::ptrdiff_t place = PlaceOf(id);
    return place < std::ssize(owned_) ? place : -1;
  }
  const auto it = std::lower_bound(owned_.begin(), owned_.end(), id,
                                   [](const OwnedBody& b, BodyId wanted) { return b.def->id < wanted; });
  return it != owned_.end() && it->def->id == id ? it - owned_.begin() : -1;
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

void Bodies::NotePlaces() {
  if (places_noted_) return;
  places_.clear();
  std::uint32_t place = 0;
  const auto note = [&](BodyId id) {
    places_.emplace(id, place);
    world_.SetTag(id, place++);
  };
  for (const OwnedBody& body : owned_) note(body.def->id);
  for (const Ghost& ghost : ghosts_) note(ghost.record.id);
  places_noted_ = true;
}

void Bodies::Own(BodyId id, Epoch epoch, const BodyState& state) {
  assert(!Owns(id));
  places_noted_ = false;
  const BodyDef* def = DefOf(id);
  if (const Ghost* ghost = FindGhost(id); ghost != nullptr) {
    ghosts_.erase(ghosts_.begin() + (ghost - ghosts_.data()));
    world_.SetElsewhere(id, {});
    Write(id, state);
  } else {
    AddToWorld(*def, state);
  }
  const auto at = std::lower_bound(owned_.begin(), owned_.end(), id,
                                   [](const OwnedBody& b, BodyId wanted) { return b.def->id < wanted; });
  OwnedExtra extra;
  extra.radius_m = RadiusOf(id);
  extras_.insert(extras_.begin() + (at - owned_.begin()), extra);
  owned_.insert(at, OwnedBody{def, epoch, world_.StateOf(id)});
}

void Bodies::BecomeGhost(const GhostRecord& record, RegionId owner) {
  const std::ptrdiff_t index = IndexOf(record.id);
  assert(index >= 0);
  places_noted_ = false;
  Ghost ghost{record, owner, owned_[static_cast<std::size_t>(index)].def, true, false};
  owned_.erase(owned_.begin() + index);
  extras_.erase(extras_.begin() + index);
  const auto at = std::lower_bound(ghosts_.begin(), ghosts_.end(), record.id,
                                   [](const Ghost& g, BodyId wanted) { return g.record.id < wanted; });
  ghosts_.insert(at, ghost);
}

void Bodies::RemoveOwned(BodyId id) {
  const std::ptrdiff_t index = IndexOf(id);
  assert(index >= 0);
  places_noted_ = false;
  owned_.erase(owned_.begin() + index);
  extras_.erase(extras_.begin() + index);
  RemoveFromWorld(id);
}

void Bodies::PlaceGhosts(std::span<const Ghost> shown) {
  std::vector<Ghost> placed;
  placed.reserve(shown.size());
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
  for (const Ghost& ghost : shown) {
    const BodyId id = ghost.record.id;
    while (old != ghosts_.end() && old->record.id < id) pass_over();
    placed.push_back(ghost);
    if (old != ghosts_.end() && old->record.id == id) {
      placed.back().def = old->def;
      Write(id, ghost.record.state);
      ++old;
    } else {
      placed.back().def = DefOf(id);
      AddToWorld(*placed.back().def, ghost.record.state);
    }
    const GhostRecord& told = ghost.record;
    const bool propped = told.propped || told.load_ns != Vec3f() || told.load_nms != Vec3f();
    world_.SetElsewhere(id, {.propped = propped, .stand_in = told.calm, .island_load = told.island_load});
  }
  while (old != ghosts_.end()) pass_over();
  const auto same = [](const Ghost& a, const Ghost& b) { return a.record.id == b.record.id; };
  if (!std::equal(placed.begin(), placed.end(), ghosts_.begin(), ghosts_.end(), same)) places_noted_ = false;
  ghosts_ = std::move(placed);
}

void Bodies::TieJoints() {
  std::vector<const JointDef*> joints;
  for (const BodyId id : untied_) {
    for (const JointDef* joint : catalog_.JointsOf(id)) joints.push_back(joint);
  }
  untied_.clear();
  const auto by_id = [](const JointDef* a, const JointDef* b) { return a->id < b->id; };
  std::sort(joints.begin(), joints.end(), by_id);
  joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
  for (const JointDef* joint : joints) {
    const bool a_here = world_.Has(joint->body_a);
    const bool b_here = joint->body_b == BodyId() || world_.Has(joint->body_b);
    if (a_here && b_here && !world_.HasJoint(joint->id)) world_.AddJoint(*joint);
  }
}

std::vector<std::pair<BodyId, Epoch>> Bodies::ReadBack() {
  std::vector<BodyId> isolated(world_.isolated().begin(), world_.isolated().end());
  std::sort(isolated.begin(), isolated.end());
  const auto absurd = [&](BodyId id, const BodyState& state) {
    return !IsSane(state) || std::binary_search(isolated.begin(), isolated.end(), id);
  };
  std::vector<std::pair<BodyId, Epoch>> lost;
  for (OwnedBody& body : owned_) {
    body.state = world_.StateOf(body.def->id);
    if (absurd(body.def->id, body.state)) lost.emplace_back(body.def->id, body.epoch);
  }
  for (const auto& [id, epoch] : lost) RemoveOwned(id);
  std::erase_if(ghosts_, [&](const Ghost& ghost) {
    if (!absurd(ghost.record.id, world_.StateOf(ghost.record.id))) return false;
    places_noted_ = false;
    RemoveFromWorld(ghost.record.id);
    return true;
  });
  return lost;
}

const BodyDef* Bodies::DefOf(BodyId id) {
  if (!IsPlayerBody(id)) return catalog_.Find(id);
  const auto it = player_defs_.find(id);
  if (it != player_defs_.end()) return &it->second;
  return &player_defs_.emplace(id, catalog_.MakePlayer(PlayerOf(id))).first->second;
}

void Bodies::AddToWorld(const BodyDef& def, const BodyState& state) {
  world_.Add(def, state);
  untied_.push_back(def.id);
}

void Bodies::RemoveFromWorld(BodyId id) {
  world_.Remove(id);
  left_.push_back(id);
  player_defs_.erase(id);
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
