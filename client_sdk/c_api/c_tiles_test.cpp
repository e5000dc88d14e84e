// The C interface: a large level in tiles.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string>

#include "client_sdk/include/tessera/tessera.h"
#include "client_sdk/include/tessera/tessera.hpp"
#include "client_sdk/testing/fake_instance.h"

namespace tessera::client {
namespace {

using ::testing::HasSubstr;

// A height field of six tenths of a square kilometre, and boxes on it, of which players see 40 m.
std::string BoxesOnAField() {
  constexpr int kSamples = 769;
  std::string text =
      "view { radius: 40 } bodies { id: 500 motion: MOTION_STATIC shape { height_field { columns: 769 rows: 769 "
      "spacing: 1 heights: [0";
  for (int i = 1; i < kSamples * kSamples; ++i) text += i % 3 == 0 ? ", 0.5" : ", 0";
  text += "] } } }";
  for (int i = 0; i < 100; ++i) {
    text += "bodies { id: " + std::to_string(600 + i) + " name: \"box-" + std::to_string(i) +
            "\" motion: MOTION_STATIC shape { box { half_extents { x: 1 y: 2 z: 1 } } } pose { position { x: " +
            std::to_string(i % 10 * 10 - 45) + " y: 2 z: " + std::to_string(i / 10 * 10 - 45) + " } } }";
  }
  return text;
}

struct CTilesTest : testing::Test {
  void SetUp() override {
    const std::vector<std::uint8_t> grant = instance.Grant();
    tessera_grant_options options = TESSERA_GRANT_OPTIONS;
    options.bind_address = "127.0.0.1";
    options.flags = 0;
    ASSERT_EQ(tessera_join_grant(grant.data(), grant.size(), &options, &client), TESSERA_OK) << tessera_last_error();
    ASSERT_TRUE(Until([&] { return tessera_get_state(client) == TESSERA_WAITING; }));
    ASSERT_EQ(tessera_get_scene(client, &scene), TESSERA_OK);
  }
  void TearDown() override { tessera_close(client); }
  bool Until(const std::function<bool()>& done) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!done() && std::chrono::steady_clock::now() < limit) {
      instance.Service();
      now += 1'000'000;
      EXPECT_EQ(tessera_poll(client, now), TESSERA_OK) << tessera_last_error();
      tessera_event event = TESSERA_EVENT;
      while (tessera_next_event(client, &event) != 0) {
        if (event.kind == TESSERA_EVENT_TILE_CAME) {
          EXPECT_TRUE(here.insert(event.tile).second);
        }
        if (event.kind == TESSERA_EVENT_TILE_GONE) {
          EXPECT_EQ(here.erase(event.tile), 1u);
        }
      }
    }
    return done();
  }
  tessera_tile_info InfoOf(std::uint32_t tile) const {
    tessera_tile_info info = TESSERA_TILE_INFO;
    EXPECT_EQ(tessera_get_tile(client, tile, &info), TESSERA_OK) << tessera_last_error();
    return info;
  }

  FakeInstance instance{1, BoxesOnAField()};
  tessera_client* client = nullptr;
  tessera_scene_info scene = TESSERA_SCENE_INFO;
  std::set<std::uint32_t> here;  // as events say
  std::int64_t now = std::int64_t{3600} * 1'000'000'000;
};

