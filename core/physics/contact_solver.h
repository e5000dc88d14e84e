// ContactSolver: Bullet's sequential impulses, which also tells what it applied.
#pragma once

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <span>
#include <vector>

namespace tessera::physics {

// All that one manifold did in a step: normal, lateral, rolling and spinning friction, N s and N m s about each body's
// centre of mass. Zero for a static body's angular part.
struct ManifoldImpulse {
  btVector3 on_body1{0, 0, 0};  // body0 got the opposite
  btVector3 angular_on_body0{0, 0, 0}, angular_on_body1{0, 0, 0};
};

class ContactSolver : public btSequentialImpulseConstraintSolver {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  // Of the last `solveGroup`, one for each of its manifolds, in their order.
  std::span<const ManifoldImpulse> impulses() const { return impulses_; }

 protected:
  void convertContacts(btPersistentManifold** manifolds, int count, const btContactSolverInfo& info) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                         const btContactSolverInfo& info) override;

 private:
  void Add(const btSolverConstraint& row, ManifoldImpulse& sum) const;

  std::vector<int> manifold_of_row_;  // of a normal row
  std::vector<ManifoldImpulse> impulses_;
};

}  // namespace tessera::physics
