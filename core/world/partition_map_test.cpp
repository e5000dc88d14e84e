#include "core/world/partition_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "core/world/limits.h"
#include "core/world/partition_io.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Rect kBounds{-100, -50, 100, 250};

PartitionMap Grid(std::uint32_t n, Rect bounds = kBounds) {
  auto map = MakeGridMap(bounds, n);
  EXPECT_TRUE(map.ok()) << n << ": " << map.status();
  return *map;
}

// Looks at every cell; `CellAt` must agree.
const Cell& NearestBySearch(const PartitionMap& map, double x, double z) {
  for (const Cell& cell : map.cells()) {
    if (cell.area.Contains(x, z)) return cell;
  }
  const Cell* nearest = &map.cells()[0];
  for (const Cell& cell : map.cells()) {
    if (cell.area.DistanceTo(x, z) < nearest->area.DistanceTo(x, z)) nearest = &cell;
  }
  return *nearest;
}

// Calls `check(map)` for every grid of 1 to 1000 regions.
template <class Check>
void ForEveryGrid(Check check) {
  for (std::uint32_t n = 1; n <= kMaxRegions; ++n) {
    SCOPED_TRACE(n);
    check(Grid(n), n);
    if (testing::Test::HasFailure()) return;
  }
}

// Cuts the longer side at random until there are n cells.
PartitionMap RandomTree(std::uint32_t n, std::uint32_t regions, std::mt19937& random) {
  std::vector<Cell> cells{{kBounds, RegionId(1), Epoch(1)}};
  while (cells.size() < n) {
    Cell& cell = cells[random() % cells.size()];
    Rect low = cell.area, high = cell.area;
    const double share = 0.2 + 0.6 * static_cast<double>(random() % 1000) / 1000;
    if (low.max_x - low.min_x > low.max_z - low.min_z) {
      low.max_x = high.min_x = low.min_x + share * (low.max_x - low.min_x);
    } else {
      low.max_z = high.min_z = low.min_z + share * (low.max_z - low.min_z);
    }
    cell.area = low;
    cells.push_back({high, RegionId(static_cast<std::uint32_t>(1 + random() % regions)), Epoch(1)});
  }
  std::vector<MapRegion> all;
  for (std::uint32_t id = 1; id <= regions; ++id) all.push_back({RegionId(id), RegionId()});
  auto map = PartitionMap::Create(MapVersion(3), kBounds, cells, all);
  EXPECT_TRUE(map.ok()) << map.status();
  return *map;
}

TEST(GridMapTest, CoversTheAreaExactlyOnce) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any_x(kBounds.min_x, kBounds.max_x), any_z(kBounds.min_z, kBounds.max_z);
  ForEveryGrid([&](const PartitionMap& map, std::uint32_t n) {
    ASSERT_EQ(map.cells().size(), n);
    ASSERT_EQ(map.regions().size(), n);
    double area = 0;
    for (const Cell& cell : map.cells()) area += cell.area.Area();
    ASSERT_NEAR(area, kBounds.Area(), 1e-9 * kBounds.Area());
    const auto holders = [&](double x, double z) {
      return std::ranges::count_if(map.cells(), [&](const Cell& cell) { return cell.area.Contains(x, z); });
    };
    for (int i = 0; i < 20; ++i) ASSERT_EQ(holders(any_x(random), any_z(random)), 1);
    for (int i = 0; i < 20; ++i) {  // where cells meet, too
      const Rect& cell = map.cells()[random() % n].area;
      ASSERT_EQ(holders(cell.min_x, cell.min_z), 1);
      ASSERT_EQ(holders(cell.min_x, any_z(random)), 1);
      ASSERT_EQ(holders(any_x(random), cell.min_z), 1);
    }
  });
}

