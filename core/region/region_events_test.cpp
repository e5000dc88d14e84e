// Events whose turn has not come, because the game is always late, while their bodies change regions, regions die and
// worlds are saved: the game hears of each exactly once.
#include <gmock/gmock.h>

#include <map>
#include <string>
#include <tuple>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/log.h"
#include "core/region/region.h"
#include "core/region/region_state.h"
#include "core/region/standby_copy.h"
#include "core/region/testing/carry_on.h"
#include "core/region/testing/regions_in_step.h"
#include "core/region/testing/small_world.h"
#include "core/world/partition_change.h"
#include "game_sdk/api/api.h"

namespace tessera::region::waiting_events {
namespace {

using game::GameCalls;
using game::GameHost;
using game::GameValue;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;
using ::testing::IsEmpty;

constexpr std::uint64_t kBalls = 4;  // the first bodies
constexpr BodyId kGate{kBalls + 1};  // a trigger that they pass in region 1
constexpr std::uint64_t kBusyUntil = 30, kEnd = 45;

// Callback, whom it was called for, and the other body.
using Told = std::tuple<std::uint32_t, std::uint64_t, std::uint64_t>;

// Balls fly one behind the other through a gate in region 1, and over the border into region 2. An effect pushes them
// while they are in the gate. Until tick kBusyUntil the world's on_tick uses up all of each tick's work.
class WaitingEventsTest : public RegionsInStep {
 protected:
  void Begin(std::uint32_t regions) {
    std::vector<Vec3d> places;
    for (std::uint64_t i = 0; i < kBalls; ++i) places.push_back({-2.2, 0, -6 + 3 * static_cast<double>(i)});
    places.push_back({-1.4, 0, 0});
    Scene scene = Balls(places);
    scene.kinds = {"", "ball", "gate"};
    for (BodyDef& def : scene.bodies) {
      def.may_sleep = false;
      def.kind = 1;
      def.initial.linear_velocity = {9, 0, 0};
    }
    BodyDef& gate = scene.bodies.back();
    gate.shape = std::make_shared<const Shape>(Shape{BoxShape{{0.2, 2, 9}}});
    gate.motion = Motion::kStatic;
    gate.trigger = true;
    gate.kind = 2;
    gate.initial.linear_velocity = {};
    scene_ = std::make_shared<const Scene>(std::move(scene));
    map_ = std::make_unique<PartitionMap>(*MakeGridMap(scene_->ground(), regions));
    told.clear();
    Script();
    module_ = game.module();
    regions_.clear();
    for (const MapRegion& entry : map_->regions()) regions_[entry.id] = Make(entry.id, 1, nullptr);
    for (auto& [id, region] : regions_) Send(region->Start(), id);
  }
  void Script() {
    game.On(game::kOnTick, "", [](GameCalls& calls, Arguments) {
      EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
      const auto tick = static_cast<std::uint64_t>(calls.result().as.whole);
      if (tick == 1 && !Explode(calls)) ADD_FAILURE() << calls.error();
      if (tick < kBusyUntil) calls.Charge(150'000);
      return true;
    });
    const auto note = [this](std::uint32_t callback, const char* kind) {
      game.On(callback, kind, [this, callback](GameCalls&, Arguments arguments) {
        const bool blast = callback == game::kOnBodyBlast;
        ++told[Told(callback, arguments[0].as.id, blast ? 0 : arguments[1].as.id)];
        return true;
      });
    };
    note(game::kOnBodyBlast, "ball");
    note(game::kOnBodyEntered, "gate");
    note(game::kOnBodyLeft, "gate");
  }
  // Made in all regions that run the callback: an effect has another number in each, so each ball is pushed once by it.
  static bool Explode(GameCalls& calls) {
    const GameValue place{Vec3d{-2, 0, 0}}, impulse{0.001}, radius{9.0};
    const tessera_game_field fields[] = {{"at", 2, game::ToInterface(place)},
                                         {"impulse", 7, game::ToInterface(impulse)},
                                         {"radius", 6, game::ToInterface(radius)}};
    tessera_game_value table{};
    table.type = TESSERA_GAME_FIELDS;
    table.count = 3;
    table.as.fields = fields;
    return calls.CallRaw(game::kWorldExplode, {&table, 1});
  }
  std::unique_ptr<Region> Make(RegionId self, std::uint64_t life, std::shared_ptr<const RegionState> initial) {
    game::GameSettings settings;
    settings.instructions_per_callback = 200'000;
    auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_, settings);
    EXPECT_TRUE(host.ok()) << host.status();
    Config config{self, Incarnation(10 * self.value() + life), scene_, *map_, {}, std::move(initial)};
    config.game = *std::move(host);
    return std::make_unique<Region>(std::move(config));
  }
  Region& at(std::uint32_t id) { return *regions_.at(RegionId(id)); }
  // `blasts`: how many effects reached each ball.
  void ExpectEachOnce(const char* when, std::uint64_t about, int blasts) {
    for (std::uint64_t ball = 1; ball <= kBalls; ++ball) {
      EXPECT_EQ(told[Told(game::kOnBodyEntered, kGate.value(), ball)], 1) << when << about << ", ball " << ball;
      EXPECT_EQ(told[Told(game::kOnBodyLeft, kGate.value(), ball)], 1) << when << about << ", ball " << ball;
      EXPECT_EQ(told[Told(game::kOnBodyBlast, ball, 0)], blasts) << when << about << ", ball " << ball;
    }
  }

