// A game in two regions: a ball flies from one to the other, and what the game keeps with it goes along.
#include "core/region/region_game.h"

#include <gmock/gmock.h>

#include "core/game/testing/scripted_game.h"
#include "core/game/value.h"
#include "core/region/log.h"
#include "core/region/output_commit.h"
#include "core/region/region.h"
#include "core/region/region_state.h"
#include "core/region/resolve.h"
#include "core/region/standby_copy.h"
#include "core/region/testing/small_world.h"
#include "core/world/partition_change.h"
#include "game_sdk/api/api.h"

namespace tessera::region {
namespace {

using game::GameCalls;
using game::GameHost;
using game::GameValue;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr BodyId kGameBall{1};

class RegionGameTest : public ::testing::Test {
 protected:
  // A ball of 1 kg without gravity at `x`, with `speed` towards region 2, and a second one of no kind.
  void Begin(double x, double speed, Vec3d second = {8, 0, 8}) {
    Scene scene = Balls({{x, 0, 0}, second});
    scene.kinds = {"", "ball"};
    scene.bodies[0].kind = 1;
    scene.bodies[0].initial.linear_velocity = {static_cast<float>(speed), 0, 0};
    scene.bodies[0].may_sleep = false;
    scene.properties = {{"hits", std::int64_t{0}}};
    AddPrefabs(scene);
    scene_ = std::make_shared<const Scene>(std::move(scene));
    module_ = game.module();
    one = Make(kOne, nullptr);
    two = Make(kTwo, nullptr);
    Send(kOne, one->Start());
    Send(kTwo, two->Start());
  }
  // Single balls, and pairs of them two metres apart.
  static void AddPrefabs(Scene& scene) {
    for (const std::uint64_t bodies : {1, 2}) {
      Prefab& prefab = scene.prefabs.emplace_back();
      prefab.name = bodies == 1 ? "single" : "pair";
      for (std::uint64_t i = 0; i < bodies; ++i) {
        BodyDef& def = prefab.bodies.emplace_back(scene.bodies[0]);
        def.id = BodyId(i + 1);
        def.kind = 0;
        def.initial = {};
        def.initial.position = {2 * static_cast<double>(i), 0, 0};
      }
      if (bodies == 1) continue;
      JointDef& joint = prefab.joints.emplace_back();
      joint.id = JointId(1);
      joint.body_a = BodyId(1);
      joint.body_b = BodyId(2);
      joint.frame_a.position = {1, 0, 0};
      joint.frame_b.position = {-1, 0, 0};
    }
  }
  std::unique_ptr<Region> Make(RegionId self, std::shared_ptr<const RegionState> initial) {
    auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_);
    EXPECT_TRUE(host.ok()) << host.status();
    Config config{self, Incarnation(1), scene_, *MakeGridMap(scene_->ground(), 2), {}, std::move(initial)};
    config.game = *std::move(host);
    hosts_.push_back(config.game);
    return std::make_unique<Region>(std::move(config));
  }
  void Send(RegionId from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      const absl::Status status = (from == kOne ? two : one)->Receive(from, frame.bytes);
      EXPECT_TRUE(status.ok()) << status;
    }
  }
  void Step() {
    ASSERT_TRUE(one->CanStep() && two->CanStep());
    if (renew) {
      for (const auto& host : hosts_) ASSERT_TRUE(host->Renew().ok());
    }
    const StepResult first = one->Step(), second = two->Step();
    Send(kOne, first.frames);
    Send(kTwo, second.frames);
    EXPECT_FALSE(one->Owns(kGameBall) && two->Owns(kGameBall));
  }
  void StepTo(std::uint64_t tick) {
    while (one->tick().value() < tick) ASSERT_NO_FATAL_FAILURE(Step());
  }
  const Region& owner() const { return one->Owns(kGameBall) ? *one : *two; }
  PropertyValue Hits() const {
    const KeptRecord* record = owner().records().Find(kGameBall);
    const PropertySet changed =
        record == nullptr ? PropertySet() : PropertySet::Decode(*record->bytes, scene_->properties).value();
    return *ValueOf(scene_->properties, {}, changed, "hits");
  }

