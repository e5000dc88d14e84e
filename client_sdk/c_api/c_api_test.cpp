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
#include "client_sdk/fake_instance.h"
#include "client_sdk/include/tessera/connect.hpp"
#include "core/replication/datagram.h"
#include "core/replication/movement_news.h"
#include "core/replication/region_figures.h"
#include "game_sdk/include/tessera/movement.h"

namespace tessera::client {
namespace {

// As the scene declares them, as it gives them to a body, and as they are changed.
TEST_F(CApiTest, ReadsPropertiesAndIsToldWhenTheyChange) {
  Play();
  ShowTwo();
  const auto read = [&](std::uint64_t body, const char* name) {
    tessera_property property = TESSERA_PROPERTY;
    EXPECT_EQ(tessera_get_property(client, body, name, &property), TESSERA_OK) << tessera_last_error();
    return property;
  };
  EXPECT_EQ(read(1, "health").type, TESSERA_PROPERTY_INT);
  EXPECT_EQ(read(1, "health").integer, 100);
  EXPECT_STREQ(read(1, "team").text, "red");
  EXPECT_STREQ(read(tessera_own_body(client), "team").text, "none");
  EXPECT_EQ(read(1, "home").type, TESSERA_PROPERTY_VECTOR);
  EXPECT_EQ(read(1, "home").vector[2], 3);
  EXPECT_EQ(read(1, "target").type, TESSERA_PROPERTY_BODY);
  EXPECT_EQ(read(1, "target").body, 0u);
  EXPECT_EQ(read(1, "secret").type, TESSERA_PROPERTY_BYTES);
  ASSERT_EQ(read(1, "secret").byte_count, 3u);
  EXPECT_EQ(read(1, "secret").bytes[2], 255);

  tessera_event event = TESSERA_EVENT;
  while (tessera_next_event(client, &event) != 0) {
  }
  PropertySet changed;
  ASSERT_TRUE(changed.Set(instance.scene->properties, "health", std::int64_t{-5}).ok());
  ASSERT_TRUE(changed.Set(instance.scene->properties, "team", std::string(63, 'x')).ok());
  const std::vector<replication::BodyRecord> bodies = {
      {BodyId(1), Epoch(1), {}, std::make_shared<const replication::Bytes>(changed.Encode())}};
  instance.regions[0]->Snapshot(Tick(4), bodies);
  ASSERT_TRUE(Until([&] { return tessera_tick(client) == 4; }));
  bool told = false;
  while (tessera_next_event(client, &event) != 0) {
    told = told || (event.kind == TESSERA_EVENT_PROPERTY_CHANGED && event.body == 1 && event.region == 1 &&
                    std::string(event.property) == "health");
  }
  EXPECT_TRUE(told);
  EXPECT_EQ(read(1, "health").integer, -5);
  EXPECT_EQ(read(1, "team").text, std::string(63, 'x'));

  tessera_property property = TESSERA_PROPERTY;
  EXPECT_EQ(tessera_get_property(client, 1, "mana", &property), TESSERA_NOT_FOUND);
  EXPECT_STREQ(tessera_last_error(), "name: the scene declares no such property");
  EXPECT_EQ(tessera_get_property(client, 77, "health", &property), TESSERA_NOT_FOUND);
  EXPECT_EQ(tessera_get_property(client, 1, nullptr, &property), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_get_property(nullptr, 1, "health", &property), TESSERA_INVALID_ARGUMENT);
}

TEST_F(CApiTest, ReadsPropertiesOfTheWorld) {
  Play();
  tessera_property property = TESSERA_PROPERTY;
  ASSERT_EQ(tessera_get_world_property(client, "phase", &property), TESSERA_OK) << tessera_last_error();
  EXPECT_EQ(property.type, TESSERA_PROPERTY_TEXT);
  EXPECT_STREQ(property.text, "waiting") << "the scene's";
  tessera_event event = TESSERA_EVENT;
  while (tessera_next_event(client, &event) != 0) {
  }
  PropertySet changed;
  ASSERT_TRUE(changed.Set(instance.scene->instance_properties, "goals", std::int64_t{7}).ok());
  instance.regions[0]->TellWorld(1, 3, changed.Encode());
  bool told = false;
  ASSERT_TRUE(Until([&] {
    while (tessera_next_event(client, &event) != 0) {
      told = told || (event.kind == TESSERA_EVENT_WORLD_PROPERTY_CHANGED && std::string(event.property) == "goals");
    }
    return told;
  }));
  ASSERT_EQ(tessera_get_world_property(client, "goals", &property), TESSERA_OK);
  EXPECT_EQ(property.integer, 7);
  EXPECT_EQ(tessera_get_world_property(client, "health", &property), TESSERA_NOT_FOUND) << "a body's";
  EXPECT_STREQ(tessera_last_error(), "name: the scene declares no such property of the world");
  EXPECT_EQ(tessera_get_world_property(client, nullptr, &property), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_get_world_property(nullptr, "goals", &property), TESSERA_INVALID_ARGUMENT);
  property.size = 4;
  EXPECT_EQ(tessera_get_world_property(client, "goals", &property), TESSERA_INVALID_ARGUMENT);
}

// A region's sums are given as they are, and what went on between two messages as a mean.
TEST_F(CApiTest, GivesWhatARegionSaysOfItself) {
  Play();
  tessera_region_info info = TESSERA_REGION_INFO;
  ASSERT_EQ(tessera_region_stats(client, 0, &info), TESSERA_OK) << tessera_last_error();
  EXPECT_EQ(info.region, 1u);
  EXPECT_EQ(info.connected, 1);
  EXPECT_EQ(info.reports, 0u);
  EXPECT_EQ(info.process_physical_bytes, 0u);

  replication::RegionFigures figures;
  figures.tick = Tick(60);
  figures.owned = 9, figures.ghosts = 2, figures.asleep = 1, figures.clients = 1;
  figures.step = {60, 60'000'000};
  figures.physics = {60, 30'000'000};
  figures.memory.process_physical_bytes = 5 << 20;
  figures.memory.host_physical_total_bytes = std::uint64_t{8} << 30;
  const auto send = [&](std::uint32_t reports) {
    instance.regions[0]->SendFigures(replication::EncodeRegionFigures(figures));
    return Until([&] { return tessera_region_stats(client, 0, &info) == TESSERA_OK && info.reports == reports; });
  };
  ASSERT_TRUE(send(1));
  EXPECT_EQ(info.tick, 60u);
  EXPECT_EQ(info.bodies, 9u);
  EXPECT_EQ(info.ghosts, 2u);
  EXPECT_EQ(info.asleep, 1u);
  EXPECT_EQ(info.process_physical_bytes, 5u << 20);
  EXPECT_EQ(info.host_physical_total_bytes, std::uint64_t{8} << 30);
  EXPECT_NEAR(info.step.recent, 1e-3, 1e-9);

  figures.step = {120, 180'000'000};
  ASSERT_TRUE(send(2));
  EXPECT_EQ(info.step.count, 120u);
  EXPECT_NEAR(info.step.total, 0.18, 1e-9);
  EXPECT_NEAR(info.step.recent, 2e-3, 1e-9);
  EXPECT_EQ(info.physics.recent, 0);  // none in that second

  // Overtaken, and malformed: neither changes anything, and the latter is counted.
  figures.step = {119, 1};
  instance.regions[0]->SendFigures(replication::EncodeRegionFigures(figures));
  const std::vector<std::uint8_t> cut = {static_cast<std::uint8_t>(replication::DatagramKind::kRegionFigures), 1, 5};
  instance.regions[0]->SendFigures(cut);
  tessera_stats stats = TESSERA_STATS;
  ASSERT_TRUE(Until([&] { return tessera_get_stats(client, &stats) == TESSERA_OK && stats.decode_errors == 1; }));
  ASSERT_EQ(tessera_region_stats(client, 0, &info), TESSERA_OK);
  EXPECT_EQ(info.reports, 2u);
  EXPECT_EQ(info.step.count, 120u);

  EXPECT_EQ(tessera_region_stats(client, 1, &info), TESSERA_NOT_FOUND);
  EXPECT_EQ(tessera_region_stats(client, 0, nullptr), TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(tessera_region_stats(nullptr, 0, &info), TESSERA_INVALID_ARGUMENT);
}

// The world moves the own body by a function of its game, in a version that this program does not have.
TEST_F(CApiTest, SaysWhichMovementOfTheGameIsNotHere) {
  Play();
  ShowTwo();
  tessera_movement movement = {sizeof movement,
                               TESSERA_MOVEMENT_ABI,
                               "glide",
                               1,
                               4,
                               nullptr,
                               [](const tessera_movement_tick*, void*, tessera_movement_push*) { return 0; },
                               nullptr};
  ASSERT_EQ(tessera_set_movement(client, &movement), TESSERA_OK) << tessera_last_error();
  replication::MovementNews news{.tick = Tick(2), .name = "glide", .state = {}};
  news.state.body = BodyId(tessera_own_body(client));
  news.state.version = 2;
  news.state.size = 4;
  std::vector<std::string> told;
  const auto send = [&] {
    news.tick = news.tick + 1;
    instance.regions[0]->SendFigures(replication::EncodeMovementNews(news));
  };
  const auto heard = [&](std::size_t count) {
    return Until([&] {
      tessera_event event = TESSERA_EVENT;
      while (tessera_next_event(client, &event) != 0) {
        if (event.kind != TESSERA_EVENT_MOVEMENT_MISSING) continue;
        EXPECT_EQ(event.body, tessera_own_body(client));
        told.push_back(event.detail);
      }
      return told.size() == count;
    });
  };
  send();
  send();
  ASSERT_TRUE(heard(1));
  EXPECT_EQ(told[0], "the world moves body " + std::to_string(tessera_own_body(client)) +
                         " by movement glide version 2 with 4 bytes of state; this program has glide version 1 with 4");
  // Another one is another word, and one that cannot be is refused.
  movement.version = 3;
  ASSERT_EQ(tessera_set_movement(client, &movement), TESSERA_OK);
  send();
  ASSERT_TRUE(heard(2)) << "once for each";
  movement.abi = 9;
  EXPECT_EQ(tessera_set_movement(client, &movement), TESSERA_INVALID_ARGUMENT);
  EXPECT_STREQ(tessera_last_error(), "movement: is made for version 9 of the interface, and this is version 1");
  movement.abi = TESSERA_MOVEMENT_ABI;
  movement.kind = "glider";
  EXPECT_EQ(tessera_set_movement(client, &movement), TESSERA_INVALID_ARGUMENT);
  EXPECT_STREQ(tessera_last_error(), "movement glide: kind: the scene has no kind \"glider\"");
  EXPECT_EQ(tessera_set_movement(client, nullptr), TESSERA_OK);
  EXPECT_EQ(tessera_set_movement(nullptr, nullptr), TESSERA_INVALID_ARGUMENT);
  // Malformed ones are counted, and change nothing.
  const std::vector<std::uint8_t> cut = {static_cast<std::uint8_t>(replication::DatagramKind::kMovement), 1, 5};
  instance.regions[0]->SendFigures(cut);
  tessera_stats stats = TESSERA_STATS;
  ASSERT_TRUE(Until([&] { return tessera_get_stats(client, &stats) == TESSERA_OK && stats.decode_errors == 1; }));
}

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
