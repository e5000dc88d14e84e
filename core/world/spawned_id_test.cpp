#include "core/world/spawned_id.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(SpawnedIdTest, AnIdHoldsWhatTheBodyIs) {
  const SpawnedId largest{kMaxPrefabs - 1, kMaxMaker, kMaxMade, kMaxPrefabBodies - 1};
  for (const SpawnedId& id : {SpawnedId{}, SpawnedId{3, 7, 11, 2}, largest}) {
    EXPECT_EQ(PartsOf(SpawnedBodyId(id)), id);
    EXPECT_TRUE(IsSpawned(SpawnedBodyId(id)));
    EXPECT_FALSE(IsPlayerBody(SpawnedBodyId(id)));
  }
  EXPECT_EQ(SpawnedBodyId(largest).value(), ~std::uint64_t{0});
}

TEST(SpawnedIdTest, BodiesOfScenesAndPlayersAreNotSpawned) {
  EXPECT_FALSE(IsSpawned(BodyId(1)));
  const BodyId last = PlayerBodyId(PlayerNumber(0xffffffff));
  EXPECT_FALSE(IsSpawned(last));
  EXPECT_TRUE(IsPlayerBody(last));
  EXPECT_FALSE(IsPlayerBody(BodyId(last.value() + 1)));
}

TEST(SpawnedIdTest, MembersOfOneAssemblyFollowEachOther) {
  const BodyId first = SpawnedBodyId({1, 2, 3, 0});
  EXPECT_EQ(WithMember(first, 5), SpawnedBodyId({1, 2, 3, 5}));
  EXPECT_EQ(WithMember(WithMember(first, 5), 0), first);
}

TEST(SpawnedIdTest, AWorkerGivesEachIdOnce) {
  SpawnedIds ids(Incarnation(9));
  EXPECT_EQ(ids.Next(4), SpawnedBodyId({4, 9, 1, 0}));
  EXPECT_EQ(ids.Next(0), SpawnedBodyId({0, 9, 2, 0}));
  EXPECT_EQ(SpawnedIds(Incarnation(kMaxMaker + 1)).Next(0), std::nullopt);
}

}  // namespace
}  // namespace tessera