  ScriptedGame game;
  bool renew = false;  // the game's code is loaded anew before each tick
  std::unique_ptr<Region> one, two;

 private:
  std::shared_ptr<const Scene> scene_;
  tessera_game_module module_{};
  std::vector<std::shared_ptr<GameHost>> hosts_;
};

TEST_F(RegionGameTest, APushActsInTheNextTickAndANeighbourStepsTheBodyAlike) {
  game.On(game::kOnBodyTick, "ball", [](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
    if (calls.result().as.whole != 3) return true;
    return calls.Call(game::kBodyImpulse, {kGameBall, Vec3d{0, 3, 0}, Vec3d{0, 0, 0.1}});
  });
  Begin(-0.6, 0);
  StepTo(3);
  EXPECT_EQ(one->world().StateOf(kGameBall).linear_velocity, Vec3f());
  Step();
  EXPECT_NEAR(one->world().StateOf(kGameBall).linear_velocity.y, 3, 1e-6);
  EXPECT_NE(one->world().StateOf(kGameBall).angular_velocity, Vec3f());
  ASSERT_TRUE(two->world().Has(kGameBall)) << "a ghost there";
  EXPECT_EQ(two->world().StateOf(kGameBall).position, one->world().StateOf(kGameBall).position);
  EXPECT_EQ(two->world().StateOf(kGameBall).linear_velocity, one->world().StateOf(kGameBall).linear_velocity);
  EXPECT_EQ(two->world().StateOf(kGameBall).angular_velocity, one->world().StateOf(kGameBall).angular_velocity);
  StepTo(20);
  EXPECT_NEAR(one->world().StateOf(kGameBall).linear_velocity.y, 3, 1e-6) << "once";
}

// Whichever region owns the ball in a tick pushes it, also in those around its handover.
TEST_F(RegionGameTest, EveryPushActsOnceAlsoInAHandover) {
  game.On(game::kOnBodyTick, "ball", [](GameCalls& calls, Arguments) {
    return calls.Call(game::kBodyImpulse, {kGameBall, Vec3d{0, 0.01, 0}});
  });
  Begin(-0.4, 6);
  StepTo(61);
  EXPECT_TRUE(two->Owns(kGameBall));
  EXPECT_NEAR(owner().world().StateOf(kGameBall).linear_velocity.y, 0.6, 1e-5);
}

TEST_F(RegionGameTest, TimersAndPropertiesGoWithTheBody) {
  std::vector<std::int64_t> called;
  const auto started = [](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
    if (calls.result().as.whole != 1) return true;
    return calls.Call(game::kBodySet, {kGameBall, std::string("hits"), std::int64_t{7}}) &&
           calls.Call(game::kBodyAfter, {kGameBall, std::int64_t{50}, std::string("late")});
  };
  game.On(game::kOnBodyTick, "ball", started);
  game.On(game::kOnBodyTimer, "ball", [&](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
    called.push_back(calls.result().as.whole);
    return true;
  });
  Begin(-0.4, 6);
  StepTo(40);
  ASSERT_TRUE(two->Owns(kGameBall));
  EXPECT_EQ(Hits(), PropertyValue(std::int64_t{7}));
  EXPECT_THAT(called, IsEmpty());
  StepTo(70);
  EXPECT_THAT(called, ElementsAre(51));
}

