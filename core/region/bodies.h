// Bodies: the physics world of a region, and in it static bodies, owned ones, and ghosts of the neighbours'.
//
// Promise: `owned` and `ghosts` are ascending by id and disjoint; every member is in the world, with all joints whose
// bodies are there. A state that the world holds already is not written again, so contact caches and sleep live on
// where both sides agree.
//
// Bodiless entities are owned like bodies and are in no world: the instance's record, and what is left of a removed
// body until its messages are acknowledged. They have a place on the ground, and go where that goes.
//
// A place is an index into owned(), or owned().size() and an index into ghosts(): the tag of the body in the world.
//
// It has some 65 methods because the physics world is behind it and nowhere else: whatever is changed there, the lists
// beside it are kept true. Thread rule: one thread at a time.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/function_ref.h"
#include "core/physics/world.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"
#include "core/region/owned_body.h"

namespace tessera::region {

struct Ghost {
  GhostRecord record;  // as its owner last reported it
  RegionId owner;
  const BodyDef* def = nullptr;
  bool just_granted = false;  // was owned here in the last step: no neighbour reports it yet
  bool reported = false;      // its owner reported it for this step
};

class Bodies {
 public:
  // Bodies with paths are where they are at `tick`.
  Bodies(const Catalog& catalog, const physics::WorldSettings& settings, Tick tick = Tick());

  // --- Who is here.
  const physics::World& world() const { return world_; }
  std::span<const OwnedBody> owned() const { return owned_; }
  std::span<const BodyId> owned_ids() const { return owned_ids_; }  // beside owned()
  std::span<const Ghost> ghosts() const { return ghosts_; }
  // Bound of the shape of an owned body about its centre of mass, m.
  double radius_m(std::size_t index) const { return radii_m_[index]; }
  // Index into owned(), or -1.
  std::ptrdiff_t IndexOf(BodyId id) const;
  bool Owns(BodyId id) const { return IndexOf(id) >= 0 || (!bodiless_.empty() && FindBodiless(id) != nullptr); }
  // Ascending.
  std::span<const OwnedBody> bodiless() const { return bodiless_; }
  const OwnedBody* FindBodiless(BodyId id) const;
  // By index into owned(), and beyond that into bodiless().
  const OwnedBody& EntityAt(std::size_t index) const {
    return index < owned_.size() ? owned_[index] : bodiless_[index - owned_.size()];
  }
  // Epoch of what is owned here, bodiless or not; 0 without it.
  Epoch EpochOf(BodyId id) const;
  const Ghost* FindGhost(BodyId id) const;
  // The place of a body, or -1.
  std::ptrdiff_t PlaceOf(BodyId id) const;
  std::size_t places() const { return owned_.size() + ghosts_.size(); }
  BodyId IdAt(std::size_t place) const { return DefAt(place).id; }
  const BodyDef& DefAt(std::size_t place) const;
  // State after the last step, of a ghost as its owner reported it.
  const BodyState& StateAt(std::size_t place) const;
  // Indices of those bodies of its assembly that are owned here, ascending.
  std::vector<std::size_t> OwnedAssembly(std::size_t index) const;
  // Grows whenever owned() gains or loses a body.
  std::uint64_t ownership_revision() const { return ownership_revision_; }

  // --- Who owns what.
  // Owns a body that is new here or was a ghost.
  // `jumped`: it was put there, so a ghost of it did not move there.
  void Own(BodyId id, Epoch epoch, const BodyState& state, bool jumped = false);
  // Owns a body of a saved state: nobody here remembers its contacts, so the next step primes them.
  void Restore(BodyId id, Epoch epoch, const BodyState& state);
  // An owned body lives on as a ghost of `record.epoch`'s owner.
  void BecomeGhost(const GhostRecord& record, RegionId owner);
  void RemoveOwned(BodyId id);
  // An entity without a body comes to be owned here, and is so no more.
  void OwnBodiless(BodyId id, Epoch epoch, const BodyState& state);
  void RemoveBodiless(BodyId id);
  // Ghosts that were just granted are from now on as any others.
  void ForgetGrants();
  // Makes the ghosts those of `reported` (ascending by id, none owned here) and those just granted.
  void PlaceGhosts(std::span<const Ghost> reported);
  // An owned body is put elsewhere: its contacts end, and what it touched wakes.
  void Teleport(BodyId id, const BodyState& state);
  // An owned body's definition changes as a game asks.
  void Tune(BodyId id, const BodyTuning& tuning);
  // An owned kinematic body has this state, with which it makes the next step.
  void Drive(BodyId id, const BodyState& state);
  // Bodies taken out of the world since the last call; some may be back.
  std::vector<BodyId> TakeLeft() { return std::exchange(left_, {}); }
  // Connects bodies that came since the last call.
  void ConnectJoints();
  // The joints that a game made and that are in force, ascending by id, take the place of those of the last call. Both
  // bodies of each are here. One of a parked body waits until it takes part again.
  void SetGameJoints(std::vector<JointDef> joints);
  std::span<const JointDef> game_joints() const { return game_joints_; }
  // Bodies of the same assembly, `id` among them, by joints of the scene, of prefabs and of a game. Valid until
  // SetGameJoints changes anything.
  Assembly AssemblyOf(BodyId id) const;
  // Whether any two bodies may be jointed.
  bool has_joints() const { return catalog_.has_joints() || !game_joints_.empty(); }
  // Makes IndexOf, FindGhost and PlaceOf quick until the bodies change, and gives the world their places as tags.
  void NotePlaces();

