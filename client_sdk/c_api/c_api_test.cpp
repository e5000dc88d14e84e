// The C interface against a fake instance.
#include <gtest/gtest.h>

#include <unistd.h>

#include <cstddef>
#include <cstdio>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <thread>

#include "client_sdk/c_api/c_api_fixture.h"
#include "client_sdk/include/tessera/connect.hpp"
#include "client_sdk/testing/fake_instance.h"

namespace tessera::client {
namespace {

TEST_F(CApiTest, ListsInstances) {
  for (int i = 1; i <= 5; ++i) {
    v1::Instance& listed = instance.list.instances.emplace_back();
    listed.set_id("inst-" + std::to_string(i));
    listed.set_scene_name("plaza");
    listed.set_state(v1::INSTANCE_STATE_WAITING_FOR_PLAYERS);
    listed.set_regions(4);
    listed.set_players(3);
    listed.set_expected_players(4);
    for (const char* name : {"ada", "", "gone"}) {
      v1::Player& player = *listed.add_player_list();
      player.set_number(static_cast<std::uint32_t>(listed.player_list_size()));
      player.set_name(name);
      player.set_left(std::string(name) == "gone");
    }
  }
  instance.list.instances.back().set_scene_name(std::string(500, 'x'));
  std::vector<InstanceInfo> listed;
  ASSERT_EQ(ListInstances(instance.address, listed).text, "");
  ASSERT_EQ(listed.size(), 5u);
  EXPECT_STREQ(listed[2].id, "inst-3");
  EXPECT_STREQ(listed[2].scene, "plaza");
  EXPECT_EQ(listed[2].state, TESSERA_INSTANCE_WAITING);
  EXPECT_EQ(listed[2].regions, 4u);
  EXPECT_EQ(listed[2].players, 3u);
  EXPECT_EQ(listed[2].expected_players, 4u);
  ASSERT_EQ(listed[2].name_count, 2u);
  EXPECT_STREQ(listed[2].player_names[0], "ada");
  EXPECT_STREQ(listed[2].player_names[1], "player 2");
  EXPECT_EQ(std::string(listed[4].scene), std::string(63, 'x'));

  // Fewer than there are; into a struct that is shorter; nobody there; nonsense.
  constexpr std::size_t kOld = offsetof(tessera_instance_info, scene);
  std::vector<unsigned char> raw(kOld + 8, 0xaa);
  std::size_t count = 0;
  ASSERT_EQ(tessera_list_instances(instance.address.c_str(), 3000, reinterpret_cast<tessera_instance_info*>(raw.data()),
                                   kOld, 1, &count),
            TESSERA_OK);
  EXPECT_EQ(count, 5u);
  EXPECT_TRUE(std::all_of(raw.begin() + kOld, raw.end(), [](unsigned char c) { return c == 0xaa; }));
  EXPECT_EQ(ListInstances("unix:/nowhere/control.sock", listed).code, TESSERA_UNAVAILABLE);
  EXPECT_NE(std::string(tessera_last_error()).find("control plane at unix:/nowhere/control.sock"), std::string::npos);
  EXPECT_EQ(tessera_list_instances(nullptr, 10, nullptr, 0, 0, nullptr), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_list_instances("unix:/nowhere/control.sock", 10, nullptr, 0, 1, &count), TESSERA_INVALID_ARGUMENT);
}

TEST_F(CApiTest, JoinsPlaysSeesAndLeaves) {
  Play();
  ShowTwo();
  tessera_body bodies[2] = {TESSERA_BODY, TESSERA_BODY};
  ASSERT_EQ(tessera_bodies(client, now, bodies, sizeof(tessera_body), 2), 2u);
  EXPECT_EQ(bodies[0].id, 1u);
  EXPECT_EQ(bodies[0].region, 1u);
  EXPECT_NEAR(bodies[0].position[2], 3, 1e-3);
  EXPECT_NEAR(bodies[0].linear_velocity[0], 4, 0.02);
  EXPECT_EQ(bodies[1].flags & TESSERA_BODY_OWN, std::uint32_t{TESSERA_BODY_OWN});
  EXPECT_EQ(tessera_find_body(client, 77, bodies), TESSERA_NOT_FOUND);

  int appeared = 0;
  tessera_event event = TESSERA_EVENT;
  while (tessera_next_event(client, &event) != 0) appeared += event.kind == TESSERA_EVENT_APPEARED ? 1 : 0;
  EXPECT_EQ(appeared, 2);

  EXPECT_EQ(tessera_leave(client, 2000), TESSERA_OK);
  EXPECT_EQ(tessera_get_state(client), TESSERA_ENDED);
}

TEST_F(CApiTest, WhatOverlapsAtJoiningHasNotJustEntered) {
  Play();
  ShowTwo();
  const BodyId own(tessera_own_body(client));
  tessera_event event = TESSERA_EVENT;
  bool began = false;
  const auto begins = [&] {
    while (!began && tessera_next_event(client, &event) != 0) began = event.kind == TESSERA_EVENT_CONTACT_BEGAN;
    return began;
  };
  instance.regions[0]->TellPairs(Tick(2), {{BodyId(1), own, false, true}}, true);
  ASSERT_TRUE(Until(begins));
  EXPECT_EQ(event.flags, std::uint32_t{TESSERA_EVENT_SINCE_BEFORE});
  began = false;
  instance.regions[0]->TellPairs(Tick(3), {{BodyId(1), own, false, false}});
  instance.regions[0]->TellPairs(Tick(4), {{BodyId(1), own, false, true}});
  ASSERT_TRUE(Until(begins));
  EXPECT_EQ(event.flags, 0u);
}

TEST(CApi, SaysWhichBodyAPlayerHas) {
  EXPECT_EQ(tessera_player_body(1), (std::uint64_t{1} << 32) + 1);
  EXPECT_EQ(tessera_player_body(0), 0u);
  for (const std::uint32_t player : {1u, 1024u, 0xffffffffu}) {
    EXPECT_EQ(tessera_player_of_body(tessera_player_body(player)), player);
  }
  for (const std::uint64_t other :
       {std::uint64_t{0}, std::uint64_t{7}, std::uint64_t{1} << 32, std::uint64_t{1} << 40}) {
    EXPECT_EQ(tessera_player_of_body(other), 0u) << other;
  }
}

TEST_F(CApiTest, AnotherProcessComesBackAsTheSamePlayer) {
  Play();
  EXPECT_EQ(tessera_return_token(nullptr, nullptr, 0), 0u);
  const std::size_t size = tessera_return_token(client, nullptr, 0);
  ASSERT_GT(size, 0u);
  ASSERT_LE(size, std::size_t{TESSERA_MAX_TOKEN});
  std::vector<std::uint8_t> token(size, 0xaa);
  EXPECT_EQ(tessera_return_token(client, token.data(), size - 1), size);
  EXPECT_EQ(token, std::vector<std::uint8_t>(size, 0xaa));  // it did not fit
  EXPECT_EQ(tessera_return_token(client, token.data(), token.size()), size);
  const std::uint64_t own = tessera_own_body(client);

  const auto join = [&](std::vector<std::uint8_t> returning, ::tessera::Client& again) {
    ::tessera::Options options;
    options.control_address = instance.address;
    options.instance_id = FakeInstance::kId;
    options.player_name = "ada";
    options.bind_address = "127.0.0.1";
    options.returning = std::move(returning);
    return again.Join(options);
  };
  ::tessera::Client same, other, stranger;
  EXPECT_EQ(join(token, same).code, TESSERA_OK);
  EXPECT_EQ(same.own_body(), own);
  EXPECT_FALSE(same.ReturnToken().empty());
  EXPECT_EQ(join({}, other).code, TESSERA_OK);
  EXPECT_NE(other.own_body(), own);
  token.back() ^= 1;
  EXPECT_EQ(join(token, stranger).code, TESSERA_UNAUTHENTICATED);
}

TEST_F(CApiTest, ATicketSaysWhoJoins) {
  tessera_join_options options = TESSERA_JOIN_OPTIONS;
  options.control_address = instance.address.c_str();
  options.instance_id = FakeInstance::kId;
  options.bind_address = "127.0.0.1";
  options.ticket = "forged";
  tessera_client* joined = nullptr;
  EXPECT_EQ(tessera_join(&options, &joined), TESSERA_UNAUTHENTICATED);
  EXPECT_NE(std::string(tessera_last_error()).find("ticket: is not signed"), std::string::npos);
  options.ticket = FakeInstance::kTicket;
  options.player_name = "ada";
  EXPECT_EQ(tessera_join(&options, &joined), TESSERA_INVALID_ARGUMENT);
  EXPECT_STREQ(tessera_last_error(), "player_name: the ticket says the name; leave it empty");
  options.player_name = nullptr;
  const std::uint8_t token[100] = {};
  options.returning = token;
  options.returning_size = sizeof token;
  EXPECT_EQ(tessera_join(&options, &joined), TESSERA_INVALID_ARGUMENT);
  EXPECT_STREQ(tessera_last_error(), "returning: the ticket says who comes back; leave it empty");
  EXPECT_EQ(joined, nullptr);
  ::tessera::Options cpp;
  cpp.control_address = instance.address;
  cpp.instance_id = FakeInstance::kId;
  cpp.bind_address = "127.0.0.1";
  cpp.ticket = FakeInstance::kTicket;
  ::tessera::Client good;
  EXPECT_EQ(good.Join(cpp).code, TESSERA_OK);
  // In a program that was built before there were tickets, the struct ends sooner.
  options = TESSERA_JOIN_OPTIONS;
  options.size = offsetof(tessera_join_options, ticket);
  options.control_address = instance.address.c_str();
  options.instance_id = FakeInstance::kId;
  options.bind_address = "127.0.0.1";
  options.ticket = "forged";
  EXPECT_EQ(tessera_join(&options, &joined), TESSERA_OK);
  tessera_close(joined);
}

// One token in two processes: the newer one plays on, the older one ends, once, and stays away.
TEST_F(CApiTest, WhoJoinsLaterAsThePlayerEndsTheOneBefore) {
  Play();
  std::vector<std::uint8_t> token(TESSERA_MAX_TOKEN);
  token.resize(tessera_return_token(client, token.data(), token.size()));
  tessera_join_options options = TESSERA_JOIN_OPTIONS;
  options.control_address = instance.address.c_str();
  options.instance_id = FakeInstance::kId;
  options.bind_address = "127.0.0.1";
  options.returning = token.data();
  options.returning_size = static_cast<std::uint32_t>(token.size());
  tessera_client* newer = nullptr;
  ASSERT_EQ(tessera_join(&options, &newer), TESSERA_OK) << tessera_last_error();
  EXPECT_EQ(tessera_own_body(newer), tessera_own_body(client));

  int ended = 0, lost = 0;
  tessera_code code = TESSERA_OK;
  std::string detail;
  const auto poll = [&] {
    instance.Service();
    code = tessera_poll(client, now);
    EXPECT_EQ(tessera_poll(newer, now), TESSERA_OK) << tessera_last_error();
    tessera_event event = TESSERA_EVENT;
    while (tessera_next_event(client, &event) != 0) {
      if (event.kind == TESSERA_EVENT_ENDED) ++ended, detail = event.detail;
      if (event.kind == TESSERA_EVENT_REGION_LOST) ++lost;
    }
    while (tessera_next_event(newer, &event) != 0) {
      if (event.kind == TESSERA_EVENT_REGION_LOST || event.kind == TESSERA_EVENT_ENDED) ++lost;
    }
  };
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  const auto settled = [&] { return ended > 0 && tessera_get_state(newer) == TESSERA_PLAYING; };
  while (!settled() && std::chrono::steady_clock::now() < limit) poll();
  for (int i = 0; i < 200; ++i, now += 100'000'000) poll();  // 20 s, in which it would dial again
  EXPECT_EQ(ended, 1);
  EXPECT_EQ(lost, 0);
  EXPECT_EQ(detail, "another process joined as this player");
  EXPECT_EQ(code, TESSERA_ALREADY_EXISTS);
  EXPECT_EQ(tessera_get_state(client), TESSERA_ENDED);
  EXPECT_EQ(tessera_get_state(newer), TESSERA_PLAYING);
  EXPECT_EQ(instance.regions[0]->clients(), 1u);
  char reason[64];
  EXPECT_EQ(tessera_disconnect_reason(client, reason, sizeof reason), detail.size());
  EXPECT_EQ(reason, detail);
  tessera_close(newer);
}

// All is lost from here on, so nothing more is seen; then it gets through again.
TEST_F(CApiTest, ABadNetworkCanBeHadForTheAsking) {
  Play();
  ShowTwo();
  tessera_network network = TESSERA_NETWORK;
  network.loss = 2;
  EXPECT_EQ(tessera_simulate_network(client, &network), TESSERA_INVALID_ARGUMENT);
  network.loss = 1;
  ASSERT_EQ(tessera_simulate_network(client, &network), TESSERA_OK);
  BodyState state;
  const std::vector<replication::BodyRecord> bodies = {{BodyId(1), Epoch(1), state}};
  instance.regions[0]->Snapshot(Tick(4), bodies);
  for (int i = 0; i < 200; ++i) {
    instance.Service();
    ASSERT_EQ(tessera_poll(client, now), TESSERA_OK);
  }
  EXPECT_EQ(tessera_tick(client), 2u);
  network = TESSERA_NETWORK;
  network.delay_ms = 150;
  network.jitter_ms = 40;
  ASSERT_EQ(tessera_simulate_network(client, &network), TESSERA_OK);
  tessera_stats stats = TESSERA_STATS;
  ASSERT_EQ(tessera_get_stats(client, &stats), TESSERA_OK);
  EXPECT_GE(stats.round_trip_s, 0.34) << "as the simulated network makes it";
  EXPECT_LT(stats.round_trip_s, 0.84);
  network = TESSERA_NETWORK;
  ASSERT_EQ(tessera_simulate_network(client, &network), TESSERA_OK);
  instance.regions[0]->Snapshot(Tick(6), bodies);
  EXPECT_TRUE(Until([&] { return tessera_tick(client) == 6; }));
}

TEST_F(CApiTest, RecordsAndPlays) {
  const std::string file = testing::TempDir() + "c_api_test_" + std::to_string(::getpid()) + ".tsr";
  EXPECT_EQ(tessera_record(client, nullptr, 0), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_record(client, "/no/such/folder/x.tsr", 0), TESSERA_UNAVAILABLE);
  ASSERT_EQ(tessera_record(client, file.c_str(), 0), TESSERA_OK) << tessera_last_error();
  Play();
  now += 100'000'000;
  ShowTwo();
  ASSERT_EQ(tessera_stop_recording(client), TESSERA_OK);

  tessera_client* playing = nullptr;
  ASSERT_EQ(tessera_play(file.c_str(), &playing), TESSERA_OK) << tessera_last_error();
  EXPECT_EQ(tessera_own_body(playing), tessera_own_body(client));
  EXPECT_EQ(tessera_return_token(playing, nullptr, 0), 0u);
  EXPECT_EQ(tessera_poll(playing, now), TESSERA_OK);
  EXPECT_EQ(tessera_poll(playing, now + 1'000'000'000), TESSERA_OK);
  tessera_body body = TESSERA_BODY;
  ASSERT_EQ(tessera_find_body(playing, 1, &body), TESSERA_OK);
  EXPECT_NEAR(body.position[2], 3, 1e-3);
  EXPECT_NEAR(body.linear_velocity[0], 4, 0.02);
  int appeared = 0, started = 0;
  tessera_event event = TESSERA_EVENT;
  while (tessera_next_event(playing, &event) != 0) {
    appeared += event.kind == TESSERA_EVENT_APPEARED ? 1 : 0;
    started += event.kind == TESSERA_EVENT_STARTED ? 1 : 0;
  }
  EXPECT_EQ(appeared, 2);
  EXPECT_EQ(started, 1);
  EXPECT_EQ(tessera_get_state(playing), TESSERA_ENDED);
  // From its end back to where both bodies are not yet, and to where they are.
  const double seconds = tessera_recording_seconds(playing);
  EXPECT_GT(seconds, 0);
  ASSERT_EQ(tessera_seek(playing, 0), TESSERA_OK) << tessera_last_error();
  EXPECT_EQ(tessera_poll(playing, now), TESSERA_OK);
  int vanished = 0;
  while (tessera_next_event(playing, &event) != 0) vanished += event.kind == TESSERA_EVENT_VANISHED ? 1 : 0;
  EXPECT_EQ(vanished, 2);
  EXPECT_EQ(tessera_find_body(playing, 1, &body), TESSERA_NOT_FOUND);
  ASSERT_EQ(tessera_seek(playing, seconds + 5), TESSERA_OK) << "beyond its end is its end";
  EXPECT_EQ(tessera_poll(playing, now), TESSERA_OK);
  EXPECT_EQ(tessera_find_body(playing, 1, &body), TESSERA_OK);
  EXPECT_EQ(tessera_get_state(playing), TESSERA_PLAYING);
  EXPECT_EQ(tessera_leave(playing, 1000), TESSERA_OK);
  tessera_close(playing);
  std::remove(file.c_str());
  EXPECT_EQ(tessera_play(file.c_str(), &playing), TESSERA_NOT_FOUND);
  EXPECT_EQ(tessera_recording_seconds(nullptr), 0);
  EXPECT_EQ(tessera_recording_seconds(client), 0);
  EXPECT_EQ(tessera_seek(client, 1), TESSERA_FAILED_PRECONDITION);
  EXPECT_EQ(tessera_seek(client, -1), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_seek(client, std::numeric_limits<double>::quiet_NaN()), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_seek(nullptr, 1), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(playing, nullptr);
}

TEST(CApiShapeTest, TellsTheMeshesThatAShapeIsDrawnWith) {
  Shape drawn{SphereShape{2}};
  drawn.visuals = {
      {.sha256 = std::string(64, 'a'), .mesh = 3, .pose = {{1, 2, 3}, {0, 0, 1, 0}}, .scale = {-1, 2, 0.5}},
      {.sha256 = std::string(64, 'b'), .mesh = 0, .pose = {}}};
  const auto* const handle = reinterpret_cast<const tessera_shape*>(&drawn);
  tessera_visual_info info = TESSERA_VISUAL_INFO;
  ASSERT_EQ(tessera_shape_visual(handle, 0, &info), TESSERA_OK);
  EXPECT_EQ(info.sha256, std::string(64, 'a'));
  EXPECT_EQ(info.mesh, 3u);
  EXPECT_EQ(info.position[2], 3);
  EXPECT_EQ(info.orientation[2], 1);
  EXPECT_EQ(info.scale[0], -1);
  ASSERT_EQ(tessera_shape_visual(handle, 1, &info), TESSERA_OK);
  EXPECT_EQ(info.scale[0], 1);
  EXPECT_EQ(tessera_shape_visual(handle, 2, &info), TESSERA_NOT_FOUND);
  EXPECT_EQ(tessera_shape_visual(nullptr, 0, &info), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_shape_visual(handle, 0, nullptr), TESSERA_INVALID_ARGUMENT);
}

TEST_F(CApiTest, TellsTheSceneAndItsShapes) {
  tessera_scene_info scene = TESSERA_SCENE_INFO;
  ASSERT_EQ(tessera_get_scene(client, &scene), TESSERA_OK);
  EXPECT_STREQ(scene.name, "plaza");
  EXPECT_EQ(scene.body_count, instance.scene->bodies.size());
  for (std::size_t i = 0; i < scene.body_count; ++i) {
    tessera_body_info info = TESSERA_BODY_INFO;
    ASSERT_EQ(tessera_scene_body(client, i, &info), TESSERA_OK);
    EXPECT_EQ(info.id, instance.scene->bodies[i].id.value());
    tessera_shape_info shape = TESSERA_SHAPE_INFO;
    ASSERT_EQ(tessera_get_shape(info.shape, &shape), TESSERA_OK);
    EXPECT_EQ(shape.kind, static_cast<int>(instance.scene->bodies[i].shape->form.index()));
  }
  tessera_body_info own = TESSERA_BODY_INFO;
  EXPECT_EQ(tessera_body_of(client, tessera_own_body(client), &own), TESSERA_OK);
  EXPECT_EQ(own.dynamic, 1);
  EXPECT_EQ(tessera_scene_body(client, scene.body_count, &own), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_body_of(client, 4'000'000'000u, &own), TESSERA_NOT_FOUND);
}

}  // namespace
}  // namespace tessera::client