TEST_F(RegionGameTest, ASavedStateHasThemToo) {
  int called = 0;
  game.On(game::kOnBodyTick, "ball", [](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
    if (calls.result().as.whole != 5) return true;
    return calls.Call(game::kBodyAfter, {kGameBall, std::int64_t{10}, std::string("late")}) &&
           calls.Call(game::kBodyImpulse, {kGameBall, Vec3d{0, 3, 0}});
  });
  game.On(game::kOnBodyTimer, "ball", [&](GameCalls&, Arguments) { return ++called > 0; });
  Begin(-5, 0);
  StepTo(5);
  const auto state = DecodeState(one->SaveState(), one->catalog());
  ASSERT_TRUE(state.ok()) << state.status();
  ASSERT_THAT(state->records, SizeIs(1));
  EXPECT_THAT(state->records.at(kGameBall).game.timers, SizeIs(1));
  one = Make(kOne, std::make_shared<const RegionState>(*state));
  two = Make(kTwo, std::make_shared<const RegionState>(*DecodeState(two->SaveState(), two->catalog())));
  Send(kOne, one->Start());
  Send(kTwo, two->Start());
  Step();
  EXPECT_NEAR(one->world().StateOf(kGameBall).linear_velocity.y, 3, 1e-6);
  StepTo(20);
  EXPECT_EQ(called, 1);
}

TEST_F(RegionGameTest, ATouchIsToldToTheKindThatAsksForIt) {
  std::vector<std::uint64_t> others;
  game::GameFields contact;
  game.On(game::kOnBodyContact, "ball", [&](GameCalls& calls, Arguments arguments) {
    EXPECT_EQ(arguments[0].as.id, kGameBall.value());
    others.push_back(arguments[1].as.id);
    EXPECT_EQ(arguments.size(), 3U);
    EXPECT_EQ(arguments[2].type, TESSERA_GAME_FIELDS);
    contact = game::FieldsFrom(arguments[2]).value();
    return calls.Call(game::kBodySet, {kGameBall, std::string("hits"), static_cast<std::int64_t>(others.size())});
  });
  Begin(2, 6, {4, 0, 0});
  StepTo(60);
  EXPECT_THAT(others, ElementsAre(2));
  EXPECT_EQ(Hits(), PropertyValue(std::int64_t{1}));
  ASSERT_THAT(contact, SizeIs(3));
  EXPECT_EQ(contact[0].first, "impulse");
  EXPECT_NEAR(std::get<double>(contact[0].second), 3, 0.05) << "1 kg at 6 m/s meets 1 kg";
  EXPECT_EQ(contact[1].first, "normal");
  EXPECT_NEAR(std::get<Vec3d>(contact[1].second).x, -1, 1e-3) << "from the other one";
  EXPECT_EQ(contact[2].first, "point");
  EXPECT_NEAR(std::get<Vec3d>(contact[2].second).x, 3.5, 0.11) << "where it was at the start of the step at most";
}

// The ball is in region 1 near the border. Region 2 asks in each tick.
TEST_F(RegionGameTest, ANeighbourReadsAPropertyFourTicksAfterItWasSetAndThroughAHandover) {
  game.On(game::kOnBodyTick, "ball", [&](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
    const std::int64_t tick = calls.result().as.whole;
    return tick != 10 || calls.Call(game::kBodySet, {kGameBall, std::string("hits"), std::int64_t{7}});
  });
  Begin(-0.6, 0.5);
  const auto read = [&](const Region& region) {
    std::int64_t hits = -1;
    region.InspectGame([&](const tessera_game_host& host, tessera_game_call* call) {
      GameCalls calls(host, call);
      if (calls.Call(game::kBodyGet, {kGameBall, std::string("hits")})) hits = calls.result().as.whole;
    });
    return hits;
  };
  StepTo(13);
  EXPECT_EQ(read(*one), 7);
  EXPECT_EQ(read(*two), 0);
  Step();
  EXPECT_EQ(read(*two), 7);
  while (one->Owns(kGameBall)) {
    ASSERT_LT(one->tick(), Tick(400));
    Step();
    EXPECT_EQ(read(*one), 7) << one->tick();
    EXPECT_EQ(read(*two), 7) << one->tick();
  }
  for (int i = 0; i < 10; ++i) {
    Step();
    EXPECT_EQ(read(*one), 7) << one->tick() << ": a ghost of region 2's now";
  }
}

