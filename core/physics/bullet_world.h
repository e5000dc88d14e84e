// BulletWorld: Bullet's world, with the order of its work taken from body ids.
//
// Stock Bullet solves contacts in the order in which pairs happened to be found, and joins bodies into islands whose
// bounds overlap, bounds that depend on where a body has been. Here
//   - a pair's contacts are computed with the lower id first, and only while the pair's present bounds overlap;
//   - contacts are solved in the order of their bodies' ids, joints in that of their own;
//   - islands are made of contacts and joints, and sleep and wake as a whole.
// So the result does not depend on how a world was built, and two worlds that hold the same bodies agree on them.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "core/physics/body.h"
#include "core/physics/contact_solver.h"
#include "core/physics/joints.h"

namespace tessera::physics {

// A manifold that has points, seen with the lower id first.
struct Touch {
  BodyId low, high;
  btPersistentManifold* manifold;
  bool responds = false;  // no trigger is in it
};

// What a world is built from; made before it and destroyed after it.
struct BulletParts {
  BulletParts();
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  ContactSolver solver;
};

class BulletWorld : private BulletParts, public btDiscreteDynamicsWorld {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  BulletWorld(const btVector3& gravity, int solver_iterations);

  void AddJoint(Joint& joint);
  void RemoveJoint(Joint& joint);
  // Wakes the bodies that have contact points with this one.
  void WakeTouching(Body& body);

  // Of the last step: all manifolds with points, by ids; and of those that were solved, in `solved` order, the
  // impulses.
  std::span<const Touch> touches() const { return touches_; }
  std::span<const Touch> solved() const { return solved_; }
  std::span<const ManifoldImpulse> impulses() const { return solver.impulses(); }

 protected:
  void predictUnconstraintMotion(btScalar dt) override;
  void calculateSimulationIslands() override;
  void solveConstraints(btContactSolverInfo& info) override;

 private:
  void CollectTouches();
  void JoinIslands();
  void SleepAndWake();
  int Root(int node);
  void Unite(const btCollisionObject& a, const btCollisionObject& b);

  std::map<JointId, Joint*> joints_;
  std::vector<int> parent_;  // union-find over the bodies that can move
  std::vector<char> awake_;
  std::vector<Touch> touches_, solved_;
  std::vector<btCollisionObject*> solving_bodies_;
  std::vector<btPersistentManifold*> solving_manifolds_;
  std::vector<btTypedConstraint*> solving_joints_;
};

}  // namespace tessera::physics
