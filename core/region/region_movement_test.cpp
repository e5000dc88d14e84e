// Bodies that a game's own function moves: in one region and over borders, from a saved state and after a death.
#include <gmock/gmock.h>

#include <cstring>
#include <limits>
#include <map>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/log.h"
#include "core/region/region.h"
#include "core/region/region_state.h"
#include "core/region/standby_copy.h"
#include "core/region/testing/carry_on.h"
#include "core/region/testing/small_world.h"
#include "game_sdk/api/api.h"

namespace tessera::region::movement {
namespace {

using game::GameHost;
using game::ScriptedGame;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr PlayerNumber kAda{1}, kBob{2};
constexpr BodyId kOwn = PlayerBodyId(kAda);

// It carries this along: how often it was called, and the input before.
struct Memory {
  std::uint32_t calls = 0;
  float before = 0;
};

// Pushes along x, the harder the longer it has been called. Button 0 makes it fail, button 1 gives what is no number.
int Hover(const tessera_movement_tick* tick, void* state, tessera_movement_push* push) {
  Memory memory;
  std::memcpy(&memory, state, sizeof memory);
  if ((tick->buttons & 1) != 0) return 4;
  push->force[0] = static_cast<double>(tick->move[1]) * 4 + 0.01 * memory.calls + static_cast<double>(memory.before);
  if ((tick->buttons & 2) != 0) push->force[1] = std::numeric_limits<double>::quiet_NaN();
  ++memory.calls;
  memory.before = tick->move[1];
  std::memcpy(state, &memory, sizeof memory);
  return 0;
}

constexpr tessera_movement kHover = {sizeof kHover, TESSERA_MOVEMENT_ABI, "hover", 2, sizeof(Memory), "craft", Hover,
                                     nullptr};

// Regions side by side from x = -10 to 10, and a player at x = -2 whose body the movement moves.
class RegionMovementTest : public ::testing::Test {
 protected:
  void Begin(std::uint32_t regions, const std::string& kind = "craft", double x = -2) {
    Scene scene = Balls({});
    scene.kinds = {"", "craft"};
    AllowPlayers(scene);
    scene.player->spawn_points = {{x, 0, 0}, {-5, 0, 5}};
    scene.player->body.kind = kind == "craft" ? 1 : 0;
    scene_ = std::make_shared<const Scene>(std::move(scene));
    module_ = game_.module();
    module_.movement = &table;
    map_ = *MakeGridMap(scene_->ground(), regions);
    regions_.clear();
    inputs_ = 0;
    for (const MapRegion& entry : map_->regions()) regions_[entry.id] = Make(entry.id, nullptr);
    for (const auto& [id, region] : regions_) Send(id, region->Start());
    regions_.begin()->second->SpawnPlayer(kAda, "ada");
    Step();
  }
  std::unique_ptr<Region> Make(RegionId self, std::shared_ptr<const RegionState> initial) {
    auto host = GameHost::Load(module_, {"craft", ""}, scene_);
    EXPECT_TRUE(host.ok()) << host.status();
    Config config{self, Incarnation(self.value()), scene_, *map_, {}, std::move(initial)};
    config.game = *std::move(host);
    return std::make_unique<Region>(std::move(config));
  }
  void Send(RegionId from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      const absl::Status status = regions_.at(frame.to)->Receive(from, frame.bytes);
      ASSERT_TRUE(status.ok()) << status;
    }
  }
  void Step() {
    std::map<RegionId, StepResult> results;
    for (const auto& [id, region] : regions_) {
      ASSERT_TRUE(region->CanStep());
      results[id] = region->Step();
    }
    for (const auto& [id, result] : results) Send(id, result.frames);
    logs_.clear();
    for (auto& [id, result] : results) logs_[id] = std::move(result.log);
    for (const auto& [id, region] : regions_) {
      for (const game::GameLine& line : region->game()->TakeLines()) lines_.push_back(line.text);
    }
  }
  void Ask(float forward, std::uint32_t buttons = 0) {
    PlayerInput input;
    input.number = ++inputs_;
    input.player = kAda;
    input.body = kOwn;
    input.move = {0, forward};
    input.buttons = buttons;
    const absl::Status status = Owner().QueueInput(input);
    ASSERT_TRUE(status.ok()) << status;
  }
  void Drive(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      ASSERT_NO_FATAL_FAILURE(Ask(1));
      ASSERT_NO_FATAL_FAILURE(Step());
    }
  }
  Region& Owner() {
    for (const auto& [id, region] : regions_) {
      if (region->Owns(kOwn)) return *region;
    }
    return *regions_.begin()->second;
  }
  // The state that the next step begins with, as the player's client is told.
  MovementState Told() {
    const auto moved = Owner().MovementOf(kAda);
    EXPECT_TRUE(moved.has_value());
    return moved ? moved->state : MovementState();
  }
  Memory Remembered() {
    Memory memory;
    std::memcpy(&memory, Told().bytes.data(), sizeof memory);
    return memory;
  }

  ScriptedGame game_;
  tessera_movement table = kHover;
  tessera_game_module module_{};
  std::shared_ptr<const Scene> scene_;
  std::optional<PartitionMap> map_;
  std::map<RegionId, std::unique_ptr<Region>> regions_;
  std::map<RegionId, Bytes> logs_;
  std::vector<std::string> lines_;