// Records hold all that counts: loading the game's code anew between ticks changes nothing.
TEST_F(RegionGameTest, TheGamesOwnMemoryIsNothingThatCounts) {
  const auto play = [this] {
    game.On(game::kOnBodyTick, "ball", [](GameCalls& calls, Arguments) {
      EXPECT_TRUE(calls.Call(game::kWorldRandom, {}));
      const double up = calls.result().as.real - 0.5;
      return calls.Call(game::kBodyImpulse, {kGameBall, Vec3d{0, up, 0}});
    });
    Begin(-0.4, 6);
    StepTo(50);
    return owner().world().StateOf(kGameBall);
  };
  const BodyState once = play();
  renew = true;
  const BodyState again = play();
  EXPECT_EQ(again.position, once.position);
  EXPECT_EQ(again.linear_velocity, once.linear_velocity);
  EXPECT_NE(once.linear_velocity.y, 0);
}

TEST_F(RegionGameTest, AQuerySeesANeighboursBodyWhereItsOwnerHasIt) {
  std::vector<std::pair<bool, double>> seen;  // whether the region owns the ball, and where the ray met it
  game.On(game::kOnTick, "", [&](GameCalls& calls, Arguments) {
    if (!calls.Call(game::kWorldRay, {Vec3d{-0.6, 5, 0}, Vec3d{-0.6, -5, 0}})) return false;
    if (calls.result().type != TESSERA_GAME_FIELDS) return true;
    EXPECT_EQ(calls.result().as.fields[0].value.as.id, kGameBall.value());
    const double y = calls.result().as.fields[4].value.as.vector[1];
    EXPECT_TRUE(calls.Call(game::kBodyIsOwn, {kGameBall}));
    seen.emplace_back(calls.result().as.whole != 0, y);
    return true;
  });
  Begin(-0.6, 0);
  StepTo(5);
  int ghosts = 0;
  for (const auto& [own, y] : seen) {
    EXPECT_NEAR(y, 0.5, 1e-9);
    ghosts += own ? 0 : 1;
  }
  EXPECT_GE(ghosts, 3) << "the neighbour sees it as well";
  EXPECT_GE(static_cast<int>(seen.size()) - ghosts, 4);
}

// --- What waits for the standby

// Region 1 with a standby that says by `lag` ticks late what it has.
class RegionCommitTest : public RegionGameTest {
 protected:
  void StepWithStandby(std::uint64_t ticks, std::uint64_t lag) {
    for (std::uint64_t i = 0; i < ticks; ++i) {
      const StepResult first = one->Step(), second = two->Step();
      Send(kOne, first.frames);
      Send(kTwo, second.frames);
      if (one->tick().value() > lag) one->LogAcknowledged(Tick(one->tick().value() - lag));
    }
  }
  // The ball's property as clients may be told.
  PropertyValue Told() const {
    const KeptRecord* record = one->records().Find(kGameBall);
    const OutputCommit::PropertyBytes bytes = record == nullptr ? nullptr : one->output().PropertiesOf(*record);
    const PropertySet set =
        bytes == nullptr ? PropertySet() : PropertySet::Decode(*bytes, one->catalog().scene().properties).value();
    return *ValueOf(one->catalog().scene().properties, {}, set, "hits");
  }
};

TEST_F(RegionCommitTest, APropertyIsToldWhenTheStandbyHasIt) {
  game.On(game::kOnBodyTick, "ball", [](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
    return calls.Call(game::kBodySet, {kGameBall, std::string("hits"), calls.result().as.whole});
  });
  Begin(-5, 0);
  one->SetStandby(true);
  StepWithStandby(10, 3);
  EXPECT_EQ(Hits(), PropertyValue(std::int64_t{10}));
  EXPECT_EQ(Told(), PropertyValue(std::int64_t{6})) << "what the standby had by the beginning of the step";
  one->SetStandby(false);
  Step();
  EXPECT_EQ(Told(), PropertyValue(std::int64_t{11}));
}