  // --- A step.
  void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) { world_.ApplyForce(id, force_n, torque_nm); }
  void Wake(BodyId id) { world_.Wake(id); }
  // An owned body is there from now on; one that is parked stays so.
  void Place(BodyId id, const BodyState& state);
  // Whether the body is here and was not parked yet.
  bool Park(BodyId id);
  void Unpark(BodyId id);  // if it is here
  // To the tick after `tick`.
  void Step(double tick_s, Tick tick);
  bool stepped() const { return stepped_; }  // at least once
  // Remembers where the bodies are after the step to `tick`, for queries that look back.
  void NotePoses(Tick tick, double tick_s, std::size_t ticks);
  void ForgetPoses() { world_.ForgetPoses(); }
  // Reads the states of the owned bodies. Those that are not sane are taken out and returned, ascending; ghosts that
  // are not sane are taken out silently: their owner reports them anew.
  std::vector<std::pair<BodyId, Epoch>> ReadBack();

  // --- What the last step found.
  // Adds the places of bodies that are about this one, physics::kNoTag for static ones, in no order.
  void AddNear(BodyId id, std::vector<std::uint32_t>* near) const;
  // Contacts between owned bodies and ghosts, and those of owned bodies that are `near` a border (by index): whatever
  // else touches is no other region's concern. `any_near`: false if `near` holds for none. Valid until this is called
  // again, or the bodies change.
  std::span<const physics::PairImpulse> ImpulsesNearBorders(absl::FunctionRef<bool(std::size_t)> near,
                                                            bool any_near = true) const;

  void Validate() const;

 private:
  const BodyDef* DefOf(BodyId id);
  void AddToWorld(const BodyDef& def, const BodyState& state);
  void RemoveFromWorld(BodyId id);
  void Write(BodyId id, const BodyState& state);
  void TuneInWorld(const BodyDef& def, const BodyTuning& tuning);
  double RadiusOf(BodyId id) const;
  void OwnedChanged();
  void TakeOutOwned(std::ptrdiff_t index);  // from the lists alone
  void FollowPaths(Tick tick);
  // Parts of ReadBack. The first two read all states, and those that may be others than before; they fill absurd_.
  void ReadAll();
  void ReadStepped();
  std::vector<std::pair<BodyId, Epoch>> TakeOutAbsurd();
  void FindGameAssemblies();

  const Catalog& catalog_;
  physics::World world_;
  std::vector<OwnedBody> owned_;
  std::vector<BodyId> owned_ids_;  // beside owned_, and all that looking for a body reads
  std::vector<double> radii_m_;    // beside owned_
  std::vector<OwnedBody> bodiless_;
  std::map<BodyId, BodyDef> bodiless_defs_;  // definitions of bodiless_; nothing but their ids counts
  std::vector<Ghost> ghosts_;
  absl::flat_hash_map<BodyId, std::uint32_t> places_;  // only looked up
  bool places_noted_ = false;                          // places_ is up to date
  std::uint64_t ownership_revision_ = 0;
  std::map<BodyId, BodyDef> made_defs_;  // definitions of players, and of all that a game made
  std::vector<BodyId> left_;             // see TakeLeft
  std::vector<BodyId> unconnected_;
  std::vector<JointDef> game_joints_;               // ascending by id
  std::vector<std::vector<BodyId>> assemblies_;     // those that game joints make, each ascending
  std::map<BodyId, std::size_t> game_assembly_of_;  // index into assemblies_
  std::vector<const BodyDef*> on_paths_;
  std::vector<BodyId> noted_ghosts_, noted_fixed_;  // scratch of NotePoses
  std::optional<Tick> on_paths_at_;
  std::vector<BodyId> reread_;       // outside of steps they came to have a state that owned() does not have
  std::vector<BodyId> absurd_;       // scratch of ReadBack: ascending in the end
  bool prime_contacts_ = false;      // before the next step
  bool stepped_ = false;             // at least once
  std::size_t stepped_places_ = 0;   // places() in the last step
  std::vector<BodyId> stepped_ids_;  // by place in the last step, where a game runs
  bool changed_since_step_ = false;  // bodies came or went
};

}  // namespace tessera::region
