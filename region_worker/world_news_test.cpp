// Clients are sent the properties of the world that they may see, once a connection and whenever they change.
#include "region_worker/world_news.h"

#include <gmock/gmock.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/world/byte_view.h"
#include "game_sdk/api/api.h"

namespace tessera::worker {
namespace {

using game::GameCalls;

std::shared_ptr<const Scene> CountingWorld() {
  auto scene = std::make_shared<Scene>();
  scene->bounds = {{-50, -50, -50}, {50, 50, 50}};
  scene->kinds = {""};
  scene->instance_properties = {{"goals", std::int64_t{0}}, {"secret", std::int64_t{0}, Visibility::kServers}};
  return scene;
}

class WorldNewsTest : public ::testing::Test {
 protected:
  WorldNewsTest() {
    game_.On(game::kOnTick, "", [this](GameCalls& calls, game::ScriptedGame::Arguments) {
      for (const auto& [name, value] : std::exchange(next_, {})) {
        EXPECT_TRUE(calls.Call(game::kWorldSet, {name, value})) << calls.error();
      }
      return true;
    });
    module_ = game_.module();
    region::Config config{RegionId(1), Incarnation(1), scene_, *MakeGridMap(scene_->ground(), 1), {}};
    config.game = *game::GameHost::Load(module_, {"game.lua", "fine"}, scene_);
    region_.emplace(std::move(config));
    region_->Start();
    region_->Step();
  }
  // In the next tick.
  void Set(std::vector<std::pair<std::string, std::int64_t>> values) {
    next_ = std::move(values);
    region_->Step();
  }
  // The value that a connection is sent; nothing if it is sent no news.
  std::optional<std::int64_t> News(std::optional<WorldVersion>& sent, const char* name = "goals") {
    const std::optional<v1::RegionControl> message = WorldNewsFor(*region_, sent);
    if (!message) return std::nullopt;
    const auto set = PropertySet::Decode(AsBytes(message->world_news().properties()), scene_->instance_properties);
    EXPECT_TRUE(set.ok()) << set.status();
    return std::get<std::int64_t>(*ValueOf(scene_->instance_properties, {}, *set, name));
  }

  const std::shared_ptr<const Scene> scene_ = CountingWorld();
  game::ScriptedGame game_;
  tessera_game_module module_{};
  std::optional<region::Region> region_;
  std::vector<std::pair<std::string, std::int64_t>> next_;
  std::optional<WorldVersion> sent_;
};

TEST_F(WorldNewsTest, AConnectionIsSentWhatIsNewToIt) {
  EXPECT_EQ(News(sent_), 0) << "the first word";
  region_->Step();
  EXPECT_EQ(News(sent_), std::nullopt);
  Set({{"goals", 3}});
  EXPECT_EQ(News(sent_), 3);
  EXPECT_EQ(News(sent_), std::nullopt);
  std::optional<WorldVersion> another;
  EXPECT_EQ(News(another), 3);
  for (int i = 0; i < 200; ++i) {
    region_->Step();
    ASSERT_EQ(News(sent_), std::nullopt) << "it does not change by being told again to the neighbours";
  }
}

TEST_F(WorldNewsTest, AChangeIsToldWhenTheStandbyHasIt) {
  (void)News(sent_);
  region_->SetStandby(true);
  region_->Step();
  region_->LogAcknowledged(region_->tick());
  Set({{"goals", 3}});
  for (int i = 0; i < 10; ++i) region_->Step();
  EXPECT_EQ(News(sent_), std::nullopt);
  region_->LogAcknowledged(region_->tick());
  EXPECT_EQ(News(sent_), 3);
}

TEST_F(WorldNewsTest, WhatIsForServersStaysHere) {
  Set({{"goals", 1}, {"secret", 9}});
  EXPECT_EQ(News(sent_, "secret"), 0);
  const auto told = region_->world_properties();
  ASSERT_TRUE(told.has_value());
  const auto all = PropertySet::Decode(told->bytes, scene_->instance_properties);
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(*ValueOf(scene_->instance_properties, {}, *all, "secret"), PropertyValue(std::int64_t{9}))
      << "an operator's";
}

TEST_F(WorldNewsTest, AnOperatorsChangeIsMadeOnceAndTheGameSeesIt) {
  (void)News(sent_);
  ASSERT_TRUE(region_->OwnsWorld());
  ASSERT_TRUE(region_->SetProperty(kInstanceBody, "goals", std::int64_t{7}, 1).ok());
  region_->Step();
  EXPECT_EQ(News(sent_), 7);
  std::int64_t seen = -1;
  region_->InspectGame([&](const tessera_game_host& host, tessera_game_call* call) {
    GameCalls calls(host, call);
    if (calls.Call(game::kWorldGet, {std::string("goals")})) seen = calls.result().as.whole;
  });
  EXPECT_EQ(seen, 7);
  Set({{"goals", 8}});
  ASSERT_TRUE(region_->SetProperty(kInstanceBody, "goals", std::int64_t{7}, 1).ok()) << "an order that is repeated";
  region_->Step();
  EXPECT_EQ(News(sent_), 8);
  EXPECT_EQ(region_->SetProperty(kInstanceBody, "goal", std::int64_t{7}, 2).message(), "no property \"goal\"");
  EXPECT_EQ(region_->SetProperty(kInstanceBody, "goals", true, 2).code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace tessera::worker
