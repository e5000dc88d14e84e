// Arguments of the C interface that make no sense: they are refused by name, and nothing is written.
#include <gtest/gtest.h>

#include <cstddef>
#include <thread>

#include "client_sdk/c_api/c_api_fixture.h"
#include "client_sdk/include/tessera/connect.h"

namespace tessera::client {
namespace {

// A program built against an older header: its structs are shorter, and what lies behind them is not touched.
TEST_F(CApiTest, KeepsWithinTheCallersStruct) {
  Play();
  ShowTwo();
  constexpr std::size_t kOld = offsetof(tessera_body, linear_velocity);
  struct Guarded {
    unsigned char body[kOld];
    unsigned char behind = 0xaa;
  } guarded[3];
  EXPECT_EQ(tessera_bodies(client, now, reinterpret_cast<tessera_body*>(guarded), kOld, 0), 2u);
  std::vector<unsigned char> raw(kOld * 2 + 8, 0xaa);
  EXPECT_EQ(tessera_bodies(client, now, reinterpret_cast<tessera_body*>(raw.data()), kOld, 2), 2u);
  EXPECT_TRUE(std::all_of(raw.begin() + 2 * kOld, raw.end(), [](unsigned char c) { return c == 0xaa; }));
  tessera_stats stats = TESSERA_STATS;
  stats.size = offsetof(tessera_stats, bytes_out);
  stats.bytes_out = 12345;
  EXPECT_EQ(tessera_get_stats(client, &stats), TESSERA_OK);
  EXPECT_GT(stats.bytes_in, 0u);
  EXPECT_EQ(stats.bytes_out, 12345u);
  EXPECT_EQ(stats.size, offsetof(tessera_stats, bytes_out));
}

TEST_F(CApiTest, ASpawnThatMakesNoSenseIsRefusedByItsField) {
  Play();
  tessera_spawn spawn = TESSERA_SPAWN;
  const auto refused = [&](const void* command, std::size_t size) {
    EXPECT_EQ(tessera_predict_spawn(client, &spawn, command, size, nullptr), TESSERA_INVALID_ARGUMENT);
    return std::string(tessera_last_error());
  };
  EXPECT_EQ(refused("x", 1), "prefab: is NULL");
  spawn.prefab = "ball";
  EXPECT_EQ(refused(nullptr, 1), "command: is NULL");
  spawn.flags = 2;
  EXPECT_EQ(refused("x", 1), "flags: more than there are");
}

// Sizes that nobody can have meant are refused by name, and nothing is written.
TEST_F(CApiTest, RefusesSizesThatWereNotSet) {
  Play();
  ShowTwo();
  const auto refuses = [](tessera_code code, const std::string& argument) {
    EXPECT_EQ(code, TESSERA_INVALID_ARGUMENT) << argument;
    EXPECT_EQ(std::string(tessera_last_error()).rfind(argument + ": has ", 0), 0u) << tessera_last_error();
  };
  for (const std::uint32_t size : {0u, 3u, 4u, 7u}) {
    tessera_property property = TESSERA_PROPERTY;
    property.size = size;
    property.integer = 77;
    refuses(tessera_get_property(client, 1, "health", &property), "property.size");
    EXPECT_EQ(property.integer, 77);
    tessera_body body = TESSERA_BODY;
    body.size = size;
    refuses(tessera_find_body(client, 1, &body), "body.size");
    tessera_clock clock = TESSERA_CLOCK;
    clock.size = size;
    refuses(tessera_get_clock(client, &clock), "clock.size");
    tessera_scene_info scene = TESSERA_SCENE_INFO;
    scene.size = size;
    refuses(tessera_get_scene(client, &scene), "scene.size");
    tessera_body_info info = TESSERA_BODY_INFO;
    info.size = size;
    refuses(tessera_scene_body(client, 0, &info), "info.size");
    refuses(tessera_body_of(client, 1, &info), "info.size");
    tessera_body_info whole = TESSERA_BODY_INFO;
    ASSERT_EQ(tessera_body_of(client, 1, &whole), TESSERA_OK);
    tessera_shape_info shape = TESSERA_SHAPE_INFO;
    shape.size = size;
    refuses(tessera_get_shape(whole.shape, &shape), "info.size");
    tessera_visual_info visual = TESSERA_VISUAL_INFO;
    visual.size = size;
    refuses(tessera_shape_visual(whole.shape, 0, &visual), "info.size");
    tessera_stats stats = TESSERA_STATS;
    stats.size = size;
    refuses(tessera_get_stats(client, &stats), "stats.size");
    tessera_region_info region = TESSERA_REGION_INFO;
    region.size = size;
    refuses(tessera_region_stats(client, 0, &region), "info.size");
    tessera_network network = TESSERA_NETWORK;
    network.size = size;
    refuses(tessera_simulate_network(client, &network), "network.size");
    tessera_game_event_field field = TESSERA_GAME_EVENT_FIELD;
    field.size = size;
    refuses(tessera_game_event_field_at(client, 0, &field), "field.size");
    tessera_join_options options = TESSERA_JOIN_OPTIONS;
    options.size = size;
    tessera_client* none = nullptr;
    refuses(tessera_join(&options, &none), "options.size");
    EXPECT_EQ(none, nullptr);
    tessera_steering steering = TESSERA_STEERING;
    steering.size = size;
    EXPECT_EQ(tessera_steer(client, &steering), 0u);
    EXPECT_EQ(std::string(tessera_last_error()).rfind("steering.size: has ", 0), 0u);
    tessera_spawn spawn = TESSERA_SPAWN;
    spawn.size = size;
    refuses(tessera_predict_spawn(client, &spawn, "x", 1, nullptr), "spawn.size");
    std::size_t count = 0;
    tessera_instance_info listed = TESSERA_INSTANCE_INFO;
    refuses(tessera_list_instances(instance.address.c_str(), 1000, &listed, size, 1, &count), "stride");
    tessera_event event = TESSERA_EVENT;
    event.size = size;
    EXPECT_EQ(tessera_next_event(client, &event), 0);
    EXPECT_EQ(std::string(tessera_last_error()).rfind("event.size: has ", 0), 0u);
  }
  tessera_event event = TESSERA_EVENT;
  EXPECT_EQ(tessera_next_event(client, &event), 1) << "what was refused has taken nothing away";
  tessera_body bodies[2] = {TESSERA_BODY, TESSERA_BODY};
  EXPECT_EQ(tessera_bodies(client, now, bodies, 8, 2), 0u);
  EXPECT_STREQ(tessera_last_error(), "stride: has 8 bytes, at least 40; the TESSERA_... initialisers set it");
  EXPECT_EQ(bodies[0].id, 0u);
}

TEST(CApi, RefusesWhatMakesNoSense) {
  EXPECT_EQ(tessera_join(nullptr, nullptr), TESSERA_INVALID_ARGUMENT);
  tessera_client* client = nullptr;
  tessera_join_options options = TESSERA_JOIN_OPTIONS;
  EXPECT_EQ(tessera_join(&options, &client), TESSERA_INVALID_ARGUMENT);
  EXPECT_STREQ(tessera_last_error(), "options.instance_id: is NULL");
  options.returning_size = TESSERA_MAX_TOKEN + 1;
  options.control_address = "unix:/nowhere/control.sock";
  options.instance_id = "plaza-1";
  EXPECT_EQ(tessera_join(&options, &client), TESSERA_INVALID_ARGUMENT);
  options.returning_size = 1;
  EXPECT_EQ(tessera_join(&options, &client), TESSERA_INVALID_ARGUMENT);
  EXPECT_STREQ(tessera_last_error(), "options.returning: is NULL");
  options.returning_size = 0;
  options.deadline_ms = 500;
  EXPECT_EQ(tessera_join(&options, &client), TESSERA_UNAVAILABLE);
  EXPECT_EQ(client, nullptr);
  EXPECT_EQ(tessera_poll(nullptr, 0), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_bodies(nullptr, 0, nullptr, 0, 0), 0u);
  EXPECT_EQ(tessera_move(nullptr, nullptr, nullptr), 0u);
  EXPECT_EQ(tessera_steer(nullptr, nullptr), 0u);
  EXPECT_STREQ(tessera_last_error(), "client or steering: is NULL");
  EXPECT_EQ(tessera_predict_spawn(nullptr, nullptr, nullptr, 0, nullptr), TESSERA_INVALID_ARGUMENT);
  EXPECT_STREQ(tessera_last_error(), "client or spawn: is NULL");
  EXPECT_EQ(tessera_get_state(nullptr), TESSERA_ENDED);
  tessera_close(nullptr);
}

TEST(CApi, ErrorsAreEachThreadsOwn) {
  tessera_poll(nullptr, 0);
  std::thread([] { EXPECT_STREQ(tessera_last_error(), ""); }).join();
  EXPECT_STREQ(tessera_last_error(), "client: is NULL");
}

}  // namespace
}  // namespace tessera::client
