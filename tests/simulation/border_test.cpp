// What crosses, meets or rests on a border behaves as in one world.
#include <gmock/gmock.h>

#include "tests/simulation/cluster.h"
#include "tests/simulation/scene_builder.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 20;

ClusterOptions Exact() {
  ClusterOptions options;
  options.settings.shared_origin = true;
  return options;
}

Cluster Make(const SceneBuilder& builder, std::uint32_t regions, const ClusterOptions& options = Exact()) {
  const std::shared_ptr<const Scene> scene = builder.Build();
  return Cluster(scene, *MakeGridMap(scene->ground(), regions), options);
}

TEST(BorderTest, ABallCrossesWithItsVelocityToTheBit) {
  SceneBuilder builder(kHalf);
  BodyDef& ball = builder.Add(Ball(0.5), {-5, 1, 3}, {6.1F, 0.2F, -0.3F});
  ball.initial.angular_velocity = {1, 2, 3};
  Cluster one = Make(builder, 1);
  Cluster two = Make(builder, 2);
  for (std::uint64_t t = 1; t <= 120; ++t) {
    one.RunTo(Tick(t));
    two.RunTo(Tick(t));
    ASSERT_EQ(one.StateOf(BodyId(1)), two.StateOf(BodyId(1))) << "tick " << t;
  }
  EXPECT_EQ(two.totals().handovers, 1U);
  EXPECT_EQ(two.OwnerOf(BodyId(1)), RegionId(2));
  EXPECT_THAT(two.problems(), IsEmpty());
}

}  // namespace
}  // namespace tessera::simulation
