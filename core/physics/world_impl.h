// The inside of a World: its bodies, and a step as a chain of passes over them.
//
//   refresh bounds -> find pairs -> collide (and wake) -> islands -> solve or fly -> sweep -> move -> sleep -> report
#pragma once

#include <absl/container/flat_hash_map.h>

#include <array>
#include <bit>
#include <map>
#include <memory>
#include <vector>

#include "core/physics/broad_phase.h"
#include "core/physics/islands.h"
#include "core/physics/motion/sweep.h"
#include "core/physics/pair_table.h"
#include "core/physics/rigid_body.h"
#include "core/physics/solve/joint_model.h"
#include "core/physics/solve/solver.h"
#include "core/physics/solve/substeps.h"
#include "core/physics/world.h"

namespace tessera::physics {

inline constexpr int kSubstepLevels = std::bit_width(static_cast<unsigned>(kMaxSubsteps));  // 1, 2, 4 ...

struct Joint {
  JointId id;
  RigidBody *a = nullptr, *b = nullptr;  // b is null for one to the world, whose part the model takes as its body a
  bool bodies_collide = false;
  JointModel model;
  std::uint64_t step = 0;  // in which it was last listed
  int substeps = 0;        // of its last solving; its impulses are those of one of them
};

inline constexpr std::uint32_t kAsleep = kStatic;  // in place of an awake_index

// A pair with manifolds as the passes after its search see it, side by side: pairs lie all over the memory.
struct Touch {
  Pair* pair;
  std::uint32_t low, high;          // awake_index, or kAsleep
  std::uint32_t low_tag, high_tag;  // of the bodies
  Manifold* manifolds;
  std::uint32_t count;              // of them
  int substeps;                     // as in Pair
  bool responds, live;              // as in Pair
  float penetration_m, impact_m_s;  // the most of its points, if it is live
  float load_ns, inner_m, slop_m;   // as in Pair
  Vec3f normal;                     // of the first manifold
  PairMaterial material;

  bool both() const { return low != kAsleep && high != kAsleep; }
  std::uint32_t one() const { return low != kAsleep ? low : high; }
};

// What a body that is awake weighs, where loads are reckoned.
struct Burden {
  double mass_kg;
  double tied_kg;     // it and what joints tie to it
  double carried_kg;  // it and what is taken to lie on it
  double height_m;    // against gravity
};

struct Support {
  std::uint32_t upper, lower;  // awake_index; `lower` may be kAsleep
  double scale;                // of loads, see step_weigh.cpp
  double borne_kg;             // what is known to rest on the lower one by this; negative: to be reckoned
};

struct World::Impl {
  explicit Impl(const Settings& settings);
  ~Impl();

  RigidBody& At(BodyId id) const;

  // --- Bodies (world_bodies.cpp).
  void Add(const BodyDef& def, const BodyState& state);
  void Remove(BodyId id);
  void AddJoint(const JointDef& def);
  void RemoveJoint(JointId id);
  void SetState(RigidBody& body, const BodyState& state);
  // Wakes a body and what is jointed to it.
  void Wake(RigidBody& body);
  void WakeTouching(RigidBody& body);
  void ListJointed(const RigidBody& body, std::vector<RigidBody*>* others);
  void Withdraw(RigidBody& body);
  void ForbidContacts(RigidBody& a, RigidBody& b);
  bool Jointed(const RigidBody& a, const RigidBody& b) const;
  void ListAwake(RigidBody& body);
  void UnlistAwake(RigidBody& body);
  Bounds TightBounds(const RigidBody& body) const;
  void SetReach(RigidBody& body, const Bounds& reach);
  // What queries see.
  btCollisionWorld& Shown();

  struct Batch {
    int substeps = 0;
    bool adrift = false;  // some of its islands are
    std::vector<SolverBody> bodies;
    std::vector<RigidBody*> of;
    std::vector<ContactConstraint> contacts;
    std::vector<JointConstraint> joints;
  };
  // What a sweep found: that a body comes upon another.
  struct Stop {
    std::uint32_t index;  // awake_index
    double share;         // of its way, after which they meet
    RigidBody* by;        // the other
    Vec3d end_m;          // where its way would have ended, and with which velocity; once it is moved back
    Vec3f velocity_m_s;
  };

