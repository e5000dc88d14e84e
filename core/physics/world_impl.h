// The inside of a World: the parts that hold its bodies, and the passes that make a step of them.
//
//   broad phase -> narrow phase (wakes) -> islands -> loads -> solve, or free flight -> continuous collision
//   -> integration -> sleep -> report
//
// Each pass takes what it reads, gives what it made, and keeps its own scratch. Bodies, joints and pairs live on from
// step to step, and their headers name the one part that writes each field.
#pragma once

#include <memory>
#include <vector>

#include "core/physics/awake_joints.h"
#include "core/physics/body_store.h"
#include "core/physics/broad_phase.h"
#include "core/physics/continuous/continuous_collision.h"
#include "core/physics/integrate.h"
#include "core/physics/islands.h"
#include "core/physics/loads.h"
#include "core/physics/narrow_phase.h"
#include "core/physics/pair_table.h"
#include "core/physics/pose_history.h"
#include "core/physics/queries.h"
#include "core/physics/report.h"
#include "core/physics/sleep.h"
#include "core/physics/solve_pass.h"
#include "core/physics/thread_team.h"
#include "core/physics/waking.h"
#include "core/physics/world.h"

namespace tessera::physics {

struct World::Impl {
  explicit Impl(const WorldSettings& settings);
  ~Impl();

  // --- Adding, removing and moving bodies and joints (world_bodies.cpp).
  void Add(const BodyDef& def, const BodyState& state);
  void Remove(BodyId id);
  void AddJoint(const JointDef& def);
  void RemoveJoint(Joint& joint);
  void SetState(RigidBody& body, const BodyState& state);
  void Teleport(RigidBody& body, const BodyState& state);
  void Park(RigidBody& body);
  void Unpark(RigidBody& body);
  // Takes a body out of everything but the store, for good.
  void Isolate(RigidBody& body);
  // Ends all that a body has to do with others, and takes it out of the broad phase. What it touched wakes.
  void Withdraw(RigidBody& body);
  void WakeNeighbours(const RigidBody& body);

  // --- A step (step.cpp).
  void Step(double dt_s);
  void PrimeContacts(double dt_s, int times);
  void IsolateInsane();
  // Bodies that a kinematic one under way touches, or holds by a joint, do not sleep.
  void FindRestless();
  void AdvanceKinematic(double dt_s);
  // From bounds to plans: what acts on what, and how it is to be solved.
  void FindIslands(double dt_s);
  bool anything_to_solve() const { return !narrow_phase.contacts().empty() || !joints.empty(); }
  SolveInput SolveInputOf(double dt_s);
  StepOutcome Outcome() const;

  const WorldSettings settings;
  ThreadTeam team{settings.threads};

  // --- What lives on from step to step.
  FormCache forms;
  BodyStore bodies;
  PairTable pairs;
  BroadPhase broad_phase;
  Queries queries{broad_phase, bodies, settings.origin};
  std::unique_ptr<PoseHistory> history;  // null: nobody looks back
  Waking waking{bodies, pairs};
  std::vector<BodyId> isolated;  // in the last step; Isolate writes it

  // --- The passes.
  NarrowPhase narrow_phase{team};
  AwakeJoints joints;
  Islands islands;
  JointedGroups groups;
  Loads loads;
  SolvePass solve;
  ContinuousCollision continuous{team};
  Integrator integrator{team};
  SleepPass sleep;
  Report report{team};
  std::vector<std::uint32_t> restless;  // FindRestless writes it: awake_index of each
  // By awake_index: free flight and the solve pass fill it, continuous collision corrects it, integration applies it.
  std::vector<BodyMotion> motions;
};

}  // namespace tessera::physics
