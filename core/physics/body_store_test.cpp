// The store lists awake bodies and connects bodies with their joints; bodies wake with those that they are connected
// to.
#include "core/physics/body_store.h"

#include <gmock/gmock.h>

#include "core/physics/testing/loose_bodies.h"

namespace tessera::physics {
namespace {

using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

TEST(BodyStoreTest, ListsWhoIsAwakeByAwakeIndex) {
  LooseBodies loose;
  RigidBody& a = loose.Add(Dynamic(1, Ball(), {}));
  RigidBody& b = loose.Add(Dynamic(2, Ball(), {2, 0, 0}));
  RigidBody& c = loose.Add(Dynamic(3, Ball(), {4, 0, 0}));
  loose.Add(Static(4, Ground()));
  EXPECT_THAT(loose.bodies.awake(), ElementsAre(&a, &b, &c));
  loose.bodies.UnlistAwake(a);
  a.FallAsleep();
  EXPECT_THAT(loose.bodies.awake(), UnorderedElementsAre(&b, &c));
  EXPECT_EQ(loose.bodies.awake()[b.awake_index], &b);
  EXPECT_EQ(loose.bodies.awake()[c.awake_index], &c);
  EXPECT_TRUE(loose.bodies.Validate());
}

TEST(BodyStoreTest, ValidateFindsASleeperInTheList) {
  LooseBodies loose;
  RigidBody& a = loose.Add(Dynamic(1, Ball(), {}));
  a.FallAsleep();
  EXPECT_FALSE(loose.bodies.Validate());
}

TEST(BodyStoreTest, BodiesAndTheirJointsNameEachOther) {
  LooseBodies loose;
  RigidBody& a = loose.Add(Dynamic(1, Ball(), {}));
  RigidBody& b = loose.Add(Dynamic(2, Ball(), {1, 0, 0}));
  Joint& joint = loose.bodies.AddJoint(PointBetween(7, 1, 2, {0.5, 0, 0}, {-0.5, 0, 0}));
  EXPECT_THAT(a.joints, ElementsAre(&joint));
  EXPECT_THAT(b.joints, ElementsAre(&joint));
  EXPECT_TRUE(JointForbidsContact(a, b));
  EXPECT_TRUE(JointForbidsContact(b, a));
  loose.bodies.RemoveJoint(joint);
  EXPECT_TRUE(a.joints.empty() && b.joints.empty());
  EXPECT_FALSE(JointForbidsContact(a, b));
}

TEST(BodyStoreTest, GivesTheSerialOfARemovedBodyToTheNextOne) {
  LooseBodies loose;
  RigidBody& a = loose.Add(Static(1, Ball()));
  const std::uint64_t serial = a.serial;
  loose.bodies.Remove(a);
  EXPECT_EQ(loose.Add(Static(2, Ball())).serial, serial);
  EXPECT_NE(loose.Add(Static(3, Ball())).serial, serial);
}

// --- Waking

BodyDef Asleep(BodyDef def) {
  def.initial.asleep = true;
  return def;
}

TEST(WakingTest, WakesAllThatJointsConnectThroughOthers) {
  LooseBodies loose;
  std::vector<RigidBody*> chain;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    chain.push_back(&loose.Add(Asleep(Dynamic(i, Ball(0.2), {static_cast<double>(i), 0, 0}))));
  }
  for (std::uint32_t i = 1; i <= 2; ++i) loose.bodies.AddJoint(PointBetween(i, i, i + 1, {0.5, 0, 0}, {-0.5, 0, 0}));
  loose.waking.Wake(*chain[0]);
  EXPECT_THAT(loose.bodies.awake(), UnorderedElementsAre(chain[0], chain[1], chain[2]));
  EXPECT_FALSE(chain[3]->awake());
  EXPECT_TRUE(loose.bodies.Validate());
}

TEST(WakingTest, WakesNeitherStaticNorIsolatedBodies) {
  LooseBodies loose;
  RigidBody &ground = loose.Add(Static(1, Ground())), &isolated = loose.Add(Asleep(Dynamic(2, Ball(), {})));
  isolated.isolated = true;
  loose.waking.Wake(ground);
  loose.waking.Wake(isolated);
  EXPECT_TRUE(loose.bodies.awake().empty());
}

TEST(WakingTest, NeighboursAreThoseThatTouchAndThoseThatAreJointed) {
  LooseBodies loose;
  RigidBody& body = loose.Add(Asleep(Dynamic(1, Ball(), {})));
  RigidBody& touching = loose.Add(Asleep(Dynamic(2, Ball(), {1, 0, 0})));
  RigidBody& near = loose.Add(Asleep(Dynamic(3, Ball(), {0, 1.01, 0})));
  RigidBody& jointed = loose.Add(Asleep(Dynamic(4, Ball(), {0, 0, 3})));
  loose.AddContact(body, touching, {1, 0, 0}).touching = true;
  loose.AddContact(body, near, {0, 1, 0}, 0.01f);
  loose.bodies.AddJoint(PointBetween(1, 4, 1, {0, 0, -1.5}, {0, 0, 1.5}));
  loose.waking.WakeNeighbours(body);
  EXPECT_TRUE(touching.awake());
  EXPECT_FALSE(near.awake());
  EXPECT_TRUE(jointed.awake());
  EXPECT_TRUE(body.awake()) << "it wakes with the one that is jointed to it";
  EXPECT_TRUE(loose.bodies.Validate());
}

}  // namespace
}  // namespace tessera::physics
