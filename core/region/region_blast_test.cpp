// Area effects over borders: each body is pushed once, as it would be in one region, whatever becomes of links,
// handovers and regions.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/log.h"
#include "core/region/region.h"
#include "core/region/region_state.h"
#include "core/region/standby_copy.h"
#include "core/region/testing/carry_on.h"
#include "core/region/testing/small_world.h"
#include "core/world/partition_change.h"
#include "game_sdk/api/api.h"

namespace tessera::region::blasts {
namespace {

using game::GameCalls;
using game::GameHost;
using game::GameValue;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;
using ::testing::SizeIs;

constexpr double kRadius_m = 6, kImpulse_ns = 3;

struct Order {
  std::uint64_t tick = 3;
  RegionId in = kOne;
  Vec3d at;
};

class RegionBlastTest : public ::testing::Test {
 protected:
  void Begin(const std::vector<Vec3d>& places, std::uint32_t regions, std::vector<Order> orders, Vec3f velocity = {},
             bool sleeping = false) {
    Scene scene = Balls(places);
    scene.kinds = {"", "ball"};
    for (BodyDef& def : scene.bodies) {
      def.kind = 1;
      def.may_sleep = sleeping;
      def.initial.linear_velocity = velocity;
    }
    scene_ = std::make_shared<const Scene>(std::move(scene));
    map_ = std::make_unique<PartitionMap>(*MakeGridMap(scene_->ground(), regions));
    orders_ = std::move(orders);
    blown.clear();
    game.On(game::kOnTick, "", [this](GameCalls& calls, Arguments) {
      EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
      const auto tick = static_cast<std::uint64_t>(calls.result().as.whole);
      for (const Order& order : orders_) {
        const bool here = order.in == running_ || regions_.size() == 1;
        if (order.tick == tick && here && !Explode(calls, order.at)) ADD_FAILURE() << calls.error();
      }
      return true;
    });
    game.On(game::kOnBodyBlast, "ball", [this](GameCalls& calls, Arguments arguments) {
      EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
      blown[BodyId(arguments[0].as.id)].push_back(calls.result().as.whole);
      return true;
    });
    module_ = game.module();
    regions_.clear();
    for (const MapRegion& entry : map_->regions()) regions_[entry.id] = Make(entry.id, 1, nullptr);
    for (auto& [id, region] : regions_) Send(id, region->Start());
  }
  std::unique_ptr<Region> Make(RegionId self, std::uint64_t life, std::shared_ptr<const RegionState> initial) {
    auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_);
    EXPECT_TRUE(host.ok()) << host.status();
    Config config{self, Incarnation(10 * self.value() + life), scene_, *map_, {}, std::move(initial)};
    config.game = *std::move(host);
    return std::make_unique<Region>(std::move(config));
  }
  static bool Explode(GameCalls& calls, Vec3d at) {
    const GameValue place{at}, impulse{kImpulse_ns}, radius{kRadius_m};
    const tessera_game_field fields[] = {{"at", 2, game::ToInterface(place)},
                                         {"impulse", 7, game::ToInterface(impulse)},
                                         {"radius", 6, game::ToInterface(radius)}};
    tessera_game_value table{};
    table.type = TESSERA_GAME_FIELDS;
    table.count = 3;
    table.as.fields = fields;
    return calls.CallRaw(game::kWorldExplode, {&table, 1});
  }
  void Send(RegionId from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      if (lost) continue;
      const absl::Status status = regions_.at(frame.to)->Receive(from, frame.bytes);
      ASSERT_TRUE(status.ok()) << status;
    }
  }
  void Step() {
    std::map<RegionId, StepResult> results;
    for (auto& [id, region] : regions_) {
      ASSERT_TRUE(region->CanStep());
      running_ = id;
      results[id] = region->Step();
    }
    for (auto& [id, result] : results) {
      Send(id, result.frames);
      logs[id] = result.log;
    }
  }
  void StepTo(std::uint64_t tick) {
    while (at(1).tick().value() < tick) ASSERT_NO_FATAL_FAILURE(Step());
  }
  // Neither of two regions hears the other any more, and both notice.
  void Fail() {
    lost = true;
    at(1).TakeLinkDown(kTwo);
    at(2).TakeLinkDown(kOne);
  }
  Region& at(std::uint32_t id) { return *regions_.at(RegionId(id)); }
  std::map<BodyId, Vec3f> Velocities() const {
    std::map<BodyId, Vec3f> velocities;
    for (const auto& [id, region] : regions_) {
      for (const OwnedBody& body : region->owned()) velocities[body.def->id] = body.state.linear_velocity;
    }
    return velocities;
  }
  void ExpectEachBlownOnce(std::size_t bodies) {
    EXPECT_THAT(blown, SizeIs(bodies));
    for (const auto& [id, ticks] : blown) EXPECT_THAT(ticks, SizeIs(1)) << "body " << id.value();
  }

