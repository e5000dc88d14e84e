// World: rigid bodies that are simulated together, one tick at a time.
//
// Positions and orientations are doubles in world space, and contacts are found from relative poses, so errors far from
// home are those at home. The result does not depend on the order of calls that add and remove, nor on what else is in
// the world: the same bodies do the same, to the bit, on every host. The trees of the broad phase and of meshes are
// Bullet's; all else is our own (docs/architecture.md).
//
//   World world({.origin = {500, 0, 500}, .gravity_m_s2 = scene.gravity_m_s2});
//   world.Add(def, def.initial);
//   world.Step(1.0 / 60);
//   BodyState state = world.StateOf(def.id);
//
// A kinematic body moves by its own velocities, which nothing but SetState changes, and carries and pushes what it
// meets.
//
// It has some 50 methods because a world that stands is asked about its bodies, joints and rays; a step is one call,
// and its passes are classes of their own.
//
// Callers' mistakes (an unknown id, a second Add of one id) are assertions: input is checked before it gets here.
// Thread rule: one thread at a time. A world may have threads of its own, which work in a step and sleep otherwise;
// their number changes no bit.
#pragma once

#include <absl/functional/function_ref.h>

#include <memory>
#include <span>
#include <vector>

#include "core/physics/contact_report.h"
#include "core/physics/noted_bodies.h"
#include "core/physics/support_hint.h"
#include "core/world/query.h"
#include "core/world/scene.h"

namespace tessera::physics {

struct WorldSettings {
  Vec3d origin{};  // Bounds are in single precision about this point, m.
  Vec3d gravity_m_s2{0, -9.81, 0};
  int substeps = 0;       // Every island that is solved gets so many; 0: as many as it needs.
  bool sleep = true;      // Bodies that are still fall asleep.
  bool portable = false;  // Solve with what every processor has, rather than with the widest it has; the same bits.
  int threads = 1;        // that work on a step, the caller's among them: 1 to kMaxStepThreads; the same bits
};

struct SphereHit {
  BodyId body;
  Vec3d center;         // the sphere's centre where it stops short of the body by kSweptGap_m or less
  Vec3d normal;         // from the body to the sphere, unit
  double fraction = 0;  // share of the way before the hit, 0 to 1
};
inline constexpr double kSweptGap_m = 0.001;

class World {
 public:
  explicit World(const WorldSettings& settings);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // --- Bodies and joints.
  void Add(const BodyDef& def, const BodyState& state);
  void Remove(BodyId id);  // with the joints that hold it; wakes what it touched
  bool Has(BodyId id) const;
  std::size_t size() const;
  void AddJoint(const JointDef& def);  // Both bodies are present.
  void RemoveJoint(JointId id);
  bool HasJoint(JointId id) const;

  // --- State in and out. `StateOf` after `SetState` gives what was set, up to float rounding of the local position.
  BodyState StateOf(BodyId id) const;
  // Wakes the body and what it touches if the state moves it; a state that is `asleep` puts it to sleep. A sleeper
  // stays asleep if the state is the one it has, or creeps by less than it may sleep with. Contacts live on.
  void SetState(BodyId id, const BodyState& state);
  // Puts a body elsewhere: its contacts end, what it touched wakes, and so does the body itself unless the state
  // sleeps. Its joints hold it there, too.
  void Teleport(BodyId id, const BodyState& state);
  Aabb BoundsOf(BodyId id) const;    // bounds of the shape as posed, world space
  double MassOf(BodyId id) const;    // kg; 0 when static or kinematic
  Vec3d InertiaOf(BodyId id) const;  // principal, kg m^2, about the shape's axes unless it is lopsided; 0 when static

  // Another material, and another gravity than the definition's; they count from the next step on.
  void SetMaterial(BodyId id, const Material& material);
  void SetGravityScale(BodyId id, double scale);
  // The angular impulse, N m s, that gives the body as it is this angular velocity, rad/s.
  Vec3f AngularImpulseFor(BodyId id, Vec3d spin_rad_s) const;

  // Takes a dynamic body out of everything but `StateOf`: it stands still, touches nothing, feels no force, and loses
  // its joints. A body that is parked already stays so.
  void Park(BodyId id);
  // Lets a parked body live on where it stands. Nothing happens to one that is not parked.
  void Unpark(BodyId id);
  bool IsParked(BodyId id) const;

