#include "control_plane/standbys.h"

#include <gtest/gtest.h>

#include <map>

namespace tessera::control {
namespace {

const CutBetween kNothingIsCut = [](RegionId, RegionId) { return false; };

RegionId StandbyIn(const PartitionMap& map, std::uint32_t region) {
  for (const MapRegion& entry : map.regions()) {
    if (entry.id == RegionId(region)) return entry.standby;
  }
  return RegionId();
}

// Regions 1 and 2 on alpha, 3 and 4 on beta.
std::string HostOf(RegionId region) { return region.value() <= 2 ? "alpha" : "beta"; }

TEST(StandbysTest, AreOnAnotherHostAndSpreadEvenly) {
  const auto map = WithStandbys(*MakeGridMap({0, 0, 100, 100}, 4), HostOf, kNothingIsCut);
  ASSERT_TRUE(map.ok()) << map.status();
  std::map<RegionId, int> primaries;
  for (const MapRegion& region : map->regions()) {
    EXPECT_NE(HostOf(region.standby), HostOf(region.id));
    ++primaries[region.standby];
  }
  for (const auto& [standby, count] : primaries) EXPECT_EQ(count, 1) << standby.value();
}

TEST(StandbysTest, AWarmCopyStaysWhileItIsAsGoodAsAny) {
  const PartitionMap first = *WithStandbys(*MakeGridMap({0, 0, 100, 100}, 4), HostOf, kNothingIsCut);
  const auto moved = [](RegionId region) { return region == RegionId(3) ? std::string("gamma") : HostOf(region); };
  const PartitionMap second = *WithStandbys(first, moved, kNothingIsCut);
  for (std::uint32_t region = 1; region <= 4; ++region) {
    EXPECT_EQ(StandbyIn(second, region), StandbyIn(first, region)) << region;
  }
}

TEST(StandbysTest, OneThatIsCutOffIsTakenOnlyWhereNobodyElseIsLeft) {
  const CutBetween cut = [](RegionId a, RegionId b) {
    return std::minmax(a, b) == std::minmax(RegionId(1), RegionId(2));
  };
  const auto together = [](RegionId) { return std::string("alpha"); };
  EXPECT_EQ(StandbyIn(*WithStandbys(*MakeGridMap({0, 0, 100, 100}, 3), together, cut), 1), RegionId(3));
  EXPECT_EQ(StandbyIn(*WithStandbys(*MakeGridMap({0, 0, 100, 100}, 2), together, cut), 1), RegionId(2));
  EXPECT_EQ(StandbyIn(*WithStandbys(*MakeGridMap({0, 0, 100, 100}, 1), together, cut), 1), RegionId());
}

}  // namespace
}  // namespace tessera::control
