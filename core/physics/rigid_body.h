// RigidBody: what the world knows of one body, and the passage of its state in and out.
//
// `state` is what goes out: pose and velocity of the shape's own axes. `placement` is the same pose as collision and
// solving see it: centre of mass and principal axes. World angular momentum is kept beside the angular velocity it
// gives, so that free flight loses none of it.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "core/physics/collide/collide.h"
#include "core/physics/collide/geometry.h"
#include "core/physics/motion/damping.h"
#include "core/physics/tuning.h"
#include "core/physics/world.h"
#include "core/world/scene.h"

namespace tessera::physics {

struct Pair;

// Axis-aligned, in single precision about the world's origin: wide enough for a broad phase, never used for contacts.
struct Bounds {
  Vec3f min, max;

  bool Contains(const Bounds& b) const {
    return min.x <= b.min.x && min.y <= b.min.y && min.z <= b.min.z && b.max.x <= max.x && b.max.y <= max.y &&
           b.max.z <= max.z;
  }
  bool Overlaps(const Bounds& b) const {
    return min.x <= b.max.x && b.min.x <= max.x && min.y <= b.max.y && b.min.y <= max.y && min.z <= b.max.z &&
           b.min.z <= max.z;
  }
  Bounds Grown(float by_m) const {
    const Vec3f margin{by_m, by_m, by_m};
    return {min - margin, max + margin};
  }
  // All that is passed on a way.
  Bounds Swept(Vec3f way) const {
    const auto low = [](float v) { return std::min(v, 0.0f); };
    const auto high = [](float v) { return std::max(v, 0.0f); };
    return {min + Vec3f{low(way.x), low(way.y), low(way.z)}, max + Vec3f{high(way.x), high(way.y), high(way.z)}};
  }
};

// What a body will do in this step if nothing hinders it; zero while it sleeps.
struct Course {
  Vec3f move_m;        // of its centre
  Vec3f velocity_m_s;  // at the end
  Vec3f spin_rad_s;
  float sweep_m = 0;  // of its fastest point against its centre
};

class RigidBody;

// A pair as one of its two sees it: who the other is, without a look at the pair.
struct PairEnd {
  Pair* pair;
  RigidBody* other;
};

class alignas(64) RigidBody {
 private:
  // What every step reads comes first, close together.
  BodyId id_;
  bool dynamic_, trigger_, may_sleep_, round_;
  std::shared_ptr<const Geometry> geometry_;
  Placement placement_;
  BodyState state_;

 public:
  // --- Of the world that holds it.
  Course course;
  Bounds reach;                   // all it can touch in this step
  Bounds fat;                     // what the broad phase believes; holds `reach`
  std::uint32_t awake_index = 0;  // among those awake
  Vec3d force_n, torque_nm;       // act in the next step
  bool astray = false;            // something pushed it off its course in this step
  bool shown = false;             // Bullet's copy is up to date
  bool isolated = false;          // takes no part: it went non-finite, or is parked
  bool parked = false;
  Elsewhere elsewhere;
  std::uint32_t tag = 0;                                  // see World::SetTag
  float passed_down = std::numeric_limits<float>::max();  // load ratio by what it carried in the last step; new: any
  // Of its island in the last step that it was awake in: substeps, 0 if nothing held it; what its load counted as.
  int substeps = 0;
  float island_load = kUnknownLoad;
  std::uint64_t serial = 0;     // of its adding: names it in a pair
  std::vector<JointId> joints;  // that hold it, in no order
  std::vector<PairEnd> pairs;   // whose bounds overlap its own, in no order

  // `gravity`: as for a gravity scale of 1. `origin`: of the broad phase's coordinates.
  RigidBody(const BodyDef& def, BodyForm form, const BodyState& state, Vec3d origin, Vec3d gravity);

  BodyId id() const { return id_; }
  bool dynamic() const { return dynamic_; }
  bool trigger() const { return trigger_; }
  bool may_sleep() const { return may_sleep_; }
  bool awake() const { return dynamic_ && !state_.asleep; }
  bool round() const { return round_; }  // its inertia is the same about every axis
  const BodyState& state() const { return state_; }
  const Placement& placement() const { return placement_; }
  const Geometry& geometry() const { return *geometry_; }
  const Material& material() const { return material_; }
  double mass_kg() const { return mass_kg_; }
  Vec3d inertia() const { return inertia_; }
  // By gravity and the forces of the next step, m/s^2.
  Vec3d Acceleration() const { return force_n == Vec3d() ? gravity_ : gravity_ + force_n / mass_kg_; }
  void PrepareDamping(double dt_s) {
    linear_damping_.Prepare(dt_s);
    angular_damping_.Prepare(dt_s);
  }
  const Damping& linear_damping() const { return linear_damping_; }
  const Damping& angular_damping() const { return angular_damping_; }
  // From the coordinates of the body's shape, which joint frames are in, to those of its placement.
  Pose LocalFrame(const Pose& in_shape) const;

  // What a new state would be to the body. A sleeper that is told to creep by less than what it may sleep with takes
  // the new state in silence: the two sides of a border fall asleep a tick or two apart, and must not wake each other
  // by that.
  enum class Change { kNone, kSilent, kMoves };
  Change Compare(const BodyState& state) const;
  // Takes over a state; sleeps if it says so. A silent change leaves a sleeper asleep.
  void Set(const BodyState& state, Vec3d origin);

  // After a step, of a body that is awake: where it is now, and how it moves.
  void Move(Vec3d position, Quatd orientation, Vec3f velocity, Vec3f angular_momentum);
  // Velocity and angular momentum alone; the angular velocity follows.
  void SetMotion(Vec3f velocity, Vec3f angular_momentum);
  // For how long it has been slow enough to sleep, s.
  void SetStill(float still_s) { state_.still_s = still_s; }
  void FallAsleep();
  void Wake();

  // Brings Bullet's copy, which queries look at, up to the state.
  void ShowToBullet(Vec3d origin);

  static RigidBody& Of(const btCollisionObject& object) { return *static_cast<RigidBody*>(object.getUserPointer()); }

 private:
  Placement PlacementOf(const BodyState& state) const;
  void NoteRest();

  double mass_kg_;
  Vec3d inertia_;
  Material material_;
  Vec3d gravity_;
  Damping linear_damping_, angular_damping_;
  BodyFrame frame_;
  Vec3d rest_position_;  // where and how it lay when it fell asleep
  Quatd rest_orientation_;

 public:
  btCollisionObject object;  // for Bullet's broad phase and queries
};

}  // namespace tessera::physics