// Gives the ball and the second one a number each, in one call or in two.
class RegionTogetherTest : public RegionCommitTest {
 protected:
  void Count(bool together) {
    game.On(game::kOnBodyTick, "ball", [together](GameCalls& calls, Arguments arguments) {
      EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
      const std::int64_t tick = calls.result().as.whole;
      const auto set = [&](BodyId id) { return calls.Call(game::kBodySet, {id, std::string("hits"), tick}); };
      if (!set(BodyId(arguments[0].as.id))) return false;
      // As long as both are here.
      return !together || tick > 4 || set(BodyId(2));
    });
    Begin(-0.1, 6, {-8, 0, 8});  // beyond the hysteresis from tick 4 on
    one->SetStandby(true);
  }
};

// Were the ball granted at once, and region 1 dead with a standby that lacks the tick, what the callback did to the
// other ball would be undone, and this one would keep its part of it.
TEST_F(RegionTogetherTest, WhatWasChangedTogetherIsHandedOverWhenTheStandbyHasIt) {
  Count(true);
  StepWithStandby(9, 20);
  EXPECT_TRUE(one->Owns(kGameBall));
  EXPECT_EQ(Hits(), PropertyValue(std::int64_t{9})) << "its callbacks go on";
  one->LogAcknowledged(Tick(9));
  StepWithStandby(2, 20);
  EXPECT_TRUE(two->Owns(kGameBall));
}

TEST_F(RegionTogetherTest, WhatWasChangedAloneTakesItAlongAtOnce) {
  Count(false);
  StepWithStandby(9, 20);
  EXPECT_TRUE(two->Owns(kGameBall));
  EXPECT_EQ(Hits(), PropertyValue(std::int64_t{9})) << "in each tick, whoever owned it";
}

TEST_F(RegionTogetherTest, AHandoverDoesNotWaitForAStandbyForEver) {
  Count(true);
  StepWithStandby(30, 1000);
  EXPECT_TRUE(one->Owns(kGameBall));
  StepWithStandby(10, 1000);
  EXPECT_TRUE(two->Owns(kGameBall));
}

// --- Bodies that the game makes

class RegionSpawnTest : public RegionGameTest {
 protected:
  static BodyId MadeByOne(std::uint32_t prefab, std::uint32_t member = 0) {
    return SpawnedBodyId({prefab, 1, 1, member});
  }
  static tessera_game_value Moving(const tessera_game_field& velocity) {
    tessera_game_value options{};
    options.type = TESSERA_GAME_FIELDS;
    options.count = 1;
    options.as.fields = &velocity;
    return options;
  }
  // At tick 2 of region 1, near the border, with so many m/s towards region 2.
  void SpawnAtTick2(const std::string& prefab, double x, double speed) {
    game.On(game::kOnBodyTick, "ball", [=](GameCalls& calls, Arguments) {
      EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
      if (calls.result().as.whole != 2) return true;
      const GameValue name(prefab), place(Vec3d{x, 0, 3}), along(Vec3d{speed, 0, 0});
      const tessera_game_field velocity{"velocity", 8, game::ToInterface(along)};
      const tessera_game_value arguments[] = {game::ToInterface(name), game::ToInterface(place), Moving(velocity)};
      return calls.CallRaw(game::kWorldSpawn, arguments);
    });
  }
};

TEST_F(RegionSpawnTest, ABodyCrossesTheBorderAsAnyOtherDoes) {
  SpawnAtTick2("single", -0.6, 6);
  Begin(-5, 0);
  StepTo(2);
  const BodyId ball = MadeByOne(0);
  ASSERT_TRUE(one->Owns(ball));
  EXPECT_EQ(one->world().StateOf(ball).position.x, -0.6) << "it begins to move with the next step";
  StepTo(3);
  EXPECT_NEAR(one->world().StateOf(ball).position.x, -0.5, 1e-6);
  StepTo(5);
  ASSERT_TRUE(two->world().Has(ball)) << "a ghost there";
  EXPECT_EQ(two->world().StateOf(ball).position, one->world().StateOf(ball).position);
  StepTo(32);
  EXPECT_FALSE(one->Owns(ball));
  EXPECT_TRUE(two->Owns(ball));
  EXPECT_NEAR(two->world().StateOf(ball).position.x, 2.4, 1e-6);
}