TEST_F(CTilesTest, TilesComeWithTheirBodiesAndGoAndAreTheLevelTogether) {
  EXPECT_EQ(scene.body_count, 1u);
  ASSERT_GT(scene.tile_count, 4u);
  EXPECT_GE(scene.tile_edge, 8);
  ASSERT_EQ(tessera_view_tiles(client, nullptr, INFINITY), TESSERA_OK);
  ASSERT_TRUE(Until([&] { return here.size() == scene.tile_count; }));
  std::set<std::uint64_t> boxes;
  std::size_t cells = 0;
  for (std::uint32_t tile = 0; tile < scene.tile_count; ++tile) {
    const tessera_tile_info info = InfoOf(tile);
    EXPECT_EQ(info.here, 1);
    EXPECT_GT(info.bytes, 0u);
    for (std::size_t i = 0; i < info.body_count; ++i) {
      tessera_body_info body = TESSERA_BODY_INFO;
      ASSERT_EQ(tessera_tile_body(client, tile, i, &body), TESSERA_OK) << tessera_last_error();
      EXPECT_EQ(body.dynamic, 0);
      for (const int axis : {0, 2}) {
        EXPECT_GE(body.position[axis], info.bounds_min[axis]);
        EXPECT_LE(body.position[axis], info.bounds_max[axis]);
      }
      tessera_shape_info shape = TESSERA_SHAPE_INFO;
      ASSERT_EQ(tessera_get_shape(body.shape, &shape), TESSERA_OK);
      if (shape.kind == TESSERA_SHAPE_BOX) {
        boxes.insert(body.id);
        EXPECT_EQ(body.name, "box-" + std::to_string(body.id - 600));
      } else {
        EXPECT_EQ(body.id, 500u);
        cells += std::size_t{shape.columns - 1} * (shape.rows - 1);
      }
    }
    tessera_body_info beyond = TESSERA_BODY_INFO;
    EXPECT_EQ(tessera_tile_body(client, tile, info.body_count, &beyond), TESSERA_INVALID_ARGUMENT);
  }
  EXPECT_EQ(boxes.size(), 100u);
  EXPECT_EQ(cells, 768u * 768u);
  tessera_body_info box = TESSERA_BODY_INFO;
  EXPECT_EQ(tessera_body_of(client, 600, &box), TESSERA_OK);
  tessera_stats stats = TESSERA_STATS;
  ASSERT_EQ(tessera_get_stats(client, &stats), TESSERA_OK);
  EXPECT_EQ(stats.tiles, scene.tile_count);
  EXPECT_GT(stats.tile_bytes, std::uint64_t{1} << 20);
  EXPECT_EQ(stats.tiles_damaged, 0u);
  // And what is far from a place goes.
  const double corner[3] = {370, 0, 370};
  ASSERT_EQ(tessera_view_tiles(client, corner, 10), TESSERA_OK);
  ASSERT_TRUE(Until([&] { return here.size() < scene.tile_count / 2; }));
  for (std::uint32_t tile = 0; tile < scene.tile_count; ++tile)
    EXPECT_EQ(InfoOf(tile).here, here.contains(tile) ? 1 : 0);
  EXPECT_EQ(tessera_body_of(client, 600, &box), TESSERA_NOT_FOUND);
}

TEST_F(CTilesTest, WhatIsDrawnOfATileIsThereUntilThePollAfterItsEnd) {
  ASSERT_EQ(tessera_view_tiles(client, nullptr, INFINITY), TESSERA_OK);
  ASSERT_TRUE(Until([&] { return here.size() == scene.tile_count; }));
  tessera_body_info body = TESSERA_BODY_INFO;
  ASSERT_EQ(tessera_tile_body(client, 0, 0, &body), TESSERA_OK);
  tessera_shape_info before = TESSERA_SHAPE_INFO, after = TESSERA_SHAPE_INFO;
  ASSERT_EQ(tessera_get_shape(body.shape, &before), TESSERA_OK);
  const std::vector<float> heights(before.vertices, before.vertices + before.vertex_count);
  const double far[3] = {900, 0, 900};
  ASSERT_EQ(tessera_view_tiles(client, far, 10), TESSERA_OK);
  ASSERT_TRUE(Until([&] { return here.empty(); }));
  ASSERT_EQ(tessera_get_shape(body.shape, &after), TESSERA_OK);
  EXPECT_EQ(after.vertices, before.vertices);
  EXPECT_EQ(std::vector<float>(after.vertices, after.vertices + after.vertex_count), heights);
  EXPECT_EQ(tessera_tile_body(client, 0, 0, &body), TESSERA_NOT_FOUND);
  EXPECT_THAT(tessera_last_error(), HasSubstr("tile: is not here"));
}

TEST_F(CTilesTest, AWrongArgumentIsNamed) {
  tessera_tile_info info = TESSERA_TILE_INFO;
  tessera_body_info body = TESSERA_BODY_INFO;
  const auto beyond = static_cast<std::uint32_t>(scene.tile_count);
  EXPECT_EQ(tessera_get_tile(client, beyond, &info), TESSERA_INVALID_ARGUMENT);
  EXPECT_THAT(tessera_last_error(), HasSubstr("tile: beyond the scene's tiles"));
  EXPECT_EQ(tessera_tile_body(client, beyond, 0, &body), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_get_tile(nullptr, 0, &info), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_get_tile(client, 0, nullptr), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_tile_body(client, 0, 0, nullptr), TESSERA_INVALID_ARGUMENT);
  info.size = 3;
  EXPECT_EQ(tessera_get_tile(client, 0, &info), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_view_tiles(nullptr, nullptr, 1), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_view_tiles(client, nullptr, -1), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_view_tiles(client, nullptr, std::nan("")), TESSERA_INVALID_ARGUMENT);
  const double nowhere[3] = {0, std::nan(""), 0};
  EXPECT_EQ(tessera_view_tiles(client, nowhere, 1), TESSERA_INVALID_ARGUMENT);
  EXPECT_THAT(tessera_last_error(), HasSubstr("centre: is not finite"));
}

}  // namespace
}  // namespace tessera::client
