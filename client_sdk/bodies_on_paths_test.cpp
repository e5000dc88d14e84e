#include "client_sdk/bodies_on_paths.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace tessera::client {
namespace {

TEST(BodiesOnPathsTest, StandAmongTheOthersWhereTheTimeSays) {
  auto path = std::make_shared<BodyPath>();
  path->points = {{.time_s = 0, .pose = {{0, 0, 0}, {}}}, {.time_s = 10, .pose = {{20, 0, 0}, {}}}};
  path->repeat = PathRepeat::kOnce;
  auto scene = std::make_shared<Scene>();
  for (const std::uint32_t id : {1u, 2u, 3u}) {
    scene->bodies.emplace_back();
    scene->bodies.back().id = BodyId(id);
    if (id == 2) scene->bodies.back().path = path;
  }
  const BodiesOnPaths bodies(scene);
  std::vector<ShownBody> shown(2);
  shown[0].id = BodyId(1);
  shown[1].id = BodyId(3);
  bodies.AddTo(shown, 15);
  ASSERT_EQ(shown.size(), 3u);
  EXPECT_EQ(shown[0].id, BodyId(1));
  EXPECT_EQ(shown[1].id, BodyId(2));
  EXPECT_EQ(shown[2].id, BodyId(3));
  EXPECT_NEAR(shown[1].pose.position.x, 20, 1e-9);  // it has come to its end
}

TEST(BodiesOnPathsTest, NoSceneHasNone) {
  std::vector<ShownBody> shown(1);
  BodiesOnPaths().AddTo(shown, 5);
  EXPECT_EQ(shown.size(), 1u);
}

}  // namespace
}  // namespace tessera::client
