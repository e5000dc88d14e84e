#include "core/physics/bullet_world.h"

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <tuple>

#include "core/physics/contact_rules.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

btDefaultCollisionConstructionInfo ConfigurationInfo() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = kManifoldPool;
  info.m_defaultMaxCollisionAlgorithmPoolSize = kManifoldPool;
  return info;
}

bool BoundsOverlap(const btBroadphaseProxy& a, const btBroadphaseProxy& b) {
  return a.m_aabbMin.x() <= b.m_aabbMax.x() && b.m_aabbMin.x() <= a.m_aabbMax.x() &&
         a.m_aabbMin.y() <= b.m_aabbMax.y() && b.m_aabbMin.y() <= a.m_aabbMax.y() &&
         a.m_aabbMin.z() <= b.m_aabbMax.z() && b.m_aabbMin.z() <= a.m_aabbMax.z();
}

// Bullet's own keeps the broad phase's order of the two, and works on pairs whose bounds merely overlapped some time
// ago, which leaves a trace in the search for their contacts.
void CollideInIdOrder(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info) {
  auto* first = static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
  auto* second = static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
  if (!dispatcher.needsCollision(first, second)) return;
  if (!BoundsOverlap(*pair.m_pProxy0, *pair.m_pProxy1)) {
    if (pair.m_algorithm != nullptr) {
      pair.m_algorithm->~btCollisionAlgorithm();
      dispatcher.freeCollisionAlgorithm(pair.m_algorithm);
      pair.m_algorithm = nullptr;
    }
    return;
  }
  if (Body::Of(*second).id() < Body::Of(*first).id()) std::swap(first, second);
  const btCollisionObjectWrapper a(nullptr, first->getCollisionShape(), first, first->getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper b(nullptr, second->getCollisionShape(), second, second->getWorldTransform(), -1, -1);
  if (pair.m_algorithm == nullptr) {
    pair.m_algorithm = dispatcher.findAlgorithm(&a, &b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  if (pair.m_algorithm == nullptr) return;
  btManifoldResult result(&a, &b);
  pair.m_algorithm->processCollision(&a, &b, info, &result);
}

// Manifolds of one pair (a compound has one for each of its parts) are told apart by what of the pair they join.
bool Before(const Touch& x, const Touch& y) {
  if (x.low != y.low) return x.low < y.low;
  if (x.high != y.high) return x.high < y.high;
  const auto key = [](const Touch& touch) {
    const btManifoldPoint& p = touch.manifold->getContactPoint(0);
    return std::tuple(p.m_index0, p.m_index1, p.m_localPointA.x(), p.m_localPointA.y(), p.m_localPointA.z(),
                      p.m_localPointB.x(), p.m_localPointB.y(), p.m_localPointB.z());
  };
  return x.manifold != y.manifold && key(x) < key(y);
}

}  // namespace

BulletParts::BulletParts() : configuration(ConfigurationInfo()), dispatcher(&configuration) {
  configuration.setPlaneConvexMultipointIterations(3, 3);
  dispatcher.setNearCallback(&CollideInIdOrder);
}

BulletWorld::BulletWorld(const btVector3& gravity, int solver_iterations)
    : btDiscreteDynamicsWorld(&dispatcher, &broadphase, &solver, &configuration) {
  InstallContactRules();
  setGravity(gravity);
  setForceUpdateAllAabbs(false);  // statics cost nothing
  btContactSolverInfo& info = getSolverInfo();
  info.m_numIterations = solver_iterations;
  // Two directions, the first along the slip: with one alone a body at rest is free to creep across it.
  info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  // Never stops early: when to stop would depend on which islands are solved together.
  info.m_leastSquaresResidualThreshold = -1;
}

void BulletWorld::AddJoint(Joint& joint) {
  joints_.emplace(joint.id(), &joint);
  addConstraint(&joint.bullet(), !joint.bodies_collide());
}

void BulletWorld::RemoveJoint(Joint& joint) {
  joints_.erase(joint.id());
  removeConstraint(&joint.bullet());
}

void BulletWorld::WakeTouching(Body& body) {
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getNumContacts() == 0) continue;
    Body &a = Body::Of(*manifold.getBody0()), &b = Body::Of(*manifold.getBody1());
    if (a.trigger() || b.trigger()) continue;
    if (&a == &body) b.Wake();
    if (&b == &body) a.Wake();
  }
}