TEST(GridMapTest, LastRowAndColumnReachTheEdge) {
  // Edges that no sum of equal parts would hit.
  const Rect bounds{-0.1, 1e-3, 1.0 / 3, 0.7};
  for (std::uint32_t n = 1; n <= kMaxRegions; ++n) {
    const PartitionMap map = Grid(n, bounds);
    double max_z = -kInf;
    for (const Cell& cell : map.cells()) max_z = std::max(max_z, cell.area.max_z);
    ASSERT_EQ(max_z, bounds.max_z) << n;
    for (const Cell& cell : map.cells()) {  // a cell without another to its east ends on the bound
      const bool last = std::ranges::none_of(map.cells(), [&](const Cell& other) {
        return other.area.min_z == cell.area.min_z && other.area.min_x > cell.area.min_x;
      });
      ASSERT_TRUE(!last || cell.area.max_x == bounds.max_x) << n;
    }
  }
}

TEST(GridMapTest, ColumnsAndRowsFollowTheAlgorithm) {
  ForEveryGrid([&](const PartitionMap& map, std::uint32_t n) {
    const auto columns = static_cast<std::uint32_t>(std::ceil(std::sqrt(n)));
    const std::uint32_t rows = (n + columns - 1) / columns;
    std::vector<double> row_edges;
    for (const Cell& cell : map.cells()) {
      if (row_edges.empty() || row_edges.back() != cell.area.min_z) row_edges.push_back(cell.area.min_z);
    }
    ASSERT_EQ(row_edges.size(), rows);
    ASSERT_EQ(std::ranges::count(map.cells(), kBounds.min_z, [](const Cell& c) { return c.area.min_z; }),
              rows == 1 ? n : columns);
  });
}

TEST(GridMapTest, ThreeRegionsAreThreeCells) {
  const PartitionMap map = Grid(3, {0, 0, 4, 4});
  ASSERT_EQ(map.cells().size(), 3u);
  EXPECT_EQ(map.cells()[0].area, (Rect{0, 0, 2, 2}));
  EXPECT_EQ(map.cells()[1].area, (Rect{2, 0, 4, 2}));
  EXPECT_EQ(map.cells()[2].area, (Rect{0, 2, 4, 4}));
}

TEST(GridMapTest, FourRegionsMeetInTheMiddle) {
  const PartitionMap map = Grid(4, {-100, -100, 100, 100});
  for (const Cell& cell : map.cells()) EXPECT_TRUE(cell.area.Touches({0, 0, 0, 0}));
  for (std::uint32_t id = 1; id <= 4; ++id) EXPECT_EQ(map.Neighbors(RegionId(id)).size(), 3u);
}

TEST(GridMapTest, EveryRegionHasAnotherForStandby) {
  ForEveryGrid([&](const PartitionMap& map, std::uint32_t n) {
    for (const MapRegion& region : map.regions()) {
      if (n == 1) {
        ASSERT_EQ(region.standby, RegionId());
      } else {
        ASSERT_NE(region.standby, region.id);
        ASSERT_TRUE(region.standby.value() >= 1 && region.standby.value() <= n);
      }
    }
  });
}