  ScriptedGame game;
  std::map<Told, int> told;

 private:
  std::shared_ptr<const Scene> scene_;
  std::unique_ptr<PartitionMap> map_;
  tessera_game_module module_{};
};

TEST_F(WaitingEventsTest, AreToldOnceWhereTheirBodiesHaveGone) {
  Begin(1);
  StepTo(kEnd);
  ExpectEachOnce("in one region, ", 1, 1);
  Begin(2);
  StepTo(kBusyUntil - 1);
  EXPECT_THAT(told, IsEmpty());
  ASSERT_TRUE(at(1).owned().empty()) << "all have crossed before the game had time for any";
  StepTo(kEnd);
  ExpectEachOnce("over a border, regions ", 2, 2);
}

// Region 1 dies in each of the ticks about the handover, with a standby that is up to two ticks behind.
TEST_F(WaitingEventsTest, AreToldOnceWhenTheGranterDies) {
  for (std::uint64_t dies = 8; dies <= 24; ++dies) {
    for (std::uint64_t behind = 0; behind <= 2; ++behind) {
      Begin(2);
      at(1).SetStandby(true);
      StandbyCopy copy(kOne, at(1).catalog());
      while (at(1).tick().value() < dies) {
        ASSERT_NO_FATAL_FAILURE(Step());
        if (at(1).tick().value() + behind <= dies) {
          ASSERT_TRUE(copy.Receive(logs[kOne]).ok());
        }
      }
      const auto resolution = CarryOn(at(2), kOne, copy);
      ASSERT_TRUE(resolution.ok()) << resolution.status();
      regions_.erase(kOne);
      StepTo(kEnd + 5);
      ASSERT_EQ(at(2).owned().size(), kBalls);
      ExpectEachOnce(behind == 0 ? "nothing behind, dead at " : "behind, dead at ", dies, 2);
    }
  }
}

// Both regions are saved at one tick and go on as one, and as two.
TEST_F(WaitingEventsTest, AreToldOnceAfterTheWorldWasSaved) {
  for (std::uint64_t saved = 8; saved <= 24; ++saved) {
    Begin(2);
    StepTo(saved);
    std::vector<RegionState> states;
    for (auto& [id, region] : regions_) {
      const auto state = DecodeState(region->SaveState(), region->catalog());
      ASSERT_TRUE(state.ok()) << state.status();
      states.push_back(*state);
    }
    const auto merged = MergeStates(states);
    ASSERT_TRUE(merged.ok()) << merged.status();
    const auto initial = std::make_shared<const RegionState>(*merged);
    regions_[kOne] = Make(kOne, 2, initial);
    regions_[kTwo] = Make(kTwo, 2, initial);
    for (auto& [id, region] : regions_) Send(region->Start(), id);
    StepTo(kEnd + 5);
    ExpectEachOnce("saved at ", saved, 2);
  }
}

}  // namespace
}  // namespace tessera::region::waiting_events
