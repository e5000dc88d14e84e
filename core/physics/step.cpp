// One step of a world.
#include <algorithm>
#include <atomic>
#include <cassert>

#include "core/physics/world_impl.h"
#include "core/world/state_check.h"

namespace tessera::physics {
namespace {

bool IsSane(const RigidBody& body) {
  if (!tessera::IsSane(body.state())) return false;
  if (body.force_n == Vec3d() && body.torque_nm == Vec3d()) return true;
  return CheckForce(body.id(), Vec3f(body.force_n), Vec3f(body.torque_nm)).ok();
}

bool AreSane(std::span<RigidBody* const> bodies, ThreadTeam& team) {
  std::atomic<bool> sane = true;
  team.For(bodies.size(), kChunkBodies, [bodies, &sane](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PrefetchAfter(i, bodies, kUpToForces);
      if (!IsSane(*bodies[i])) sane.store(false, std::memory_order_relaxed);
    }
  });
  return sane.load(std::memory_order_relaxed);
}

}  // namespace

void World::Impl::Step(double dt_s) {
  isolated.clear();
  if (bodies.awake().empty() && !pairs.has_ended() && bodies.Moving().empty()) {
    narrow_phase.Clear();
    continuous.Clear();
    sleep.RunIdle();
    report.RunIdle();
    return;
  }
  queries.Moved();
  IsolateInsane();
  FindIslands(dt_s);

  motions.resize(bodies.awake().size());
  FlyFree(bodies.awake(), islands, loads.plans(), dt_s, motions, team);
  if (anything_to_solve()) {
    const SolveInput in = SolveInputOf(dt_s);
    solve.Solve(in);
    solve.ReadBack(in, motions);
    assert(solve.Validate(in));
  }
  continuous.Run({dt_s, bodies.awake(), joints, groups}, broad_phase, pairs, motions);
  assert(continuous.Validate(bodies.awake()));
  integrator.Run(bodies.awake(), islands, motions);
  assert(Integrator::Validate(bodies.awake()));
  FindRestless();
  sleep.Run(dt_s, islands, bodies, restless);
  AdvanceKinematic(dt_s);
  assert(bodies.Validate());

  for (RigidBody* body : integrator.failing()) Isolate(*body);
  report.Run(Outcome(), pairs);
  assert(report.Validate());
}

void World::Impl::FindRestless() {
  restless.clear();
  if (bodies.Moving().empty()) return;
  for (const ActiveContact& contact : narrow_phase.contacts()) {
    if (contact.driven && contact.live && contact.responds) restless.push_back(contact.one());
  }
  for (const Joint* joint : joints.joints()) {
    const bool driven = joint->b != nullptr && (joint->a->moving() || joint->b->moving());
    if (driven) restless.push_back(joint->AwakeBody().awake_index);
  }
}

void World::Impl::AdvanceKinematic(double dt_s) {
  for (RigidBody* body : bodies.Moving()) {
    body->Advance(dt_s);
    broad_phase.Move(*body);
  }
}

void World::Impl::PrimeContacts(double dt_s, int times) {
  // Insane bodies are left to the step, which reports them.
  const std::span<RigidBody* const> awake = bodies.awake();
  if (times == 0 || awake.empty() || !AreSane(awake, team)) return;
  FindIslands(dt_s);
  if (!anything_to_solve()) return;
  for (int i = 0; i < times; ++i) solve.Solve(SolveInputOf(dt_s));
  for (const ActiveContact& contact : narrow_phase.contacts()) contact.pair->substeps = contact.substeps;
}

// A body that came to be non-finite, or faster than anything in a world has a right to be, is taken out before it can
// touch anything.
void World::Impl::IsolateInsane() {
  if (AreSane(bodies.awake(), team)) return;
  for (std::size_t i = 0; i < bodies.awake().size();) {
    RigidBody& body = *bodies.awake()[i];
    if (IsSane(body)) {
      ++i;
    } else {
      Isolate(body);
    }
  }
}

void World::Impl::FindIslands(double dt_s) {
  broad_phase.Predict(bodies.awake(), dt_s, bodies.Moving());
  broad_phase.BeginPairs(&pairs);
  assert(BroadPhase::Validate(bodies.awake()));

  narrow_phase.Run(dt_s, pairs, waking);
  assert(pairs.Validate() && bodies.Validate() && narrow_phase.Validate(bodies.awake()));

  joints.Run(bodies);
  BuildIslands(bodies.awake().size(), narrow_phase.contacts(), joints.joints(), &islands);
  groups.Run(joints.joints());
  assert(joints.Validate() && Validate(islands, narrow_phase.contacts(), joints.joints()));
  assert(groups.Validate(joints.joints()));

  loads.Run({dt_s, bodies.awake(), narrow_phase.contacts(), joints.joints(), joints.rows(), islands, groups});
  assert(loads.Validate());
}

SolveInput World::Impl::SolveInputOf(double dt_s) {
  return {dt_s,          bodies.awake(), narrow_phase.contacts(), joints.joints(),
          joints.rows(), islands,        loads.plans(),           loads.bearing()};
}

StepOutcome World::Impl::Outcome() const {
  return {narrow_phase.contacts(), narrow_phase.parting(), continuous.crossed(), continuous.impulses()};
}

}  // namespace tessera::physics