  ScriptedGame game;
  std::map<RegionId, std::unique_ptr<Region>> regions_;
  std::map<BodyId, std::vector<std::int64_t>> blown;  // when on_blast was called
  std::map<RegionId, Bytes> logs;
  bool lost = false;

 private:
  std::shared_ptr<const Scene> scene_;
  std::unique_ptr<PartitionMap> map_;
  tessera_game_module module_{};
  std::vector<Order> orders_;
  RegionId running_;
};

// Around the border's middle, and one that is too far away.
std::vector<Vec3d> Ring() {
  std::vector<Vec3d> places;
  for (int i = 0; i < 12; ++i) {
    const double angle = (i + 0.5) * std::numbers::pi / 6;
    places.push_back({4 * std::cos(angle), 0.1 * i, 4 * std::sin(angle)});
  }
  places.push_back({9, 0, 9});
  return places;
}

TEST_F(RegionBlastTest, ARingOverABorderGetsWhatItGetsInOneRegion) {
  Begin(Ring(), 1, {{3, kOne, {0.1, 0, 0.2}}});
  StepTo(12);
  const std::map<BodyId, Vec3f> alone = Velocities();
  EXPECT_THAT(blown, SizeIs(12));
  const auto ticks = blown;
  for (const RegionId maker : {kOne, kTwo}) {
    Begin(Ring(), 2, {{3, maker, {0.1, 0, 0.2}}});
    StepTo(12);
    EXPECT_EQ(Velocities(), alone) << "to the bit, made in region " << maker.value();
    EXPECT_EQ(blown, ticks);
  }
  EXPECT_EQ(alone.at(BodyId(13)), Vec3f());
  EXPECT_GT(Length(alone.at(BodyId(1))), 0.5F);
  EXPECT_EQ(ticks.at(BodyId(1)), std::vector<std::int64_t>{7}) << "four ticks after it was made";
}

// Bodies that cross the border in any of the ticks about it.
TEST_F(RegionBlastTest, WhoCrossesTheBorderMeanwhileIsPushedOnce) {
  std::vector<Vec3d> places;
  places.reserve(8);
  for (int i = 0; i < 8; ++i) places.push_back({-1.4 + 0.2 * i, 0, -9 + 2.4 * i});
  std::map<BodyId, Vec3f> alone;
  for (const std::uint32_t regions : {1U, 2U}) {
    Begin(places, regions, {{3, kOne, {-3, 0, 0}}, {5, kTwo, {3, 0, 0}}}, {6, 0, 0});
    StepTo(30);
    if (regions == 1) {
      alone = Velocities();
      continue;
    }
    EXPECT_TRUE(at(1).owned().empty()) << "all have crossed";
    EXPECT_EQ(Velocities(), alone);
  }
  EXPECT_FALSE(blown.empty());
}

TEST_F(RegionBlastTest, BehindAClosedBorderEachIsPushedOnceWhenItOpens) {
  Begin(Ring(), 2, {{4, kOne, {0, 0, 0}}});
  StepTo(3);
  Fail();
  StepTo(20);
  EXPECT_THAT(blown, SizeIs(6)) << "those of its own region, in time";
  lost = false;
  StepTo(100);
  ASSERT_TRUE(at(1).IsLinkUp(kTwo));
  ExpectEachBlownOnce(12);
}

