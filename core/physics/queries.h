// Queries: which bodies of a world a ray or a shape meets, nearest first.
//
//   Queries queries(broad_phase, bodies, origin);
//   const QueryResult seen = queries.Find({.from = eye, .to = eye + look * 100.0});
//
// Bodies are found by their bounds in the broad phase, and met in closed form or by GJK in doubles
// (core/physics/query). A query changes nothing. Thread rule: one thread at a time.
#pragma once

#include <vector>

#include "core/physics/body_store.h"
#include "core/physics/broad_phase.h"
#include "core/physics/pose_history.h"
#include "core/physics/query/meet.h"
#include "core/physics/query/way.h"
#include "core/world/query.h"

namespace tessera::physics {

class Queries {
 public:
  // The two outlive it. `origin`: the world position of the broad phase's origin.
  Queries(const BroadPhase& broad_phase, const BodyStore& bodies, Vec3d origin)
      : broad_phase_(broad_phase), bodies_(bodies), origin_(origin) {}
  // Where bodies were; it outlives this. Without one, all queries see bodies where they are.
  void SetHistory(const PoseHistory* history) { history_ = history; }
  Queries(const Queries&) = delete;
  Queries& operator=(const Queries&) = delete;

  // The contracts are those of World's methods of the same names.
  QueryResult Find(const BodyQuery& query, const BodyPredicate& accept);
  std::vector<BodyId> Overlapping(const Aabb& box);

  // Takes note that a step moves bodies, or that one left the broad phase.
  void Moved() { strays_known_ = false; }

 private:
  struct Candidate {
    double entry;  // share of the way at which it enters the body's bounds: no hit is earlier
    BodyId id;
    const RigidBody* body;  // null: one of the past
    std::size_t past = 0;   // index
  };

  // Bodies whose own bounds a box of half extents `half_m` crosses on its way, about the origin; in no order. Ends
  // early where the meter is exhausted.
  std::vector<Candidate> CandidatesOf(const BodyQuery& query, const Way& way, Vec3d half_m, WorkMeter& meter);
  // Adds those of the past.
  void AddPast(const BodyQuery& query, const Way& way, Vec3d half_m, WorkMeter& meter,
               std::vector<Candidate>& candidates, std::vector<PastBody>& past) const;
  bool LooksBack(const BodyQuery& query) const { return query.at_tick.has_value() && history_ != nullptr; }
  void FindStrays();

  const BroadPhase& broad_phase_;
  const BodyStore& bodies_;
  Vec3d origin_;
  const PoseHistory* history_ = nullptr;
  // Awake bodies that the last step put outside of the bounds that the trees hold. The trees hear of it in the next
  // step, not by a query.
  std::vector<RigidBody*> strays_;
  bool strays_known_ = false;
};

}  // namespace tessera::physics
