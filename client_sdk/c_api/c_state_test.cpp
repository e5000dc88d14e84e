// The C interface gives a game more than bodies: properties, figures of regions, movements.
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client_sdk/c_api/c_api_fixture.h"
#include "client_sdk/include/tessera/connect.hpp"
#include "client_sdk/testing/fake_instance.h"
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

}  // namespace
}  // namespace tessera::client