// A body that flies over a border that is down is granted when it is up again, at about the tick of the effect.
TEST_F(RegionBlastTest, WhoCrossesABorderThatWasDownIsPushedOnce) {
  for (const RegionId maker : {kOne, kTwo}) {
    Begin({{-1, 0, 0}, {-1, 0, 3}}, 2, {{6, maker, {2, 0, 1}}}, {3, 0, 0});
    StepTo(4);
    Fail();
    StepTo(40);
    EXPECT_TRUE(at(1).Owns(BodyId(1)));
    lost = false;
    StepTo(120);
    EXPECT_TRUE(at(2).Owns(BodyId(1)) && at(2).Owns(BodyId(2)));
    ExpectEachBlownOnce(2);
  }
}

TEST_F(RegionBlastTest, AfterTenSecondsNothingHappens) {
  Begin(Ring(), 2, {{4, kOne, {0, 0, 0}}});
  StepTo(3);
  Fail();
  StepTo(4 + 4 + 601);
  lost = false;
  StepTo(700);
  ASSERT_TRUE(at(1).IsLinkUp(kTwo));
  ExpectEachBlownOnce(6);
}

TEST_F(RegionBlastTest, SleepersWake) {
  Begin({{-3, 0, 0}, {3, 0, 0}}, 2, {{150, kOne, {0, 0, 0}}}, {}, true);
  StepTo(149);
  ASSERT_EQ(at(1).asleep_count() + at(2).asleep_count(), 2U);
  StepTo(160);
  EXPECT_LT(Velocities().at(BodyId(1)).x, -1);
  EXPECT_GT(Velocities().at(BodyId(2)).x, 1);
}

TEST_F(RegionBlastTest, ASavedStateNeitherForgetsNorRepeatsIt) {
  for (const std::uint64_t saved_at : {5U, 6U, 7U, 8U, 20U}) {
    Begin(Ring(), 1, {{3, kOne, {0, 0, 0}}});
    StepTo(saved_at);
    const auto state = DecodeState(at(1).SaveState(), at(1).catalog());
    ASSERT_TRUE(state.ok()) << state.status();
    // As one region's own, and as what is merged for any map.
    for (const bool merged : {false, true}) {
      const auto before = blown;
      const auto from = merged ? MergeStates(std::vector{*state}) : state;
      ASSERT_TRUE(from.ok()) << from.status();
      const auto kept = std::exchange(regions_[kOne], Make(kOne, 2, std::make_shared<const RegionState>(*from)));
      at(1).Start();
      StepTo(40);
      ExpectEachBlownOnce(12);
      regions_[kOne].reset();
      regions_[kOne] = Make(kOne, 3, std::make_shared<const RegionState>(*state));
      blown = before;
    }
  }
}

// Region 2 dies some ticks after its standby's copy was made: what is promoted is pushed once more or not yet.
TEST_F(RegionBlastTest, PromotedBodiesAreSettledForTheRest) {
  for (const std::uint64_t copied_until : {4U, 5U, 6U, 7U, 8U, 10U}) {
    Begin(Ring(), 2, {{3, kOne, {0, 0, 0}}});
    at(2).SetStandby(true);
    StandbyCopy copy(kTwo, at(2).catalog());
    while (at(2).tick().value() < 11) {
      Step();
      if (at(2).tick().value() <= copied_until) {
        ASSERT_TRUE(copy.Receive(logs[kTwo]).ok());
      }
    }
    const auto resolution = CarryOn(at(1), kTwo, copy);
    ASSERT_TRUE(resolution.ok()) << resolution.status();
    regions_.erase(kTwo);
    StepTo(30);
    ASSERT_THAT(at(1).owned(), SizeIs(13));
    // A second push would give twice the speed.
    for (const auto& [id, velocity] : Velocities()) {
      if (id == BodyId(13)) continue;
      EXPECT_NEAR(Length(velocity), kImpulse_ns * (1 - Length(Ring()[id.value() - 1]) / kRadius_m), 1e-3)
          << "body " << id.value() << ", copied until tick " << copied_until;
    }
  }
}

}  // namespace
}  // namespace tessera::region::blasts