// As Bullet's, but neither damps what has no damping nor touches what sleeps.
void BulletWorld::predictUnconstraintMotion(btScalar dt) {
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    btRigidBody& body = *m_nonStaticRigidBodies[i];
    if (!body.isActive()) continue;
    if (body.getLinearDamping() > 0 || body.getAngularDamping() > 0) body.applyDamping(dt);
    body.predictIntegratedTransform(dt, body.getInterpolationWorldTransform());
  }
}

void BulletWorld::calculateSimulationIslands() {
  CollectTouches();
  JoinIslands();
  SleepAndWake();
}

void BulletWorld::CollectTouches() {
  touches_.clear();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(i);
    if (manifold->getNumContacts() == 0) continue;
    const Body &a = Body::Of(*manifold->getBody0()), &b = Body::Of(*manifold->getBody1());
    touches_.push_back({.low = std::min(a.id(), b.id()),
                        .high = std::max(a.id(), b.id()),
                        .manifold = manifold,
                        .responds = !a.trigger() && !b.trigger()});
  }
  std::sort(touches_.begin(), touches_.end(), Before);
}

void BulletWorld::JoinIslands() {
  parent_.resize(static_cast<std::size_t>(m_nonStaticRigidBodies.size()));
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    parent_[static_cast<std::size_t>(i)] = i;
    Body::Of(*m_nonStaticRigidBodies[i]).node = i;
  }
  for (const Touch& touch : touches_) {
    if (touch.responds) Unite(*touch.manifold->getBody0(), *touch.manifold->getBody1());
  }
  for (const auto& [id, joint] : joints_) Unite(joint->bullet().getRigidBodyA(), joint->bullet().getRigidBodyB());
}

void BulletWorld::Unite(const btCollisionObject& a, const btCollisionObject& b) {
  if (a.isStaticObject() || b.isStaticObject()) return;
  parent_[static_cast<std::size_t>(Root(Body::Of(a).node))] = Root(Body::Of(b).node);
}

int BulletWorld::Root(int node) {
  while (parent_[static_cast<std::size_t>(node)] != node) {
    int& parent = parent_[static_cast<std::size_t>(node)];
    parent = parent_[static_cast<std::size_t>(parent)];
    node = parent;
  }
  return node;
}

// An island sleeps when all of it wants to, and one that moves wakes the rest.
void BulletWorld::SleepAndWake() {
  awake_.assign(parent_.size(), 0);
  const auto island = [this](int i) -> char& { return awake_[static_cast<std::size_t>(Root(i))]; };
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    const int state = m_nonStaticRigidBodies[i]->getActivationState();
    if (state == ACTIVE_TAG || state == DISABLE_DEACTIVATION) island(i) = 1;
  }
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    btRigidBody& body = *m_nonStaticRigidBodies[i];
    if (island(i) == 0) {
      body.setActivationState(ISLAND_SLEEPING);
    } else if (body.getActivationState() == ISLAND_SLEEPING) {
      Body::Of(body).Wake();
      body.applyGravity();  // the step's began without it
    }
  }
}

// All that is awake in one call: islands share no row, so what one does is the same alone or in company.
void BulletWorld::solveConstraints(btContactSolverInfo& info) {
  solving_bodies_.clear();
  solving_manifolds_.clear();
  solving_joints_.clear();
  solved_.clear();
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    if (m_nonStaticRigidBodies[i]->isActive()) solving_bodies_.push_back(m_nonStaticRigidBodies[i]);
  }
  for (const Touch& touch : touches_) {
    if (!touch.responds || (!touch.manifold->getBody0()->isActive() && !touch.manifold->getBody1()->isActive()))
      continue;
    solved_.push_back(touch);
    solving_manifolds_.push_back(touch.manifold);
  }
  for (const auto& [id, joint] : joints_) {
    if (joint->bullet().getRigidBodyA().isActive() || joint->bullet().getRigidBodyB().isActive()) {
      solving_joints_.push_back(&joint->bullet());
    }
  }
  solver.solveGroup(solving_bodies_.data(), static_cast<int>(solving_bodies_.size()), solving_manifolds_.data(),
                    static_cast<int>(solving_manifolds_.size()), solving_joints_.data(),
                    static_cast<int>(solving_joints_.size()), info, nullptr, &dispatcher);
}

}  // namespace tessera::physics
