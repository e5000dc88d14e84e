// Compounds against their parts.
#include <gmock/gmock.h>

#include <algorithm>

#include "core/physics/collide/testing/surfaces.h"

namespace tessera::physics {
namespace {

ShapePtr Made(BoxShape box) { return std::make_shared<const Shape>(Shape{box}); }

TEST(CompoundTest, TwoBoxesAreTwoBoxes) {
  const CompoundChild left{{{-1, 0, 0}, {}}, Made({{0.4, 0.5, 0.4}})};
  const CompoundChild right{{{1, 0.1, 0}, About({0, 1, 0}, 0.5)}, Made({{0.3, 0.6, 0.3}})};
  const auto both = GeometryOf(CompoundShape{{left, right}});
  const auto floor = GeometryOf(BoxShape{{4, 0.5, 4}});
  const Pose above{{0.1, 0.999, -0.2}, About({0, 1, 0}, 0.2)};
  for (const bool floor_first : {true, false}) {
    PartCaches parts;
    LocalManifolds found;
    const LocalPose pose = LocalOf(above);
    if (floor_first) {
      CollideCompound(*floor, *both, pose, 0.02f, parts, &found);
    } else {
      CollideCompound(*both, *floor, Reversed(pose), 0.02f, parts, &found);
    }
    ASSERT_EQ(found.size(), 2u);
    EXPECT_NE(found[0].key, found[1].key);
    for (std::size_t i = 0; i < 2; ++i) {
      const CompoundChild& child = i == 0 ? left : right;
      const auto part = MakeGeometry(*child.shape, {});
      const Pose place{above.position + Rotate(above.orientation, child.pose.position),
                       above.orientation * child.pose.orientation};
      ConvexCache cache;
      LocalManifold alone;
      CollideConvex(*floor, *part, LocalOf(place), 0.02f, cache, &alone);
      const LocalManifold m = floor_first ? found[i] : Reversed(found[i], Reversed(pose));
      ASSERT_EQ(m.count, alone.count);
      EXPECT_EQ(m.count, 4);
      EXPECT_LT(Length(m.normal - alone.normal), 1e-5f);
      for (int k = 0; k < m.count; ++k) {
        const auto at = static_cast<std::size_t>(k);
        float nearest = 1;
        for (const LocalPoint& p : alone.points) nearest = std::min(nearest, Length(p.on_a - m.points[at].on_a));
        EXPECT_LT(nearest, 1e-4f);
        EXPECT_NEAR(m.points[at].separation_m, alone.points[at].separation_m, 1e-5);
      }
    }
  }
}

TEST(CompoundTest, PairsOfPartsHaveKeysOfTheirOwn) {
  const auto bars =
      GeometryOf(CompoundShape{{{{{0, 0, -1}, {}}, Made({{2, 0.2, 0.2}})}, {{{0, 0, 1}, {}}, Made({{2, 0.2, 0.2}})}}});
  const LocalPose across = LocalOf({{0, 0.399, 0}, About({0, 1, 0}, std::acos(0.0))});
  PartCaches parts;
  LocalManifolds found;
  CollideCompound(*bars, *bars, across, 0.02f, parts, &found);
  ASSERT_EQ(found.size(), 4u);
  std::vector<std::uint32_t> keys;
  for (const LocalManifold& m : found) {
    keys.push_back(m.key);
    EXPECT_NEAR(m.normal.y, 1, 1e-6f);
    EXPECT_EQ(m.count, 4);
    EXPECT_NEAR(m.points[0].separation_m, -0.001, 1e-5);
  }
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(std::unique(keys.begin(), keys.end()), keys.end());
  EXPECT_TRUE(std::is_sorted(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.key < b.key; }));
  // A second search with what the first remembered finds the same.
  LocalManifolds again;
  CollideCompound(*bars, *bars, across, 0.02f, parts, &again);
  ASSERT_EQ(again.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(again[i].key, found[i].key);
}

TEST(CompoundTest, StandsOnAMeshWithEveryFoot) {
  std::vector<CompoundChild> feet;
  feet.reserve(4);
  for (int i = 0; i < 4; ++i) feet.push_back({{{i & 1 ? 1. : -1., 0, i & 2 ? 1. : -1.}, {}}, Made({{0.1, 0.5, 0.1}})});
  const auto table = GeometryOf(CompoundShape{feet});
  for (const auto& ground : FlatGrounds()) {
    const LocalManifolds found = On(*table, *ground, {{0.17, 0.499, 0.05}, About({0, 1, 0}, 0.1)});
    ASSERT_EQ(found.size(), 4u);
    for (const LocalManifold& m : found) {
      EXPECT_EQ(m.count, 4);
      EXPECT_NEAR(m.normal.y, -1, 1e-6f);
      EXPECT_NEAR(m.points[0].separation_m, -0.001, 1e-5);
    }
  }
}

}  // namespace
}  // namespace tessera::physics
