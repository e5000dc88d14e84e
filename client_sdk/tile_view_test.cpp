#include "client_sdk/tile_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

namespace tessera::client {
namespace {

struct TileViewTest : testing::Test {
  TileViewTest() {
    scene.bounds = {{0, 0, 0}, {1000, 100, 2000}};
    scene.view.radius_m = 300;
  }

  Scene scene;
  TileView view;
};

TEST_F(TileViewTest, LooksAboutTheOwnBodyAsFarAsTheSceneLetsItSee) {
  const std::vector<TileStore::Place> places = view.Places(scene, Vec3d(10, 0, 20), false, false);
  ASSERT_EQ(places.size(), 1u);
  EXPECT_EQ(places[0].at, Vec3d(10, 0, 20));
  EXPECT_EQ(places[0].radius_m, 300);
  EXPECT_TRUE(view.Places(scene, std::nullopt, false, false).empty());  // nobody knows where that is
  scene.view.radius_m = 0;
  EXPECT_TRUE(std::isinf(view.Places(scene, std::nullopt, false, false)[0].radius_m));
}

TEST_F(TileViewTest, PredictionNeedsItsGroundWhereverTheProgramLooks) {
  view.View(Vec3d(900, 0, 900), 50);
  const std::vector<TileStore::Place> places = view.Places(scene, Vec3d(10, 0, 20), false, true);
  ASSERT_EQ(places.size(), 2u);
  EXPECT_EQ(places[0].at, Vec3d(10, 0, 20));
  EXPECT_EQ(places[1].at, Vec3d(900, 0, 900));
  EXPECT_EQ(places[1].radius_m, 50);
}

TEST_F(TileViewTest, AViewerSeesAllFromTheMiddle) {
  const std::vector<TileStore::Place> places = view.Places(scene, std::nullopt, true, false);
  ASSERT_EQ(places.size(), 1u);
  EXPECT_EQ(places[0].at, Vec3d(500, 50, 1000));
  EXPECT_TRUE(std::isinf(places[0].radius_m));
}

}  // namespace
}  // namespace tessera::client
