// RigidBody: one body of a world.
//
// `state` is what callers see: pose and velocity of the shape's own axes. `placement` is the same pose as collision and
// solving see it: centre of mass and principal axes. World angular momentum is kept beside the angular velocity that it
// gives, so that free flight loses none of it.
//
// Public fields belong to the parts of a world; each group names the one part that writes it.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "core/physics/body_form.h"
#include "core/physics/bounds.h"
#include "core/physics/collide/collide.h"
#include "core/physics/contact_report.h"
#include "core/physics/motion/damping.h"
#include "core/physics/motion/predicted_motion.h"
#include "core/physics/support_hint.h"
#include "core/physics/tuning.h"
#include "core/world/prefetch.h"
#include "core/world/scene.h"

namespace tessera::physics {

struct Joint;
struct Pair;
class RigidBody;

// A pair as one of its two bodies sees it. It names the other body, so that nobody has to look at the pair for that.
struct PairEnd {
  Pair* pair;
  RigidBody* other;
};

// The loads pass's memory of a body from step to step.
struct LoadMemory {
  // Load ratio by the weight that the body carried in the last step. It is as large as can be for a new body, so that
  // any load counts in its first step.
  float propagated = std::numeric_limits<float>::max();
  int substeps = 0;                  // those of its island in its last step awake; 0 if nothing held it
  float island_load = kUnknownLoad;  // load that its island counted with in that step
};

class alignas(64) RigidBody {
 private:
  // Everything that each step reads comes first, close together.
  BodyId id_;
  bool dynamic_, kinematic_, trigger_, may_sleep_, round_;
  std::shared_ptr<const Geometry> geometry_;
  Placement placement_;
  BodyState state_;

 public:
  // --- The broad phase writes these.
  PredictedMotion predicted;
  Bounds reach;  // all that the body can touch in this step
  Bounds fat;    // bounds that the trees hold; contain `reach`
  // --- The body store.
  std::uint32_t awake_index = 0;  // in the list of awake bodies, while it is in there
  // --- Callers add forces; the integration pass clears them once they have acted.
  Vec3d force_n, torque_nm;
  // --- The world.
  bool isolated = false;  // It takes no part, because it went non-finite or is parked.
  bool parked = false;
  // --- Callers.
  ExclusionGroup exclusion_group = ExclusionGroup::kNone;
  SupportHint support;
  std::uint32_t tag = kNoTag;  // see World::SetTag
  // --- The loads pass.
  LoadMemory load;
  // --- The body store.
  std::uint64_t serial = 0;    // names the body in a pair
  std::vector<Joint*> joints;  // all that hold it, in no order
  // --- The pair table.
  std::vector<PairEnd> pairs;  // all whose bounds overlap its own, in no order

  // `gravity` is that of a gravity scale of 1.
  RigidBody(const BodyDef& def, BodyForm form, const BodyState& state, Vec3d gravity);

  BodyId id() const { return id_; }
  bool dynamic() const { return dynamic_; }
  bool kinematic() const { return kinematic_; }
  bool trigger() const { return trigger_; }
  bool may_sleep() const { return may_sleep_; }
  bool awake() const { return dynamic_ && !state_.asleep; }
  // A kinematic body that is under way. One that stands counts as asleep.
  bool moving() const { return kinematic_ && !state_.asleep; }
  bool stirs() const { return (dynamic_ || kinematic_) && !state_.asleep; }
  bool round() const { return round_; }  // its inertia is the same about every axis
  const BodyState& state() const { return state_; }
  const Placement& placement() const { return placement_; }
  const Geometry& geometry() const { return *geometry_; }
  const std::shared_ptr<const Geometry>& shared_geometry() const { return geometry_; }
  const Material& material() const { return material_; }
  const CollisionLayer& layer() const { return layer_; }
  double mass_kg() const { return mass_kg_; }
  Vec3d inertia() const { return inertia_; }
  // Acceleration by gravity and the forces of the next step, m/s^2.
  Vec3d Acceleration() const { return force_n == Vec3d() ? gravity_ : gravity_ + force_n / mass_kg_; }
  void PrepareDamping(double dt_s) {
    linear_damping_.Prepare(dt_s);
    angular_damping_.Prepare(dt_s);
  }
  const Damping& linear_damping() const { return linear_damping_; }
  const Damping& angular_damping() const { return angular_damping_; }
  // Takes a frame from the coordinates of the body's shape, in which joints are given, to those of its placement.
  Pose LocalFrame(const Pose& in_shape) const;

  void SetMaterial(const Material& material) { material_ = material; }
  void SetGravity(Vec3d gravity_m_s2) { gravity_ = gravity_m_s2; }

  // The change that a new state would be to the body. A sleeper that is to creep by less than it may sleep with takes
  // the new state in silence: two worlds that hold the same body let it fall asleep a tick or two apart, and must not
  // wake each other by that.
  enum class Change { kNone, kSilent, kMoves };
  Change Compare(const BodyState& state) const;
  // Takes over a state, and sleeps if the state is asleep. A silent change leaves a sleeper asleep.
  void Set(const BodyState& state);

  // Moves a kinematic body on for a step.
  void Advance(double dt_s);
  // Puts a body that is awake where a step has moved it.
  void Move(Vec3d position, Quatd orientation, Vec3f velocity, Vec3f angular_momentum);
  // Sets velocity and angular momentum; the angular velocity follows.
  void SetMotion(Vec3f velocity, Vec3f angular_momentum);
  // Sets for how long the body has been slow enough to sleep, s.
  void SetStill(float still_s) { state_.still_s = still_s; }
  void FallAsleep();
  void Wake();

 private:
  Placement PlacementOf(const BodyState& state) const;
  void NoteRest();

  double mass_kg_;
  Vec3d inertia_;
  Material material_;
  CollisionLayer layer_;
  Vec3d gravity_;
  Damping linear_damping_, angular_damping_;
  BodyFrame frame_;
  Vec3d rest_position_;  // where the body lay when it fell asleep
  Quatd rest_orientation_;

 public:
  // --- The broad phase.
  double driven_s = 0;     // length of the last step of a kinematic body under way
  std::uint32_t leaf = 0;  // the body's name in its tree, while it is in there
};

// Bytes from the start of a body, for loops that ask ahead for no more than they read: as far as its state, its forces,
// its mass, and all that steps read.
inline constexpr std::size_t kUpToState = 256, kUpToForces = 384, kUpToMass = 512, kUpToFrame = 704;

}  // namespace tessera::physics
