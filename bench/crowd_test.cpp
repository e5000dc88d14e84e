#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "bench/crowd_world.h"

namespace tessera::bench {
namespace {

constexpr CrowdPlan kPlan{40, 200, 20, {30, 0, 30}};

TEST(CrowdWorldTest, EverybodyIsThereAndNobodyGetsMoreThanItsBudget) {
  const auto scene = std::make_shared<const Scene>(CrowdScene(kPlan));
  CrowdWorld world(scene, kPlan.players, *MakeGridMap(scene->ground(), 4), {}, false);
  for (int tick = 0; tick < 120; ++tick) world.Tick();
  world.Forget();
  for (int tick = 0; tick < 60; ++tick) world.Tick();
  std::size_t bodies = 0;
  for (std::size_t region = 0; region < world.size(); ++region) bodies += world.BodiesOf(region);
  EXPECT_EQ(bodies, kPlan.players + kPlan.bodies);
  std::uint64_t near = 0, came = 0;
  for (std::size_t client = 0; client < kPlan.players; ++client) {
    ASSERT_TRUE(world.places()[client].has_value()) << client;
    const Vec3d way = *world.places()[client] - kPlan.centre;
    EXPECT_LT(std::hypot(way.x, way.z), 2 * kPlan.radius_m) << "it mills about with the others";
    EXPECT_GT(world.clients()[client].bytes, 0U);
    EXPECT_LT(static_cast<double>(world.clients()[client].bytes), 1.1 * world.view().bytes_per_s);
    near += world.clients()[client].near;
    came += world.clients()[client].near_came;
  }
  EXPECT_GT(near, 100U) << "one client in twenty looks about itself";
  EXPECT_GT(static_cast<double>(came), 0.95 * static_cast<double>(near));
}

TEST(CrowdWorldTest, ABalancedMapDealsTheCrowdOut) {
  const Scene scene = CrowdScene(kPlan);
  const PartitionMap even = *MakeGridMap(scene.ground(), 4), balanced = BalancedCrowdMap(scene, 4);
  const auto most_of = [&](const PartitionMap& map) {
    std::map<RegionId, int> counts;
    for (const BodyDef& body : scene.bodies) {
      if (body.motion == Motion::kDynamic) ++counts[map.OwnerOf(body.initial.position)];
    }
    int most = 0;
    for (const auto& [region, count] : counts) most = std::max(most, count);
    return most;
  };
  EXPECT_GT(most_of(even), 150) << "the spot is within one of four";
  EXPECT_LT(most_of(balanced), 65) << "of two hundred";
}

}  // namespace
}  // namespace tessera::bench