  // --- The passes of a step (step_*.cpp).
  void Step(double dt_s);
  void Rehearse(double dt_s, int times);
  static bool Sane(const RigidBody& body);
  void FindPairs();
  void BeginPairs();
  void CollidePairs();
  void CollidePair(Pair& pair);
  void CollideFast(Pair& pair);
  void WakeTouched();
  void BuildIslands();
  void WeighIslands();
  void WeighAssemblies();
  bool PropsMeet(const Touch& touch) const;
  void NoteSupport(const Touch& touch, Vec3d up, double pull);
  void GroupSupports();
  void PassLoadsDown();
  void EvenLoads();
  void ListJoints();
  void MakeJointRows();
  void FillBatches();
  void FillContacts();
  void FillJoints();
  void FlyFree();
  void SolveBatches();
  void ReadBatches();
  void SumGains(const Batch& batch);
  void Sweep();
  void SweepBody(std::uint32_t index);
  bool GoesThrough(const Pair& pair) const;
  void NoteWay(RigidBody& body);
  struct StoppedJoint;
  struct Anchors;
  static bool Carries(const RigidBody& body, const RigidBody& other);
  void MoveStopped();
  void SortStopped();
  void CarryStopped();
  double FreeShare(const RigidBody& body, const Way& way);
  void KeepTurning(const Stop& stop);
  Anchors StopJointed();
  std::vector<StoppedJoint> ListStopped(const Anchors& anchors);
  void Rejoin(std::span<const StoppedJoint> held, std::vector<bool>& placed);
  void MoveBodies();
  void NoteStillness(RigidBody& body);
  void FallAsleep();
  void ReportContacts();
  std::span<const PairImpulse> ReportImpulsesOf(std::span<const std::uint8_t> bits);
  template <class Told>
  void AddTurning(const PairImpulse& turning, std::vector<Told>* told) const;
  void ReportEvents();
  void Isolate(RigidBody& body);
  void Park(RigidBody& body);
  void Unpark(RigidBody& body);
  void FindFailing();
  void ChooseSubsteps();

  // Where a body will be at the end of the step.
  struct Motion {
    Vec3d position;
    Quatd orientation;
    Vec3f velocity, angular_momentum;
    Vec3f turned_rad;
  };
  Way WayOf(const RigidBody& body) const;
  Bounds Passed(const Way& way) const;
  Way PredictedWay(const RigidBody& body) const;

  // By contacts, over the step.
  struct Gain {
    Vec3d momentum, angular_momentum;
  };

  Settings settings;
  ShapeCache shapes;
  BroadPhase broad_phase;
  PairTable pairs;
  Solver solver;
  Islands islands, assemblies;
  absl::flat_hash_map<BodyId, std::unique_ptr<RigidBody>> bodies;
  std::map<JointId, Joint> joints;
  std::uint64_t next_serial = 1;
  std::vector<std::uint64_t> free_serials;

  // Of the step.
  double dt_s = 0;
  std::uint64_t step = 0;
  std::vector<RigidBody*> awake;           // dynamic and awake, in no order
  std::vector<Touch> touching;             // with manifolds, ascending by ids
  std::vector<Pair*> parting;              // without, of which there may yet be an event to tell
  std::vector<RigidBody*> touched;         // sleepers that something awake came upon
  std::vector<Joint*> awake_joints;        // ascending by id
  std::vector<JointRows> joint_rows;       // of them
  std::vector<std::uint32_t> tied_bodies;  // awake_index of those that joints tie to others, ascending
  std::vector<Burden> burdens;             // by awake_index
  std::vector<float> passed_before;        // likewise: what passed_down was in the last step
  std::vector<Support> supports;           // in islands that may be laden
  std::vector<Support> grouped;            // the same by upper body, as `first_supports` says
  std::vector<std::uint32_t> first_supports;
  std::vector<std::pair<double, std::uint32_t>> uppers;  // height and awake_index of what stands on something
  std::vector<IslandWork> works;                         // of the islands that are solved
  std::array<Batch, kSubstepLevels> batches;
  std::vector<std::uint32_t> solver_indices;  // by awake_index: in the batch that solves it
  std::vector<Gain> gains;                    // of a batch, as it lists them, where they are adrift
  std::vector<Motion> motions;                // by awake_index
  std::vector<std::uint32_t> racing;          // awake_index of what is to be swept
  std::vector<Stop> stopped;                  // by sweeping
  std::vector<RigidBody*> candidates, waking;
  std::vector<RigidBody*> failing;  // will be isolated at the end of the step

  std::vector<PairImpulse> turnings;  // what pairs got for having been stopped by each other
  std::vector<Contact> contacts;
  std::vector<PairImpulse> asked_impulses;
  bool contacts_told = true;             // `contacts` are those of the last step; reckoned only when asked for
  std::vector<PairEvent> events, ended;  // `ended`: since the last step, by removal
  std::vector<BodyId> isolated;
};

}  // namespace tessera::physics
