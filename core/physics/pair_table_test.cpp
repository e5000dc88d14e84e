// Which pairs there is work for, in which order, and which ended while they touched.
#include "core/physics/pair_table.h"

#include <gmock/gmock.h>

#include "core/physics/testing/loose_bodies.h"

namespace tessera::physics {
namespace {

using ::testing::ElementsAre;

std::vector<std::pair<std::uint64_t, std::uint64_t>> Walked(PairTable& pairs) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ids;
  pairs.Walk(
      ThreadTeam::Alone(), [](std::size_t, Pair&) {},
      [&](std::size_t, Pair& pair) { ids.emplace_back(pair.low->id().value(), pair.high->id().value()); });
  return ids;
}

TEST(PairTableTest, WalksActivePairsAscendingByIdsInWhateverOrderTheyBegan) {
  LooseBodies loose;
  std::vector<RigidBody*> balls;
  for (std::uint64_t id : {3, 1, 4, 2}) balls.push_back(&loose.Add(Dynamic(id, Ball(), {})));
  loose.pairs.Begin(*balls[2], *balls[0]);
  loose.pairs.Begin(*balls[3], *balls[1]);
  EXPECT_THAT(Walked(loose.pairs), ElementsAre(std::pair(1, 2), std::pair(3, 4)));
  loose.pairs.Begin(*balls[0], *balls[1]);
  loose.pairs.Begin(*balls[1], *balls[0]);  // a second time
  EXPECT_THAT(Walked(loose.pairs), ElementsAre(std::pair(1, 2), std::pair(1, 3), std::pair(3, 4)));
  EXPECT_TRUE(loose.pairs.Validate());
}

TEST(PairTableTest, ForgetsPairsOfSleepersUntilOneWakes) {
  LooseBodies loose;
  RigidBody &a = loose.Add(Dynamic(1, Ball(), {})), &b = loose.Add(Dynamic(2, Ball(), {}));
  loose.pairs.Begin(a, b);
  a.FallAsleep();
  b.FallAsleep();
  EXPECT_THAT(Walked(loose.pairs), ElementsAre());
  a.Wake();
  loose.pairs.Activate(a);
  EXPECT_THAT(loose.pairs.News(), ElementsAre(loose.pairs.Find(a, b)));
  EXPECT_THAT(Walked(loose.pairs), ElementsAre(std::pair(1, 2)));
}

// Lines are what is prefetched.
TEST(PairTableTest, AManifoldBeginsTheSecondCacheLineOfItsPair) {
  LooseBodies loose;
  RigidBody &a = loose.Add(Dynamic(1, Ball(), {})), &b = loose.Add(Dynamic(2, Ball(), {}));
  const Pair& pair = loose.AddContact(a, b, {1, 0, 0});
  const auto offset = [&pair](const void* at) {
    return static_cast<const char*>(at) - reinterpret_cast<const char*>(&pair);
  };
  EXPECT_EQ(offset(&pair.manifolds[0]), 64);
  EXPECT_LE(offset(&pair.manifolds[0].points[1]), 4 * 64);
  EXPECT_LE(offset(&pair.cache.convex + 1), offset(&pair.material) / 64 * 64 + 3 * 64);
}

TEST(PairTableTest, AnEndIsReportedOnceAndOnlyOfAPairThatTouched) {
  LooseBodies loose;
  RigidBody &a = loose.Add(Dynamic(1, Ball(), {})), &b = loose.Add(Dynamic(2, Ball(), {})),
            &c = loose.Add(Dynamic(3, Ball(), {}));
  loose.AddContact(a, b, {1, 0, 0}).touching = true;
  loose.AddContact(a, c, {1, 0, 0});
  while (!a.pairs.empty()) loose.pairs.End(*a.pairs.back().pair);
  EXPECT_TRUE(b.pairs.empty() && c.pairs.empty());
  std::vector<PairEvent> events;
  loose.pairs.TakeEnded(&events);
  EXPECT_THAT(events, ElementsAre(PairEvent{BodyId(1), BodyId(2), false, false}));
  EXPECT_FALSE(loose.pairs.has_ended());
}

TEST(PairTableTest, AJointBetweenTheTwoEndsTheirContact) {
  LooseBodies loose;
  RigidBody &a = loose.Add(Dynamic(1, Ball(), {})), &b = loose.Add(Dynamic(2, Ball(), {1, 0, 0}));
  Pair& pair = loose.AddContact(a, b, {1, 0, 0});
  pair.touching = true;
  Joint& joint = loose.bodies.AddJoint(PointBetween(1, 1, 2, {0.5, 0, 0}, {-0.5, 0, 0}));
  loose.pairs.NoteJoints(a, b);
  EXPECT_FALSE(pair.responds());
  EXPECT_TRUE(pair.manifolds.empty());
  EXPECT_TRUE(loose.pairs.has_ended());
  loose.bodies.RemoveJoint(joint);
  loose.pairs.NoteJoints(a, b);
  EXPECT_TRUE(pair.responds());
}

TEST(PairTableTest, ValidateFindsAPairThatABodyDoesNotName) {
  LooseBodies loose;
  RigidBody &a = loose.Add(Dynamic(1, Ball(), {})), &b = loose.Add(Dynamic(2, Ball(), {}));
  loose.pairs.Begin(a, b);
  Walked(loose.pairs);
  EXPECT_TRUE(loose.pairs.Validate());
  loose.pairs.Find(a, b)->index_in_low = 5;
  EXPECT_FALSE(loose.pairs.Validate());
  loose.pairs.Find(a, b)->index_in_low = 0;
}

}  // namespace
}  // namespace tessera::physics
