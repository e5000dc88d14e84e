// Bodies: what is in this region's physics world: static bodies, owned ones, and ghosts of the neighbours'.
//
// Promise: `owned` and `ghosts` are ascending by id and disjoint; every member is in the world, with all joints whose
// bodies are there. A state that the world holds already is not written again, so contact caches and sleep live on
// where both sides agree. Thread rule: one thread at a time.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/physics/world.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"
#include "core/region/region.h"

namespace tessera::region {

// Beside each OwnedBody, at the same index.
struct OwnedExtra {
  double radius_m = 0;  // bound of the shape about its centre of mass
  Vec3d field_m_s2;     // what the scene's fields do to it in the next step
  bool field_known = false;
  std::uint8_t still_ticks = 0;  // for how many, up to kCalmTicks, it has been shown and hardly moved
  bool predicted = false;        // near a border and not calm:
  Vec3d predicted_position;      // for the next tick
};

struct Ghost {
  GhostRecord record;  // as its owner last told
  RegionId owner;
  const BodyDef* def = nullptr;
  bool just_granted = false;  // was owned here in the last step: no neighbour shows it yet
  bool told = false;          // its owner told of it for this step
};

class Bodies {
 public:
  Bodies(const Catalog& catalog, const physics::Settings& settings);

  physics::World& world() { return world_; }
  const physics::World& world() const { return world_; }
  std::span<const OwnedBody> owned() const { return owned_; }
  std::span<OwnedExtra> extras() { return extras_; }
  std::span<const OwnedExtra> extras() const { return extras_; }
  std::span<const Ghost> ghosts() const { return ghosts_; }
  // Index into owned(), or -1.
  std::ptrdiff_t IndexOf(BodyId id) const;
  bool Owns(BodyId id) const { return IndexOf(id) >= 0; }
  const Ghost* FindGhost(BodyId id) const;
  // Index into owned(), or owned().size() and the index into ghosts(); or -1.
  std::ptrdiff_t PlaceOf(BodyId id) const;
  // Makes these three quick, until what is owned or shown changes, and places the tags of bodies in the world.
  void NotePlaces();

  // Owns a body that is new here or was a ghost.
  void Own(BodyId id, Epoch epoch, const BodyState& state);
  // An owned body lives on as a ghost of `record.epoch`'s owner.
  void BecomeGhost(const GhostRecord& record, RegionId owner);
  void RemoveOwned(BodyId id);
  // Ghosts that were just granted are as any others.
  void ForgetGrants() {
    for (Ghost& ghost : ghosts_) ghost.just_granted = false;
  }
  // Makes the ghosts those of `shown` (ascending by id, none owned here) and those just granted.
  void PlaceGhosts(std::span<const Ghost> shown);
  // What was taken out of the world since the last call; some may be back.
  std::vector<BodyId> TakeLeft() { return std::exchange(left_, {}); }
  // Ties bodies that came since the last call.
  void TieJoints();
  // Reads the states of the owned bodies. Those that are not sane are taken out and returned, ascending; ghosts that
  // are not sane are taken out silently: their owner tells them anew.
  std::vector<std::pair<BodyId, Epoch>> ReadBack();

 private:
  const BodyDef* DefOf(BodyId id);
  void AddToWorld(const BodyDef& def, const BodyState& state);
  void RemoveFromWorld(BodyId id);
  void Write(BodyId id, const BodyState& state);
  double RadiusOf(BodyId id) const;

  const Catalog& catalog_;
  physics::World world_;
  std::vector<OwnedBody> owned_;
  std::vector<OwnedExtra> extras_;
  std::vector<Ghost> ghosts_;
  absl::flat_hash_map<BodyId, std::uint32_t> places_;  // by PlaceOf; only looked up
  bool places_noted_ = false;                          // they are as they are now
  std::map<BodyId, BodyDef> player_defs_;
  std::vector<BodyId> left_;  // see TakeLeft
  std::vector<BodyId> untied_;
};

}  // namespace tessera::region