  // Wakes a body and, in the next step, all that it touches.
  void Wake(BodyId id);

  // Calls `visit` for the bodies to which the last step may have given another state, with their tags, in no order:
  // those that are awake, those that fell asleep in it, and kinematic ones under way. Only until the next call that
  // changes the world. One of `isolated` need not be among them.
  void ForEachStepped(absl::FunctionRef<void(std::uint32_t tag, const BodyState& state)> visit) const;

  // --- What the caller knows of a body that cannot be seen here. A new body has no hint, no group and no tag.
  void SetSupportHint(BodyId id, const SupportHint& hint);
  void SetExclusionGroup(BodyId id, ExclusionGroup group);
  // The caller's own name of the body, such as an index. Contacts carry it, so that nobody has to look it up.
  void SetTag(BodyId id, std::uint32_t tag);

  // --- Forces act in the next step, then are forgotten. They wake the body, unless they are 0.
  void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm);
  // Impulses act at once.
  void ApplyImpulse(BodyId id, Vec3f impulse_ns, Vec3f angular_impulse_nms);

  // --- Time.
  void Step(double dt_s);
  // Finds, before the next step of the same length, what contacts and joints have to bear: solves that step `times`
  // times from here without moving anything. It is for bodies whose contacts nobody remembers, such as those of a saved
  // state: a pile of them would sag by most of a millimetre before its contacts have learned what lies on them. Six
  // times leave a sixteenth of that.
  void PrimeContacts(double dt_s, int times);
  // Contacts of the last step; valid until the next call that changes the world. Sorted by (body_a, body_b), so that
  // the order does not depend on how the world was built.
  std::span<const Contact> contacts() const;
  // The contact of two bodies in the last step; nothing unless they touch.
  std::optional<Contact> ContactBetween(BodyId a, BodyId b) const;
  // Impulses of those contacts whose two bodies have both bits of 3 between them, by what `bits` has at their tags (0
  // if nothing); valid as long, and until this is called again.
  std::span<const PairImpulse> ImpulsesOf(std::span<const std::uint8_t> bits) const;
  // Adds the tags of the bodies whose bounds, with some margin and looking ahead, overlap those of this one; in no
  // order.
  void AddNear(BodyId id, std::vector<std::uint32_t>* near) const;
  // Adds the tags of the bodies that touched this one; in no order.
  void AddTouching(BodyId id, std::vector<std::uint32_t>* touching) const;
  // Whether two bodies touched, or a trigger and a body overlapped; false where one of them is not here.
  bool AreTouching(BodyId a, BodyId b) const;
  std::span<const PairEvent> events() const;  // those of the last step, ascending by ids
  // Bodies that came to be non-finite, or absurdly fast, in the last step: they take no part any more, and wait to be
  // removed. In no order.
  std::span<const BodyId> isolated() const;

  // --- The past.
  // Remembers where these bodies are after the step to `tick`, of `tick_s`, for queries that look back so many ticks.
  // Call it after each step; a tick that does not follow the last one begins anew.
  void NotePoses(Tick tick, double tick_s, const NotedBodies& noted, std::size_t ticks);
  void ForgetPoses();

  // --- Queries.
  // They change nothing, and see bodies where the last step or call left them, or where they were noted.
  QueryResult FindBodies(const BodyQuery& query, const BodyPredicate& accept = nullptr) const;
  std::vector<BodyId> Overlapping(const Aabb& box) const;  // ascending; by bounds, triggers among them
  // The first body that a sphere meets on a straight way, which it may touch or overlap at the start: only what it
  // comes nearer to counts. Triggers, `ignored` and layers that ignore its are no obstacle. In
  // doubles from relative positions: the same bits
  // in every world that holds the bodies on the way.
  std::optional<SphereHit> SweepSphere(Vec3d from, Vec3d to, double radius_m, BodyId ignored) const;

  // --- The last step that a body was awake in.
  // The largest load that a body of its island had to bear, in weights of the lighter of two that touch, scaled to
  // those of a unit cube; a mean over some ten steps, without SupportHint::island_load. 0 to 1e6; 0: nothing held it.
  float IslandLoadOf(BodyId id) const;
  int SubstepsOf(BodyId id) const;  // a power of two; 0: nothing held it

  std::size_t asleep_count() const;  // dynamic bodies that sleep

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::physics