TEST(GridMapTest, RefusesWhatIsNoGrid) {
  EXPECT_EQ(MakeGridMap(kBounds, 0).status().message(), "regions: must be 1 to 1000, got 0");
  EXPECT_EQ(MakeGridMap(kBounds, 10'000).status().message(), "regions: must be 1 to 1000, got 10000");
  for (const Rect& bounds :
       {Rect{0, 0, 0, 1}, Rect{0, 0, 1, -1}, Rect{0, 0, kInf, 1}, Rect{kNan, 0, 1, 1}, Rect{-1e308, 0, 1e308, 1}}) {
    const auto map = MakeGridMap(bounds, 4);
    EXPECT_EQ(map.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(map.status().message()), HasSubstr("bounds: must be finite and have an area"));
  }
  // So thin that neighbouring edges round to the same number.
  EXPECT_FALSE(MakeGridMap({1e6, 0, std::nextafter(1e6, kInf), 1}, 1000).ok());
}

TEST(PartitionMapTest, FindsItsRegionsAndNoOther) {
  const PartitionMap map = *PartitionMap::Create(
      MapVersion(1), {0, 0, 2, 1}, {{{0, 0, 1, 1}, RegionId(7), Epoch(1)}, {{1, 0, 2, 1}, RegionId(3), Epoch(1)}},
      {{RegionId(7), RegionId(3)}, {RegionId(3), RegionId()}});
  ASSERT_NE(map.Find(RegionId(7)), nullptr);
  EXPECT_EQ(map.Find(RegionId(7))->standby, RegionId(3));
  EXPECT_EQ(map.Find(RegionId(5)), nullptr);
  EXPECT_TRUE(map.HasRegion(RegionId(3)));
  for (const std::uint32_t other : {0u, 2u, 5u, 8u}) EXPECT_FALSE(map.HasRegion(RegionId(other))) << other;
  EXPECT_FALSE(PartitionMap().HasRegion(RegionId(1)));
  const v1::PartitionMap message = ToProto(map);
  EXPECT_EQ(FindRegion(message, RegionId(7))->standby(), 3u);
  EXPECT_EQ(FindRegion(message, RegionId(5)), nullptr);
}

TEST(PartitionMapTest, NeighborsAreSymmetric) {
  ForEveryGrid([&](const PartitionMap& map, std::uint32_t n) {
    std::vector<std::vector<RegionId>> neighbors(n + 1);
    for (std::uint32_t id = 1; id <= n; ++id) neighbors[id] = map.Neighbors(RegionId(id));
    for (std::uint32_t id = 1; id <= n; ++id) {
      ASSERT_TRUE(n == 1 || !neighbors[id].empty());
      ASSERT_TRUE(std::ranges::is_sorted(neighbors[id]));
      for (const RegionId other : neighbors[id]) {
        ASSERT_NE(other, RegionId(id));
        ASSERT_TRUE(std::ranges::binary_search(neighbors[other.value()], RegionId(id)));
      }
    }
  });
}

TEST(PartitionMapTest, NeighborsOfARegionWithSeveralCells) {
  // 1 1 2
  // 3 4 2     region 4 has been carried on by 1
  const std::vector<Cell> cells{{{0, 0, 2, 1}, RegionId(1), Epoch(1)},
                                {{2, 0, 3, 2}, RegionId(2), Epoch(1)},
                                {{0, 1, 1, 2}, RegionId(3), Epoch(1)},
                                {{1, 1, 2, 2}, RegionId(1), Epoch(2)}};
  const auto map = PartitionMap::Create(MapVersion(2), {0, 0, 3, 2}, cells,
                                        {{RegionId(3), RegionId(1)}, {RegionId(1), {}}, {RegionId(2), {}}});
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_THAT(map->Neighbors(RegionId(1)), ElementsAre(RegionId(2), RegionId(3)));
  EXPECT_THAT(map->Neighbors(RegionId(2)), ElementsAre(RegionId(1)));
  EXPECT_THAT(map->Neighbors(RegionId(9)), IsEmpty());
  EXPECT_EQ(map->regions()[0].id, RegionId(1));
  EXPECT_EQ(map->OwnerOf({1.5, 7, 1.5}), RegionId(1));
  EXPECT_EQ(map->CellAt(1.5, 1.5).epoch, Epoch(2));
  EXPECT_EQ(map->DistanceTo(RegionId(1), {0.5, 0, 1.25}), 0.25);
  EXPECT_EQ(map->DistanceTo(RegionId(9), {0, 0, 0}), kInf);
}

TEST(PartitionMapTest, FindsTheCellThatASearchThroughAllFinds) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(-400, 400);
  const auto check = [&](const PartitionMap& map) {
    for (int i = 0; i < 200; ++i) {
      double x = any(random), z = any(random);
      const Rect& cell = map.cells()[random() % map.cells().size()].area;
      if (i % 3 == 1) x = cell.min_x;
      if (i % 5 == 1) x = cell.max_x;
      if (i % 3 == 2) z = cell.min_z;
      if (i % 7 == 1) z = cell.max_z;
      ASSERT_EQ(&map.CellAt(x, z), &NearestBySearch(map, x, z)) << x << ", " << z;
    }
  };
  for (std::uint32_t n = 1; n <= kMaxRegions; n += 7) check(Grid(n));
  for (std::uint32_t n = 1; n <= 300; n += 3) check(RandomTree(n, 1 + n / 2, random));
}

TEST(PartitionMapTest, ReachesWhatItsBodiesCanTouch) {
  // A box that is a point reaches a region exactly if no region is nearer.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-400, 400);
  for (std::uint32_t n = 1; n <= 60; ++n) {
    const PartitionMap map = RandomTree(n, n, random);
    for (int i = 0; i < 200; ++i) {
      const Vec3d p{any(random), any(random), any(random)};
      double nearest = kInf;
      for (const MapRegion& region : map.regions()) nearest = std::min(nearest, map.DistanceTo(region.id, p));
      for (const MapRegion& region : map.regions()) {
        ASSERT_EQ(map.Reaches(region.id, {p, p}), map.DistanceTo(region.id, p) == nearest);
      }
      ASSERT_TRUE(map.Reaches(map.OwnerOf(p), {p, p}));
    }
  }
}

TEST(PartitionMapTest, ReachesAcrossABorderAndNoFurther) {
  const PartitionMap map = Grid(4, {-100, -100, 100, 100});
  const Aabb box{{-3, 0, 5}, {-1, 1, 6}};  // in region 3, 1 m from 4 and 5 m from 1
  EXPECT_TRUE(map.Reaches(RegionId(3), box));
  EXPECT_FALSE(map.Reaches(RegionId(4), box));
  EXPECT_TRUE(map.Reaches(RegionId(4), box.Expanded(1)));
  EXPECT_FALSE(map.Reaches(RegionId(1), box.Expanded(4.5)));
  EXPECT_TRUE(map.Reaches(RegionId(1), box.Expanded(5)));
}

std::string CreateError(Rect bounds, std::vector<Cell> cells, std::vector<MapRegion> regions) {
  const auto map = PartitionMap::Create(MapVersion(1), bounds, std::move(cells), std::move(regions));
  EXPECT_EQ(map.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(map.status().message());
}

TEST(PartitionMapTest, RefusesWhatDoesNotCoverTheBoundsOnce) {
  const RegionId one(1);
  const std::vector<MapRegion> regions{{one, {}}};
  const Rect bounds{0, 0, 2, 2};
  EXPECT_EQ(CreateError(bounds, {}, regions), "cells: there must be at least one");
  EXPECT_EQ(CreateError(bounds, {{{0, 0, 1, 2}, one, {}}}, regions), "cells: no cell holds x 1 to 2, z 0 to 2");
  EXPECT_EQ(CreateError(bounds, {{{0, 0, 2, 1}, one, {}}}, regions), "cells: no cell holds x 0 to 2, z 1 to 2");
  EXPECT_EQ(CreateError(bounds, {{{0, 0, 1, 2}, one, {}}, {{1.5, 0, 2, 2}, one, {}}}, regions),
            "cells: no cell holds x 1 to 1.5, z 0 to 2");
  EXPECT_EQ(CreateError(bounds, {{{0, 0, 1.5, 2}, one, {}}, {{1, 0, 2, 2}, one, {}}}, regions),
            "cells[1].area: overlaps cells[0] in x 1 to 1.5, z 0 to 2");
  EXPECT_EQ(CreateError(bounds, {{bounds, one, {}}, {{0.5, 0.5, 1, 1}, one, {}}}, regions),
            "cells[1].area: overlaps cells[0] in x 0.5 to 1, z 0.5 to 1");
  EXPECT_EQ(CreateError(bounds, {{bounds, one, {}}, {bounds, one, {}}}, regions),
            "cells[1].area: overlaps cells[0] in x 0 to 2, z 0 to 2");
  EXPECT_THAT(CreateError(bounds, {{{0, 0, 3, 2}, one, {}}}, regions),
              HasSubstr("cells[0].area: x 0 to 3, z 0 to 2 is"));
  // One ulp of overlap or of hole is enough.
  const double past = std::nextafter(1.0, 2.0);
  EXPECT_THAT(CreateError(bounds, {{{0, 0, past, 2}, one, {}}, {{1, 0, 2, 2}, one, {}}}, regions),
              HasSubstr("overlaps"));
  EXPECT_THAT(CreateError(bounds, {{{0, 0, 1, 2}, one, {}}, {{past, 0, 2, 2}, one, {}}}, regions),
              HasSubstr("no cell holds"));
}

TEST(PartitionMapTest, NamesTheFieldThatIsWrong) {
  const RegionId one(1), two(2);
  const Rect all{0, 0, 2, 2};
  EXPECT_THAT(CreateError({0, 0, kInf, 1}, {{all, one, {}}}, {{one, {}}}), HasSubstr("bounds: must be finite"));
  EXPECT_THAT(CreateError(all, {{{0, 0, kNan, 2}, one, {}}}, {{one, {}}}), HasSubstr("cells[0].area: must be finite"));
  EXPECT_EQ(CreateError(all, {{all, two, {}}}, {{one, {}}}), "cells[0].owner: there is no region 2");
  EXPECT_EQ(CreateError(all, {{all, one, {}}}, {{one, two}}), "regions[0].standby: there is no region 2");
  EXPECT_EQ(CreateError(all, {{all, one, {}}}, {{one, one}}), "regions[0].standby: region 1 is its own standby");
  EXPECT_EQ(CreateError(all, {{all, one, {}}}, {{two, {}}, {one, {}}, {two, {}}}),
            "regions[2].id: 2 is also that of regions[0]");
  EXPECT_EQ(CreateError(all, {{all, one, {}}}, {{one, {}}, {RegionId(), {}}}), "regions[1].id: must not be 0");
  EXPECT_THAT(CreateError(all, std::vector<Cell>(kMaxCells + 1, {all, one, {}}), {{one, {}}}),
              HasSubstr("cells: at most 4096, got 4097"));
}

TEST(PartitionIoTest, KeepsTheWholeMap) {
  std::mt19937 random(4);
  for (const PartitionMap& map : {Grid(1), Grid(7), RandomTree(40, 13, random)}) {
    const auto back = FromProto(ToProto(map));
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(*back, map);
  }
}

TEST(PartitionIoTest, TrustsNothing) {
  EXPECT_EQ(FromProto(v1::PartitionMap()).status().message(), "version: must not be 0");
  v1::PartitionMap map = ToProto(Grid(4));
  map.mutable_cells(2)->set_owner(77);
  EXPECT_EQ(FromProto(map).status().message(), "cells[2].owner: there is no region 77");
  map.mutable_cells(2)->clear_area();
  EXPECT_THAT(std::string(FromProto(map).status().message()),
              HasSubstr("cells[2].area: must be finite and have an area"));
}

TEST(PartitionIoTest, TermsComeBackAndAPaceThatNoWorldHasIsRefused) {
  const PartitionMap map = Grid(4).With({.paused = true, .ticks_per_second = 2.5, .game = 3});
  EXPECT_EQ(*FromProto(ToProto(map)), map);
  EXPECT_FALSE(ToProto(Grid(4)).has_terms()) << "those of a world that nobody has changed take no bytes";
  v1::PartitionMap message = ToProto(map);
  for (const double pace : {-1.0, 0.5, 241.0, std::numeric_limits<double>::quiet_NaN()}) {
    message.mutable_terms()->set_ticks_per_second(pace);
    EXPECT_EQ(FromProto(message).status().code(), absl::StatusCode::kInvalidArgument) << pace;
  }
}

}  // namespace
}  // namespace tessera
