// GameHostTest: a host with a ScriptedGame in a FakeGameWorld.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/scripted_game.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

using Arguments = ScriptedGame::Arguments;

inline constexpr std::uint16_t kCrate = 1, kBallKind = 2;

class GameHostTest : public ::testing::Test {
 protected:
  void Load(GameSettings settings = {}) {
    module_ = game.module();
    auto loaded = GameHost::Load(module_, {"game.lua", "fine"}, world.shared_scene(), settings, 5);
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    host = *std::move(loaded);
  }
  void Run(std::vector<GameEvent> events = {}) { host->Run(++tick, events, world); }
  GameEvent Contact(std::uint64_t self, std::uint64_t other) {
    if (world.Find(BodyId(other)) == nullptr) world.Add(other, 0, false);
    return {kOnBodyContact, BodyId(self), BodyId(other)};
  }
  std::vector<std::string> Lines() {
    std::vector<std::string> lines;
    for (const GameLine& line : host->TakeLines()) lines.push_back((line.error ? "error: " : "") + line.text);
    return lines;
  }

  FakeGameWorld world;
  ScriptedGame game;
  std::unique_ptr<GameHost> host;
  Tick tick;

 private:
  tessera_game_module module_{};
};

}  // namespace tessera::game
