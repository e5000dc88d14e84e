// SolveBatches: the bodies, contacts and joints of all islands that are solved, as the solver wants them.
//
// Islands with the same number of substeps make one batch. Bodies keep the order of the awake list, and constraints
// that of the ids of their bodies.
//
// Thread rule: one thread at a time, which leads the team.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/physics/active_contact.h"
#include "core/physics/islands.h"
#include "core/physics/loads.h"
#include "core/physics/rigid_body.h"
#include "core/physics/solve/solver.h"
#include "core/physics/thread_team.h"

namespace tessera::physics {

struct SolveInput {
  double dt_s;
  std::span<RigidBody* const> awake;
  std::span<ActiveContact> contacts;  // in: substeps of each pair's last solve; out: of this one
  std::span<Joint* const> joints;     // likewise
  std::span<JointRows> rows;          // by joint
  const Islands& islands;
  std::span<const IslandPlan> plans;           // by island
  std::span<const std::uint8_t> bearing = {};  // by contact, 1 where it bears; empty: none does
};

struct IslandBatch {
  int substeps = 0;
  bool unanchored = false;  // one of its islands is
  bool bears = false;       // one of its contacts does
  std::vector<SolverBody> bodies;
  // By body: its orientation half way through the step, where it turns its inertia; else at the start.
  std::vector<Quatd> midways;
  // By body. After these come kinematic bodies, one for each contact or joint with one, so that none of them connects
  // what touches it.
  std::vector<const RigidBody*> sources;
  std::vector<ContactConstraint> contacts;
  std::vector<JointConstraint> joints;
};

class SolveBatches {
 public:
  void Fill(const SolveInput& in, ThreadTeam& team = ThreadTeam::Alone());

  std::span<IslandBatch> batches() { return batches_; }  // some are empty
  std::span<const IslandBatch> batches() const { return batches_; }

  // Each body of a solved island is in the batch of its island's substeps, once, and constraints name bodies that are
  // there. For assertions; linear.
  bool Validate(const SolveInput& in) const;

 private:
  void FillBodies(const SolveInput& in, ThreadTeam& team);
  void FillContacts(const SolveInput& in);
  void FillJoints(const SolveInput& in);
  IslandBatch& BatchOf(const IslandPlan& plan) { return batches_[static_cast<std::size_t>(plan.level)]; }

  std::array<IslandBatch, kSubstepLevels> batches_;
  std::vector<std::uint32_t> place_;  // by awake_index: place in the batch that solves the body
};

// Angular velocity and momentum with which a body starts the step, rad/s and kg m^2/s, once they are damped.
struct StartingTurn {
  explicit StartingTurn(const RigidBody& body);
  Vec3f spin, momentum;
};

// Whether a body turns so much in a step at `spin`, rad/s, that its inertia turning with it is felt.
bool TurnsItsInertia(const RigidBody& body, Vec3f spin, float dt_s);

}  // namespace tessera::physics
