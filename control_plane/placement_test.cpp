#include "control_plane/placement.h"

#include <gmock/gmock.h>

#include <map>
#include <set>

namespace tessera::control {
namespace {

PartitionMap Grid(std::uint32_t regions) { return *MakeGridMap({0, 0, 100, 100}, regions); }

std::map<std::string, std::set<RegionId>> ByHost(const PlacementPlan& plan) {
  std::map<std::string, std::set<RegionId>> result;
  for (const PlacedRegion& placed : plan.regions) result[placed.host_id].insert(placed.region);
  return result;
}

// How many patches of bordering regions `regions` falls into.
int Patches(const PartitionMap& map, std::set<RegionId> regions) {
  int patches = 0;
  for (; !regions.empty(); ++patches) {
    std::vector<RegionId> open{*regions.begin()};
    regions.erase(regions.begin());
    while (!open.empty()) {
      const RegionId region = open.back();
      open.pop_back();
      for (const RegionId neighbor : map.Neighbors(region)) {
        if (regions.erase(neighbor) > 0) open.push_back(neighbor);
      }
    }
  }
  return patches;
}

TEST(PlacementTest, PlacesEveryRegionOnceWithinCapacity) {
  // Every mix of three hosts of 0 to 7 places, for 1 to 20 regions.
  for (std::uint32_t mix = 0; mix < 8 * 8 * 8; ++mix) {
    const std::vector<FreeHost> hosts{{"a", mix % 8}, {"b", mix / 8 % 8}, {"c", mix / 64}};
    const std::uint32_t room = hosts[0].free + hosts[1].free + hosts[2].free;
    for (std::uint32_t regions = 1; regions <= 20; ++regions) {
      const auto plan = Place(Grid(regions), hosts);
      ASSERT_EQ(plan.ok(), regions <= room) << regions << " on mix " << mix;
      if (!plan.ok()) continue;
      ASSERT_EQ(plan->regions.size(), regions);
      const auto by_host = ByHost(*plan);
      std::size_t placed = 0;
      for (const FreeHost& host : hosts) {
        const std::size_t here = by_host.contains(host.id) ? by_host.at(host.id).size() : 0;
        ASSERT_LE(here, host.free);
        placed += here;
      }
      ASSERT_EQ(placed, regions);
    }
  }
}

TEST(PlacementTest, GivesEachRegionAStandbyOnAnotherHostWhereThereIsOne) {
  const std::vector<FreeHost> hosts{{"a", 30}, {"b", 30}};
  for (std::uint32_t regions = 2; regions <= 30; ++regions) {
    const auto plan = *Place(Grid(regions), hosts);
    std::map<RegionId, std::string> host_of;
    for (const PlacedRegion& placed : plan.regions) host_of[placed.region] = placed.host_id;
    for (const MapRegion& region : plan.map.regions()) {
      ASSERT_NE(region.standby, RegionId()) << regions;
      EXPECT_NE(host_of[region.id], host_of[region.standby]) << regions;
    }
  }
}

TEST(PlacementTest, GivesAStandbyOnTheOnlyHost) {
  const auto plan = *Place(Grid(4), std::vector<FreeHost>{{"a", 4}});
  for (const MapRegion& region : plan.map.regions()) {
    EXPECT_NE(region.standby, RegionId());
    EXPECT_NE(region.standby, region.id);
  }
  EXPECT_EQ((*Place(Grid(1), std::vector<FreeHost>{{"a", 4}})).map.regions()[0].standby, RegionId());
}

TEST(PlacementTest, KeepsBorderingRegionsTogether) {
  for (const std::uint32_t regions : {4u, 9u, 16u, 25u, 64u, 100u}) {
    const auto plan = *Place(Grid(regions), std::vector<FreeHost>{{"a", regions / 2 + 1}, {"b", regions / 2 + 1}});
    for (const auto& [host, placed] : ByHost(plan))
      EXPECT_EQ(Patches(plan.map, placed), 1) << regions << " on " << host;
  }
}

TEST(PlacementTest, UsesNoMoreHostsThanItNeeds) {
  const std::vector<FreeHost> hosts{{"a", 8}, {"b", 8}, {"c", 8}, {"d", 8}};
  EXPECT_EQ(ByHost(*Place(Grid(1), hosts)).size(), 1u);
  EXPECT_EQ(ByHost(*Place(Grid(4), hosts)).size(), 2u);
  EXPECT_EQ(ByHost(*Place(Grid(16), hosts)).size(), 2u);
  EXPECT_EQ(ByHost(*Place(Grid(17), hosts)).size(), 3u);
}

TEST(PlacementTest, NamesNeedAndCapacity) {
  const auto message = [](std::uint32_t regions, const std::vector<FreeHost>& hosts) {
    const auto plan = Place(Grid(regions), hosts);
    EXPECT_EQ(plan.status().code(), absl::StatusCode::kResourceExhausted);
    return std::string(plan.status().message());
  };
  EXPECT_EQ(message(4, {{"a", 2}}), "4 regions need 4 places; the 1 ready host has 2 free");
  EXPECT_EQ(message(9, {{"a", 2}, {"b", 3}}), "9 regions need 9 places; the 2 ready hosts have 5 free");
  EXPECT_EQ(message(1, {}), "1 region needs 1 place; no host is ready");
}

TEST(PlacementTest, PlacesAThousandRegions) {
  const auto plan = Place(Grid(1000), std::vector<FreeHost>{{"a", 400}, {"b", 400}, {"c", 400}});
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(plan->regions.size(), 1000u);
}

}  // namespace
}  // namespace tessera::control