TEST_F(RegionSpawnTest, JointedBodiesCrossTogether) {
  SpawnAtTick2("pair", -2.6, 6);
  Begin(-5, 0);
  StepTo(2);
  const BodyId first = MadeByOne(1), second = MadeByOne(1, 1);
  ASSERT_TRUE(one->Owns(first) && one->Owns(second));
  for (std::uint64_t tick = 3; tick < 60; ++tick) {
    StepTo(tick);
    ASSERT_EQ(one->Owns(first), one->Owns(second));
    ASSERT_EQ(two->Owns(first), two->Owns(second));
  }
  ASSERT_TRUE(two->Owns(first));
  EXPECT_TRUE(two->world().HasJoint(SpawnedJointId(first, JointId(1))));
  EXPECT_NEAR(two->world().StateOf(second).position.x - two->world().StateOf(first).position.x, 2, 1e-4);
}

TEST_F(RegionSpawnTest, ASavedStateAndTheLogHaveThem) {
  SpawnAtTick2("pair", -5, 0);
  Begin(-8, 0);
  one->SetStandby(true);
  StandbyCopy copy(kOne, one->catalog());
  const auto step = [&] {
    const StepResult first = one->Step(), second = two->Step();
    Send(kOne, first.frames);
    Send(kTwo, second.frames);
    const absl::Status status = copy.Receive(first.log);
    EXPECT_TRUE(status.ok()) << status;
    one->LogAcknowledged(copy.tick());
  };
  for (int i = 0; i < 3; ++i) step();
  EXPECT_NE(copy.state().Find(MadeByOne(1, 1)), nullptr);
  const auto state = DecodeState(one->SaveState(), one->catalog());
  ASSERT_TRUE(state.ok()) << state.status();
  one = Make(kOne, std::make_shared<const RegionState>(*state));
  ASSERT_TRUE(one->Owns(MadeByOne(1)));
  EXPECT_TRUE(one->world().HasJoint(SpawnedJointId(MadeByOne(1), JointId(1))));
}

// The ball comes to region 2 and is removed there; region 1 still has its copy of the grant when region 2 dies.
TEST_F(RegionSpawnTest, ARemovedBodyLeavesATombstoneForTheStandby) {
  game.On(game::kOnBodyTick, "ball", [](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(game::kBodyPosition, {kGameBall}));
    return calls.result().as.vector[0] < 0.55 || calls.Call(game::kBodyRemove, {kGameBall});
  });
  Begin(-0.4, 6);
  two->SetStandby(true);  // which acknowledges nothing, so neither does region 2
  StandbyCopy copy(kTwo, two->catalog());
  for (int i = 0; i < 20; ++i) {
    const StepResult first = one->Step(), second = two->Step();
    Send(kOne, first.frames);
    Send(kTwo, second.frames);
    EXPECT_TRUE(copy.Receive(second.log).ok());
  }
  EXPECT_FALSE(one->Owns(kGameBall) || two->Owns(kGameBall));
  EXPECT_FALSE(two->world().Has(kGameBall));
  EXPECT_THAT(copy.state().tombstones, ElementsAre(BodyClaim{kGameBall, Epoch(2)}));
  const auto map = FailoverMap(one->map(), std::vector{kTwo}, MapVersion(2));
  ASSERT_TRUE(map.ok()) << map.status();
  const StandbyCopy* const primaries[] = {&copy};
  const auto inventory = one->BeginFailover(*map, primaries);
  ASSERT_TRUE(inventory.ok()) << inventory.status();
  EXPECT_THAT(inventory->grants, SizeIs(1)) << "the copy that would bring it back";
  const auto resolution = Resolve(*map, std::vector{kTwo}, std::vector{*inventory}, std::vector{kGameBall, BodyId(2)});
  ASSERT_TRUE(resolution.ok()) << resolution.status();
  EXPECT_THAT(resolution->lost, IsEmpty());
  ASSERT_TRUE(one->Resume(*resolution, primaries).ok());
  EXPECT_FALSE(one->Owns(kGameBall));
  EXPECT_TRUE(one->Owns(BodyId(2)));
}

}  // namespace
}  // namespace tessera::region