 private:
  std::uint32_t inputs_ = 0;
};

TEST_F(RegionMovementTest, ItsStateGoesAlongOverABorderToTheBit) {
  std::vector<std::pair<BodyState, MovementState>> alone, split;
  for (auto* run : {&alone, &split}) {
    ASSERT_NO_FATAL_FAILURE(Begin(run == &alone ? 1 : 2));
    for (int tick = 0; tick < 150; ++tick) {
      ASSERT_NO_FATAL_FAILURE(Drive(1));
      run->emplace_back(Owner().world().StateOf(kOwn), Told());
    }
  }
  ASSERT_TRUE(regions_.at(kTwo)->Owns(kOwn)) << "it has crossed";
  EXPECT_EQ(Remembered().calls, 150U);
  for (std::size_t tick = 0; tick < alone.size(); ++tick) {
    ASSERT_EQ(split[tick].second, alone[tick].second) << tick;
    ASSERT_EQ(split[tick].first, alone[tick].first) << tick;
  }
  EXPECT_THAT(lines_, IsEmpty());
}

TEST_F(RegionMovementTest, ItsStateOutlivesADeathAndASavedState) {
  ASSERT_NO_FATAL_FAILURE(Begin(2));
  Drive(150);
  ASSERT_TRUE(regions_.at(kTwo)->Owns(kOwn));
  Region& two = *regions_.at(kTwo);
  two.SetStandby(true);
  StandbyCopy copy(kTwo, two.catalog());
  Drive(1);
  ASSERT_TRUE(copy.Receive(logs_.at(kTwo)).ok());
  Drive(1);
  ASSERT_TRUE(copy.Receive(logs_.at(kTwo)).ok());
  const Memory last = Remembered();

  const auto saved = DecodeState(two.SaveState(), two.catalog());
  ASSERT_TRUE(saved.ok()) << saved.status();
  const PlayerControl& control = saved->controls.at(kAda);
  EXPECT_EQ(control.state, Told());
  EXPECT_NE(control.next_state, control.state);

  Region& one = *regions_.at(kOne);
  ASSERT_TRUE(CarryOn(one, kTwo, copy, {kOwn}).ok());
  ASSERT_TRUE(one.Owns(kOwn));
  regions_.erase(kTwo);
  EXPECT_EQ(Remembered().calls, last.calls);
  EXPECT_EQ(Remembered().before, 1);
  one.Step();
  EXPECT_EQ(Remembered().calls, last.calls + 1);
}

// The world goes on, the log has one line with the player and the module, and what is asked next counts again.
TEST_F(RegionMovementTest, AFailureIsContainedAndNamedOnce) {
  ASSERT_NO_FATAL_FAILURE(Begin(1));
  Drive(3);
  lines_.clear();
  const Memory before = Remembered();
  for (int i = 0; i < 20; ++i) {
    ASSERT_NO_FATAL_FAILURE(Ask(1, i < 10 ? 1 : 2));
    ASSERT_NO_FATAL_FAILURE(Step());
  }
  EXPECT_THAT(lines_, ElementsAre("craft: player 1 is not moved: movement hover: returned 4"));
  EXPECT_EQ(Remembered().calls, before.calls + 1) << "the last of the three acted after them";
  const float speed = Owner().world().StateOf(kOwn).linear_velocity.x;
  ASSERT_NO_FATAL_FAILURE(Step());
  EXPECT_EQ(Owner().world().StateOf(kOwn).linear_velocity.x, speed) << "nothing pushes it";
  EXPECT_EQ(Owner().game()->statistics().errors, 20U + 1) << "the last input goes on for a while";
  Drive(5);
  EXPECT_GT(Owner().world().StateOf(kOwn).linear_velocity.x, speed);
  EXPECT_EQ(lines_.size(), 1U);
}

TEST_F(RegionMovementTest, BodiesOfAnotherKindAreMovedAsTheSceneSays) {
  ASSERT_NO_FATAL_FAILURE(Begin(1, "none"));
  Drive(30);
  EXPECT_EQ(Owner().MovementOf(kAda), std::nullopt);
  EXPECT_EQ(Owner().world().StateOf(kOwn).linear_velocity, Vec3f()) << "no force was asked for";
}

TEST_F(RegionMovementTest, OneThatCannotBeIsRefusedByName) {
  ASSERT_NO_FATAL_FAILURE(Begin(1));
  const auto why = [&] { return std::string(GameHost::Load(module_, {"craft", ""}, scene_).status().message()); };
  table.abi = 9;
  EXPECT_EQ(why(), "craft: movement: is made for version 9 of the interface, and this is version 1");
  table = kHover;
  table.kind = "boat";
  EXPECT_EQ(why(), "craft: movement hover: kind: the scene has no kind \"boat\"");
  // A module that was built before there were movements: what stands behind its table is nobody's business.
  module_.size = offsetof(tessera_game_module, movement);
  const auto old = GameHost::Load(module_, {"craft", ""}, scene_);
  ASSERT_TRUE(old.ok()) << old.status();
  EXPECT_EQ((*old)->movement(), nullptr);
}

}  // namespace
}  // namespace tessera::region::movement
