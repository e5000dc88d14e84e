// World: the rigid bodies that one region simulates, one tick at a time.
//
// Positions and orientations are doubles in world space, and contacts are found from relative poses, so errors far from
// home are those at home. The result does not depend on the order of calls that add and remove, nor on what else is in
// the world: the same bodies do the same, to the bit, on every host. Inside: Bullet's broad phase, shapes and queries;
// contacts, solver, integrator and sweeps of our own (docs/architecture.md).
//
//   World world({.origin = {500, 0, 500}, .gravity_m_s2 = scene.gravity_m_s2});
//   world.Add(def, def.initial);
//   world.Step(1.0 / 60);
//   BodyState state = world.StateOf(def.id);
//
// Callers' mistakes (an unknown id, a second Add of one id) are assertions: input is checked before it gets here.
// Thread rule: one thread at a time.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/world/scene.h"

namespace tessera::physics {

struct Settings {
  Vec3d origin{};  // about which bounds and queries work in floats, m
  Vec3d gravity_m_s2{0, -9.81, 0};
  int substeps = 0;       // of every island that is solved; 0: as many as each needs
  bool sleep = true;      // bodies that are still fall asleep
  bool portable = false;  // solve with what every processor has, rather than with the widest it has; the same bits
};

// The tag of a body that nobody has given one (World::SetTag).
inline constexpr std::uint32_t kNoTag = 0xffffffff;

// What a body has to do with what is not in this world.
struct Elsewhere {
  // It rests on such bodies, or bears them, and forces stand for them: what lies on what it touches is then told by
  // what it pressed with, not by what is seen to stand on it.
  bool propped = false;
  // Two that are stand-ins do not touch: what they do to each other is among the forces that act on them.
  bool stand_in = false;
  // What the island that it belongs to bears there (World::IslandLoadOf): here it gets no fewer substeps for it.
  float island_load = 0;
};

// What two touching bodies did to each other in the last step, summed over their contact points: normal, lateral,
// rolling and spinning; and what two that stopped each other's way got for it. body_a < body_b. None for pairs that
// slept at its start, and none with a trigger.
struct PairImpulse {
  BodyId body_a, body_b;
  std::uint32_t tag_a = kNoTag, tag_b = kNoTag;      // see World::SetTag
  Vec3f impulse_on_b;                                // N s; a received the opposite
  Vec3f angular_impulse_on_a, angular_impulse_on_b;  // about each one's centre of mass, N m s
};

// The same, and where. Of two that only stopped each other's way, the middle of a and no depth.
struct Contact : PairImpulse {
  Vec3d point;        // mean of the contact points, world space, m
  Vec3f normal;       // from a to b, unit; 0 where there is no point
  float depth_m = 0;  // deepest point; negative while apart
};

// A pair that began or ceased to touch (contact), or to overlap where one is a trigger. body_a < body_b. It touches
// from a distance of 0 until it is 5 mm apart. Falling asleep ends nothing; removing a body ends its pairs in the next
// step.
struct PairEvent {
  BodyId body_a, body_b;
  bool trigger = false;
  bool begin = false;
  friend bool operator==(const PairEvent&, const PairEvent&) = default;
};

struct RayHit {
  BodyId body;
  Vec3d point;
  Vec3f normal;
  double fraction = 0;  // of the ray, 0 to 1
};

class World {
 public:
  explicit World(const Settings& settings);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // --- What is in it.
  void Add(const BodyDef& def, const BodyState& state);
  void Remove(BodyId id);  // with the joints that hold it; wakes what it touched
  bool Has(BodyId id) const;
  std::size_t size() const;
  void AddJoint(const JointDef& def);  // both bodies are present
  void RemoveJoint(JointId id);
  bool HasJoint(JointId id) const;

  // --- State in and out. `StateOf` after `SetState` gives what was set, up to float rounding of the local position.
  BodyState StateOf(BodyId id) const;
  // Wakes the body and what it touches if the state moves it; a state that is `asleep` puts it to sleep. A sleeper
  // stays asleep if the state is the one it has, or creeps by less than it may sleep with. Contacts live on.
  void SetState(BodyId id, const BodyState& state);
  Aabb BoundsOf(BodyId id) const;    // of the shape as posed, world space
  double MassOf(BodyId id) const;    // kg; 0 when static
  Vec3d InertiaOf(BodyId id) const;  // principal, kg m^2, about the shape's axes unless it is lopsided; 0 when static

  // Takes a dynamic body out of everything but `StateOf`: it stands still, touches nothing, feels no force, and loses
  // its joints. Nothing for one that is parked.
  void Park(BodyId id);
  // It lives on where it stands. Nothing for one that is not parked.
  void Unpark(BodyId id);
  bool IsParked(BodyId id) const;

  // Wakes a body and, in the next step, all that it touches.
  void Wake(BodyId id);

  void SetElsewhere(BodyId id, const Elsewhere& elsewhere);
  // What the caller calls it by, such as an index: told of in contacts, so that nothing has to be looked up.
  void SetTag(BodyId id, std::uint32_t tag);

  // --- Forces: act in the next step, then are forgotten. Wake the body, unless they are 0.
  void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm);
  // Impulses act at once.
  void ApplyImpulse(BodyId id, Vec3f impulse_ns, Vec3f angular_impulse_nms);

  // --- Time.
  void Step(double dt_s);
  // Before the next step, of the same length: finds what contacts and joints have to bear, by solving it `times` times
  // from here without moving anything. For bodies whose contacts nobody remembers, such as those of a saved state: a
  // pile of them sags by most of a millimetre otherwise before its contacts have learned what lies on them. Six times
  // leave a sixteenth of that.
  void Rehearse(double dt_s, int times);
  // Of the last step; valid until the next call that changes the world. Sorted by (body_a, body_b), so that the order
  // does not depend on how the world was built.
  std::span<const Contact> contacts() const;
  // Those of them whose two bodies have both bits of 3 between them, by what `bits` has at their tags (0 if nothing);
  // valid until this is called again, and as above.
  std::span<const PairImpulse> ImpulsesOf(std::span<const std::uint8_t> bits) const;
  // Adds the tags of those whose bounds, with some margin and looking ahead, are about those of this one, in no order.
  void AddNear(BodyId id, std::vector<std::uint32_t>* near) const;
  void AddTouching(BodyId id, std::vector<std::uint32_t>* touching) const;  // and of those that touched it
  std::span<const PairEvent> events() const;
  // Bodies that came to be non-finite, or absurdly fast, in the last step: they take no part any more, and wait to be
  // removed. Ascending only by chance.
  std::span<const BodyId> isolated() const;

  // --- Queries.
  std::optional<RayHit> CastRay(Vec3d from, Vec3d to) const;                     // nearest; triggers are no obstacle
  std::vector<BodyId> Overlapping(const Shape& convex, const Pose& pose) const;  // ascending; exact, not by bounds
  std::vector<BodyId> Overlapping(const Aabb& box) const;                        // ascending; by bounds

  // --- Of the last step that a body was awake in.
  // Most that a body of its island had to bear, in weights of the lighter of two that touch, those of a unit cube; as a
  // mean over some ten steps, and without what is elsewhere. 0 to 1e6; 0: nothing held it.
  float IslandLoadOf(BodyId id) const;
  int SubstepsOf(BodyId id) const;  // a power of two; 0: nothing held it

  std::size_t asleep_count() const;  // dynamic bodies that sleep

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::physics
