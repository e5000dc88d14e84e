// Loads: how hard each island is to solve, and how many substeps it gets.
//
// An island needs the more substeps the more its bodies carry, the more unlike their masses are, and the further joints
// have opened or contacts overlap (solve/substeps.h). Loads are those that the last step showed, and those that follow
// from the weights of what stands on what: with too few substeps the weight of a new tower never reaches its foot, so
// the foot would never ask for more.
//
// Its memory from step to step lies in the bodies (RigidBody::load), and nothing else writes that.
// Thread rule: one thread at a time, which leads the team.
#pragma once

#include <bit>
#include <limits>
#include <span>
#include <vector>

#include "core/physics/active_contact.h"
#include "core/physics/islands.h"
#include "core/physics/load_propagation.h"
#include "core/physics/rigid_body.h"
#include "core/physics/solve/substeps.h"
#include "core/physics/thread_team.h"

namespace tessera::physics {

inline constexpr int kSubstepLevels = std::bit_width(static_cast<unsigned>(kMaxSubsteps));  // 1, 2, 4 ...

// How an island is solved in this step.
struct IslandPlan {
  bool solved = false;     // One of its contacts may push, or it has a joint; otherwise its bodies fly free.
  bool unanchored = true;  // Its bodies act on each other alone, and by contacts alone.
  int level = 0;           // Islands of one level have the same number of substeps.
  int substeps = 0;
  float load = kUnknownLoad;  // load ratio that it counts with, without what is outside the world
  bool direct = false;        // contacts that bear the load are solved together
};

struct LoadInput {
  double dt_s;
  std::span<RigidBody* const> awake;
  std::span<const ActiveContact> contacts;
  std::span<Joint* const> joints;
  std::span<const JointRows> rows;  // by joint
  const Islands& islands;
  const JointedGroups& groups;
};

class Loads {
 public:
  // `fixed_substeps`: every island gets so many; 0: as many as it needs.
  Loads(Vec3d gravity_m_s2, int fixed_substeps, ThreadTeam& team = ThreadTeam::Alone())
      : gravity_m_s2_(gravity_m_s2), fixed_substeps_(fixed_substeps), team_(team) {}

  void Run(const LoadInput& in);

  std::span<const IslandPlan> plans() const { return plans_; }  // by island
  // By contact, 1 where it bears so much that it is solved together with others; empty if none does.
  std::span<const std::uint8_t> bearing() const { return bearing_; }

  // For assertions; linear in islands.
  bool Validate() const;

 private:
  // Sums over an island.
  struct Sums {
    IslandDemand demand;
    bool loaded = false;  // may carry more than its bodies weigh one by one
    double mass_kg = 0;
    double lightest_kg = std::numeric_limits<double>::max();
    float smallest_m = std::numeric_limits<float>::max();  // inner radius
    float load_before = kUnknownLoad;  // largest that its bodies' islands counted with in the last step
    float load_outside = 0;            // largest SupportHint::island_load
  };

  // A body's load beside its weight, for the sums of its island.
  struct BodyShare {
    int substeps;
    float load_before, load_outside;
    float inner_radius_m;
  };

  // Gravity, and how far it pulls a body in a step, in both precisions that loads are computed in.
  struct Pull {
    Vec3d up;
    double g_m_s2 = 0;
    float single_g_m_s2 = 0;
    double share = 0, single_share = 0;  // pull in a step over that of the reference; see loads.cpp
  };

  static Pull PullOf(Vec3d gravity_m_s2, double dt_s);
  void WeighBodies(const LoadInput& in);
  void WeighGroups(const LoadInput& in);
  void WeighContacts(const LoadInput& in);
  void WeighContact(const LoadInput& in, const ActiveContact& contact, Sums& sums);
  void WeighJoints(const LoadInput& in);
  void NoteSupport(const LoadInput& in, const ActiveContact& contact);
  void PropagateLoads(const LoadInput& in);
  void SmoothLoads();
  void FindDirect(const LoadInput& in);
  void MarkBearing(const LoadInput& in);
  float LoadOf(const LoadInput& in, const ActiveContact& contact) const;
  void ChooseSubsteps();
  void Remember(const LoadInput& in) const;

  Vec3d gravity_m_s2_;
  int fixed_substeps_;
  ThreadTeam& team_;
  Pull pull_;
  std::vector<IslandPlan> plans_;
  std::vector<Sums> sums_;           // by island
  std::vector<BodyWeight> weights_;  // by awake_index
  std::vector<BodyShare> shares_;    // likewise
  std::vector<double> group_kg_;     // by jointed group
  std::vector<Support> supports_;    // in loaded islands
  std::vector<float> propagated_;    // by awake_index
  bool heavy_ = false;               // some island is
  std::vector<std::uint8_t> bearing_;
  std::vector<int> bearing_of_;    // by island: manifolds that are solved together, where some are
  std::vector<IslandWork> works_;  // by solved island
  LoadPropagation propagation_;
};

}  // namespace tessera::physics
