#include "core/physics/contact_solver.h"

namespace tessera::physics {

void ContactSolver::convertContacts(btPersistentManifold** manifolds, int count, const btContactSolverInfo& info) {
  impulses_.assign(static_cast<std::size_t>(count), ManifoldImpulse());
  manifold_of_row_.clear();
  for (int i = 0; i < count; ++i) {
    convertContact(manifolds[i], info);
    manifold_of_row_.resize(static_cast<std::size_t>(m_tmpSolverContactConstraintPool.size()), i);
  }
}

btScalar ContactSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                                      const btContactSolverInfo& info) {
  const auto manifold_of = [this](int row) -> ManifoldImpulse& {
    return impulses_[static_cast<std::size_t>(manifold_of_row_[static_cast<std::size_t>(row)])];
  };
  for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i)
    Add(m_tmpSolverContactConstraintPool[i], manifold_of(i));
  for (const btConstraintArray* pool :
       {&m_tmpSolverContactFrictionConstraintPool, &m_tmpSolverContactRollingFrictionConstraintPool}) {
    for (int i = 0; i < pool->size(); ++i) Add((*pool)[i], manifold_of((*pool)[i].m_frictionIndex));
  }
  return btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish(bodies, count, info);
}

void ContactSolver::Add(const btSolverConstraint& row, ManifoldImpulse& sum) const {
  const btScalar impulse = row.m_appliedImpulse;
  const bool body1_moves = m_tmpSolverBodyPool[row.m_solverBodyIdB].m_originalBody != nullptr;
  sum.on_body1 += (body1_moves ? row.m_contactNormal2 : -row.m_contactNormal1) * impulse;
  sum.angular_on_body0 += row.m_relpos1CrossNormal * impulse;
  sum.angular_on_body1 += row.m_relpos2CrossNormal * impulse;
}

}  // namespace tessera::physics
