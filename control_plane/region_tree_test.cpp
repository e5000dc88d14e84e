#include "control_plane/region_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "control_plane/control_settings.h"
#include "core/world/partition_change.h"

namespace tessera::control {
namespace {

constexpr Rect kWorld{0, 0, 200, 100};

// Points, each of which costs its region the same; an empty region costs a little too.
struct Crowd {
  std::vector<std::pair<double, double>> points;

  static Crowd HotCorner(int n) {
    Crowd crowd;
    for (int i = 0; i < n; ++i) {
      // A fixed spread by two irrational strides; four of five run into one twentieth of each side.
      const double u = std::fmod(i * 0.6180339887, 1), v = std::fmod(i * 0.7548776662, 1);
      const double scale = i % 5 == 0 ? 1 : 0.15;
      crowd.points.emplace_back(u * scale * kWorld.max_x, v * scale * kWorld.max_z);
    }
    return crowd;
  }
  // As workers report it.
  RegionSpreads Spreads(const PartitionMap& map) const {
    std::map<RegionId, RegionSpread> positions, spreads;
    for (const auto& [x, z] : points) {
      RegionSpread& owned = positions[map.OwnerOf({x, 0, z})];
      owned.x.push_back(x);
      owned.z.push_back(z);
    }
    for (auto& [region, owned] : positions) {
      for (std::vector<double> RegionSpread::*axis : {&RegionSpread::x, &RegionSpread::z}) {
        std::vector<double>& values = owned.*axis;
        std::sort(values.begin(), values.end());
        for (std::size_t i = 0; i <= 16; ++i) (spreads[region].*axis).push_back(values[i * (values.size() - 1) / 16]);
      }
    }
    return spreads;
  }
  RegionLoads Loads(const PartitionMap& map, double noise = 0, int seed = 0) const {
    RegionLoads loads;
    for (const MapRegion& region : map.regions()) loads[region.id] = 1;
    for (const auto& [x, z] : points) loads[map.OwnerOf({x, 0, z})] += 1;
    for (auto& [region, load] : loads) {
      const double u = std::fmod((seed * 31 + static_cast<double>(region.value())) * 0.6180339887, 1);
      load *= 1 + noise * (2 * u - 1);
    }
    return loads;
  }
};

PartitionMap Wanted(const RegionTree& tree, const PartitionMap& now) {
  auto map = tree.ToMap(MapVersion(now.version().value() + 1), now.regions());
  EXPECT_TRUE(map.ok()) << map.status();  // which checks that the world is covered exactly once
  return *map;
}

TEST(RegionTreeTest, FindsEveryGridBack) {
  for (std::uint32_t n = 1; n <= 40; ++n) {
    const PartitionMap grid = *MakeGridMap(kWorld, n);
    const auto tree = RegionTree::FromMap(grid);
    ASSERT_TRUE(tree.ok()) << n << ": " << tree.status();
    const PartitionMap again = Wanted(*tree, grid);
    ASSERT_EQ(again.cells().size(), grid.cells().size());
    for (const Cell& cell : grid.cells()) {
      const double x = (cell.area.min_x + cell.area.max_x) / 2, z = (cell.area.min_z + cell.area.max_z) / 2;
      EXPECT_EQ(again.CellAt(x, z).area, cell.area);
      EXPECT_EQ(again.CellAt(x, z).owner, cell.owner);
    }
  }
}

TEST(RegionTreeTest, RefusesWhatNoCutSeparates) {
  // A pinwheel.
  const auto cell = [](double x0, double z0, double x1, double z1, std::uint32_t owner) {
    return Cell{{x0, z0, x1, z1}, RegionId(owner), Epoch(1), RegionId()};
  };
  const auto map = PartitionMap::Create(
      MapVersion(1), {0, 0, 3, 3},
      {cell(0, 0, 2, 1, 1), cell(2, 0, 3, 2, 2), cell(1, 2, 3, 3, 3), cell(0, 1, 1, 3, 4), cell(1, 1, 2, 2, 5)},
      {{RegionId(1), RegionId()},
       {RegionId(2), RegionId()},
       {RegionId(3), RegionId()},
       {RegionId(4), RegionId()},
       {RegionId(5), RegionId()}});
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_FALSE(RegionTree::FromMap(*map).ok());
}

TEST(RegionTreeTest, GrowsAndShrinksByWholeRegions) {
  const PartitionMap grid = *MakeGridMap(kWorld, 2);
  RegionTree tree = *RegionTree::FromMap(grid);
  for (std::uint32_t id = 3; id <= 8; ++id) tree.Split(RegionId(id / 2), RegionId(id));
  EXPECT_EQ(Wanted(tree, grid).regions().size(), 8u);
  while (tree.Regions().size() > 1) {
    tree.Remove(tree.Lightest(Crowd::HotCorner(1000).Loads(Wanted(tree, grid))));
    Wanted(tree, grid);
  }
}

TEST(RegionTreeTest, ARegionWithADeadOnesCellsGivesThemToTheNewcomer) {
  const PartitionMap grid = *MakeGridMap(kWorld, 4);
  const RegionId dead[] = {RegionId(3)};
  const PartitionMap failover = *FailoverMap(grid, dead, MapVersion(2));
  RegionTree tree = *RegionTree::FromMap(failover);
  const RegionId standby = failover.OwnerOf({1, 0, 99});
  tree.Split(standby, RegionId(3));
  EXPECT_EQ(Wanted(tree, failover).regions().size(), 4u);
}

TEST(BalanceTest, AHotSpotIsSharedOutInAFewMoves) {
  const Crowd crowd = Crowd::HotCorner(2000);
  for (const std::uint32_t n : {2u, 4u, 6u, 9u}) {
    PartitionMap map = *MakeGridMap(kWorld, n);
    const double before = Imbalance(crowd.Loads(map));
    EXPECT_GT(before, 1.5) << n;
    int moves = 0;
    while (Imbalance(crowd.Loads(map)) > 1.2 && moves < 20) {
      RegionTree tree = *RegionTree::FromMap(map);
      tree.Balance(crowd.Loads(map), {}, 0.5);
      map = Wanted(tree, map);
      ++moves;
    }
    EXPECT_LE(Imbalance(crowd.Loads(map)), 1.2) << n;
    EXPECT_LE(moves, 5) << n;
    RecordProperty("moves_" + std::to_string(n), moves);
    std::printf("%u regions: imbalance %.2f, %.2f after %d moves\n", n, before, Imbalance(crowd.Loads(map)), moves);
  }
}

// A change and the wait for step times of the new map take 2 to 3 s.
TEST(BalanceTest, WhoKnowsWhereTheLoadLiesSharesItOutWithinTenSeconds) {
  constexpr int kMovesInTenSeconds = 3;
  const Crowd crowd = Crowd::HotCorner(2000);
  for (const std::uint32_t n : {2u, 4u}) {
    PartitionMap map = *MakeGridMap(kWorld, n);
    for (int moves = 0; moves < kMovesInTenSeconds; ++moves) {
      RegionTree tree = *RegionTree::FromMap(map);
      tree.Balance(crowd.Loads(map), crowd.Spreads(map), kBalanceStep);
      map = Wanted(tree, map);
    }
    EXPECT_LE(Imbalance(crowd.Loads(map)), 1.3) << n;
  }
}

TEST(BalanceTest, ACutIsPlacedWhereTheLoadLies) {
  // Two regions; all of the first one's load lies between x = 60 and 100, half of it above 80.
  const PartitionMap map = *MakeGridMap(kWorld, 2);
  const RegionSpreads spreads{{RegionId(1), {{60, 80, 100}, {0, 50, 100}}}};
  RegionTree tree = *RegionTree::FromMap(map);
  tree.Balance({{RegionId(1), 10}, {RegionId(2), 0}}, spreads, 0.5);
  EXPECT_NEAR(Wanted(tree, map).CellAt(0, 0).area.max_x, 80, 1e-6);
}

TEST(BalanceTest, LoadInOneSpotLeavesTheWorldCovered) {
  for (const std::uint32_t n : {2u, 4u, 9u}) {
    PartitionMap map = *MakeGridMap(kWorld, n);
    for (int moves = 0; moves < 20; ++moves) {
      const RegionId owner = map.OwnerOf({37, 0, 21});
      RegionTree tree = *RegionTree::FromMap(map);
      tree.Balance({{owner, 10}}, {{owner, {{37, 37}, {21, 21}}}}, 0.5);
      map = Wanted(tree, map);
    }
  }
}

TEST(BalanceTest, NoBorderMovesForNoise) {
  const Crowd crowd = Crowd::HotCorner(2000);
  PartitionMap map = *MakeGridMap(kWorld, 4);
  for (int moves = 0; moves < 20 && Imbalance(crowd.Loads(map)) > 1.1; ++moves) {
    RegionTree tree = *RegionTree::FromMap(map);
    tree.Balance(crowd.Loads(map), {}, 0.5);
    map = Wanted(tree, map);
  }
  ASSERT_LE(Imbalance(crowd.Loads(map)), 1.1);
  for (int seed = 0; seed < 100; ++seed) EXPECT_LT(Imbalance(crowd.Loads(map, 0.05, seed)), 1.2) << seed;
}

}  // namespace
}  // namespace tessera::control
