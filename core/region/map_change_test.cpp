#include "core/region/map_change.h"

#include <gmock/gmock.h>

namespace tessera::region {
namespace {

constexpr Rect kBounds{0, 0, 8, 8};

PartitionMap Version(std::uint64_t version) {
  return *PartitionMap::Create(MapVersion(version), kBounds, {{kBounds, RegionId(1), Epoch(1)}},
                               {{RegionId(1), RegionId()}});
}

TEST(MapChangeTest, IsDueOneTickBeforeItIsInForceOnceItIsCommitted) {
  MapChange change;
  ASSERT_TRUE(change.Announce(Version(2), Tick(50), MapVersion(1), Tick(10)).ok());
  EXPECT_FALSE(change.DueAt(Tick(49)));
  ASSERT_TRUE(change.Commit(MapVersion(2), Tick(20), 3).ok());
  EXPECT_FALSE(change.DueAt(Tick(48)));
  EXPECT_TRUE(change.DueAt(Tick(49)));
}

TEST(MapChangeTest, RefusesACommitThatNotEveryoneCouldHearOf) {
  MapChange change;
  ASSERT_TRUE(change.Announce(Version(2), Tick(50), MapVersion(1), Tick(10)).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(change.Commit(MapVersion(2), Tick(46), 3)));
  EXPECT_FALSE(change.committed());
  EXPECT_TRUE(change.Commit(MapVersion(2), Tick(45), 3).ok());
  EXPECT_TRUE(change.Commit(MapVersion(2), Tick(49), 3).ok()) << "repeating does nothing";
}

TEST(MapChangeTest, WhereNobodyHasToHearOfItACommitIsInTimeForTheNextTick) {
  MapChange change;
  ASSERT_TRUE(change.Announce(Version(2), Tick(12), MapVersion(1), Tick(10)).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(change.Commit(MapVersion(2), Tick(10), 1)));
  EXPECT_TRUE(change.Commit(MapVersion(2), Tick(10), 0).ok());
  EXPECT_FALSE(change.DueAt(Tick(10)));
  EXPECT_TRUE(change.DueAt(Tick(11)));
}

TEST(MapChangeTest, BelievesWhatOthersHaveCommittedWheneverItComes) {
  MapChange change;
  change.Heard(MapVersion(2));
  ASSERT_TRUE(change.Announce(Version(2), Tick(50), MapVersion(1), Tick(10)).ok());
  EXPECT_TRUE(change.committed());
  EXPECT_EQ(change.newest_commit(), MapVersion(2));
}

TEST(MapChangeTest, AMapThatShouldBeInForceIsNoticed) {
  MapChange change;
  ASSERT_TRUE(change.Announce(Version(2), Tick(50), MapVersion(1), Tick(10)).ok());
  ASSERT_TRUE(change.Commit(MapVersion(2), Tick(20), 3).ok());
  change.Validate(MapVersion(1), Tick(48));
  EXPECT_DEBUG_DEATH(change.Validate(MapVersion(1), Tick(49)), "");
  EXPECT_DEBUG_DEATH(change.Validate(MapVersion(2), Tick(20)), "");
  change.Clear();
  change.Validate(MapVersion(2), Tick(49));
}

TEST(MapChangeTest, RefusesWhatIsOldTooNearOrInTheWay) {
  MapChange change;
  EXPECT_TRUE(absl::IsFailedPrecondition(change.Announce(Version(1), Tick(50), MapVersion(1), Tick(10))));
  EXPECT_TRUE(absl::IsFailedPrecondition(change.Announce(Version(2), Tick(11), MapVersion(1), Tick(10))));
  EXPECT_TRUE(absl::IsNotFound(change.Commit(MapVersion(2), Tick(10), 1)));
  ASSERT_TRUE(change.Announce(Version(2), Tick(50), MapVersion(1), Tick(10)).ok());
  ASSERT_TRUE(change.Announce(Version(2), Tick(60), MapVersion(1), Tick(10)).ok()) << "a later tick";
  EXPECT_EQ(change.effective(), Tick(60));
  ASSERT_TRUE(change.Announce(Version(3), Tick(60), MapVersion(1), Tick(10)).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(change.Announce(Version(2), Tick(60), MapVersion(1), Tick(10))));
  change.Heard(MapVersion(3));
  EXPECT_TRUE(absl::IsFailedPrecondition(change.Announce(Version(4), Tick(60), MapVersion(1), Tick(10))));
}

TEST(FurthestRegionTest, CountsLinks) {
  const PartitionMap row =
      *PartitionMap::Create(MapVersion(1), {0, 0, 4, 1},
                            {{{0, 0, 1, 1}, RegionId(1), Epoch(1)},
                             {{1, 0, 2, 1}, RegionId(2), Epoch(1)},
                             {{2, 0, 3, 1}, RegionId(3), Epoch(1)},
                             {{3, 0, 4, 1}, RegionId(4), Epoch(1)}},
                            {{RegionId(1), {}}, {RegionId(2), {}}, {RegionId(3), {}}, {RegionId(4), {}}});
  EXPECT_EQ(FurthestRegion(row, RegionId(1)), 3U);
  EXPECT_EQ(FurthestRegion(row, RegionId(2)), 2U);
  EXPECT_EQ(FurthestRegion(*MakeGridMap(kBounds, 1), RegionId(1)), 0U);
}

}  // namespace
}  // namespace tessera::region
