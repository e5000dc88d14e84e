// Joints that a game makes: in one region, between two, and through the death of a region.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <map>

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

namespace tessera::region::game_joints {
namespace {

using game::GameCalls;
using game::GameHost;
using game::GameValue;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr BodyId kLower{1}, kHigher{2}, kThird{3};
constexpr double kTwoMetres = 2;

// Balls without gravity in two regions, whose border is x = 0. The game acts in the ticks of the lower body.
class RegionJointsTest : public ::testing::Test {
 protected:
  using Act = std::function<bool(GameCalls&, std::int64_t tick)>;

  void Begin(const std::vector<Vec3d>& places, Act act, double speed = 0, std::size_t actor = 0) {
    Scene scene = Balls(places);
    scene.kinds = {"", "ball", "other"};
    for (BodyDef& def : scene.bodies) {
      def.kind = 2;
      def.may_sleep = false;
      def.initial.linear_velocity = {static_cast<float>(speed), 0, 0};
    }
    scene.bodies[actor].kind = 1;
    scene_ = std::make_shared<const Scene>(std::move(scene));
    game.On(game::kOnBodyTick, "ball", [act = std::move(act)](GameCalls& calls, Arguments) {
      EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
      return act(calls, calls.result().as.whole);
    });
    const auto hear = [this](GameCalls&, Arguments arguments) {
      answers.emplace_back(arguments[1].as.text, arguments[1].count);
      const std::span fields(arguments[2].as.fields, arguments[2].count);
      for (const tessera_game_field& field : fields) {
        if (std::string_view(field.name, field.name_bytes) == "connected") connected = field.value.as.whole != 0;
      }
      return true;
    };
    game.On(game::kOnBodyMessage, "ball", hear);
    game.On(game::kOnBodyMessage, "other", hear);
    module_ = game.module();
    one = Make(kOne, nullptr);
    two = Make(kTwo, nullptr);
    Send(kOne, one->Start());
    Send(kTwo, two->Start());
  }
  std::unique_ptr<Region> Make(RegionId self, std::shared_ptr<const RegionState> initial) {
    auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_);
    EXPECT_TRUE(host.ok()) << host.status();
    Config config{self, Incarnation(self.value()), scene_, *MakeGridMap(scene_->ground(), 2), {}, std::move(initial)};
    config.game = *std::move(host);
    return std::make_unique<Region>(std::move(config));
  }
  void Send(RegionId from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      const absl::Status status = (from == kOne ? two : one)->Receive(from, frame.bytes);
      ASSERT_TRUE(status.ok()) << status;
    }
  }
  void Step() {
    ASSERT_TRUE(one->CanStep() && two->CanStep());
    const StepResult first = one->Step(), second = two->Step();
    Send(kOne, first.frames);
    Send(kTwo, second.frames);
    for (Region* region : {one.get(), two.get()}) {
      for (game::GameLine& line : region->game()->TakeLines()) lines.push_back(line.text);
    }
  }
  void StepTo(std::uint64_t tick) {
    while (one->tick().value() < tick) ASSERT_NO_FATAL_FAILURE(Step());
  }
  const Region& OwnerOf(BodyId id) const { return one->Owns(id) ? *one : *two; }
  BodyState StateOf(BodyId id) const { return OwnerOf(id).world().StateOf(id); }
  bool SameOwner(BodyId a, BodyId b) const { return one->Owns(a) == one->Owns(b) && two->Owns(a) == two->Owns(b); }
  std::vector<game::GameJoint> JointsOf(BodyId id) const {
    const KeptRecord* record = OwnerOf(id).records().Find(id);
    return record == nullptr ? std::vector<game::GameJoint>() : record->game.joints;
  }

  // Connects two bodies at their places by a joint of this kind, and asks for an answer.
  static bool Connect(GameCalls& calls, BodyId a, BodyId b, const char* kind = "fixed") {
    const GameValue kind_value{std::string(kind)}, answer{std::string("held")};
    const tessera_game_field fields[] = {{"answer", 6, game::ToInterface(answer)},
                                         {"kind", 4, game::ToInterface(kind_value)}};
    tessera_game_value joint{};
    joint.type = TESSERA_GAME_FIELDS;
    joint.count = 2;
    joint.as.fields = fields;
    const tessera_game_value arguments[] = {game::ToInterface(GameValue(a)), game::ToInterface(GameValue(b)), joint};
    return calls.CallRaw(game::kBodyConnect, arguments);
  }

  ScriptedGame game;
  std::unique_ptr<Region> one, two;
  std::vector<std::string> answers, lines;
  bool connected = false;

 private:
  std::shared_ptr<const Scene> scene_;
  tessera_game_module module_{};
};

TEST_F(RegionJointsTest, TwoBodiesOfOneRegionMoveAsOne) {
  Begin({{-6, 0, 0}, {-4, 0, 0}}, [](GameCalls& calls, std::int64_t tick) {
    if (tick == 2) return Connect(calls, kLower, kHigher);
    return tick != 5 || calls.Call(game::kBodyImpulse, {kLower, Vec3d{0, 2, 0}});
  });
  StepTo(40);
  EXPECT_THAT(answers, ElementsAre("held"));
  EXPECT_TRUE(connected);
  const BodyState a = StateOf(kLower), b = StateOf(kHigher);
  EXPECT_NEAR(Length(b.position - a.position), kTwoMetres, 1e-2);
  EXPECT_GT(b.position.y + a.position.y, 0.5) << "one impulse moves both";
  EXPECT_NEAR(a.linear_velocity.y + b.linear_velocity.y, 2, 1e-3) << "momentum is kept";
}

TEST_F(RegionJointsTest, DisconnectedBodiesPart) {
  Begin({{-6, 0, 0}, {-4, 0, 0}}, [](GameCalls& calls, std::int64_t tick) {
    if (tick == 2) return Connect(calls, kLower, kHigher);
    if (tick == 10) {
      EXPECT_TRUE(calls.Call(game::kBodyIsConnected, {kHigher, kLower}));
      EXPECT_TRUE(calls.result().as.whole != 0);
      EXPECT_TRUE(calls.Call(game::kBodyDisconnect, {kHigher, kLower}));
      EXPECT_TRUE(calls.result().as.whole != 0);
      return calls.Call(game::kBodyImpulse, {kLower, Vec3d{-2, 0, 0}});
    }
    return true;
  });
  StepTo(30);
  EXPECT_THAT(JointsOf(kLower), IsEmpty());
  EXPECT_NEAR(StateOf(kHigher).position.x, -4, 1e-3);
  EXPECT_LT(StateOf(kLower).position.x, -6.5);
}

TEST_F(RegionJointsTest, TheyAreHandedOverTogetherWithTheirJoint) {
  Begin(
      {{-3, 0, 0}, {-5, 0, 0}},
      [](GameCalls& calls, std::int64_t tick) { return tick != 2 || Connect(calls, kLower, kHigher); }, 6);
  for (std::uint64_t tick = 3; tick < 80; ++tick) {
    ASSERT_NO_FATAL_FAILURE(StepTo(tick));
    ASSERT_TRUE(SameOwner(kLower, kHigher)) << tick;
  }
  ASSERT_TRUE(two->Owns(kHigher));
  ASSERT_THAT(JointsOf(kLower), SizeIs(1));
  EXPECT_TRUE(two->world().HasJoint(JointsOf(kLower)[0].id));
  EXPECT_NEAR(StateOf(kLower).position.x - StateOf(kHigher).position.x, kTwoMetres, 1e-3);
}

TEST_F(RegionJointsTest, ANeighbourStepsThemAlike) {
  Begin({{-0.7, 0, 0}, {-0.7, 0, 2}}, [](GameCalls& calls, std::int64_t tick) {
    if (tick == 2) return Connect(calls, kLower, kHigher);
    return tick != 6 || calls.Call(game::kBodyImpulse, {kLower, Vec3d{0, 1, 0}});
  });
  for (std::uint64_t tick = 4; tick < 30; ++tick) {
    ASSERT_NO_FATAL_FAILURE(StepTo(tick));
    ASSERT_TRUE(two->world().Has(kLower) && two->world().Has(kHigher));
    ASSERT_EQ(one->world().StateOf(kHigher), two->world().StateOf(kHigher)) << tick;
  }
  EXPECT_GT(StateOf(kHigher).linear_velocity.y, 0.02) << "the joint pulls";
}

// Whoever asks, the body with the lower id goes to the other one, and the joint is made in the step that takes it in.
TEST_F(RegionJointsTest, BodiesOfTwoRegionsMeet) {
  for (const std::size_t actor : {std::size_t{0}, std::size_t{1}}) {
    answers.clear();
    Begin(
        {{-0.6, 0, 0}, {0.6, 0, 0}},
        [](GameCalls& calls, std::int64_t tick) { return tick != 8 || Connect(calls, kLower, kHigher); }, 0, actor);
    StepTo(8);
    EXPECT_FALSE(SameOwner(kLower, kHigher));
    StepTo(40);
    EXPECT_TRUE(SameOwner(kLower, kHigher)) << "asked for by body " << actor + 1;
    EXPECT_THAT(answers, ElementsAre("held"));
    EXPECT_TRUE(connected);
    EXPECT_TRUE(one->Owns(kLower)) << "an assembly is where its lowest body is";
    ASSERT_THAT(JointsOf(kLower), SizeIs(1));
    EXPECT_EQ(JointsOf(kLower)[0].until, Tick());
    EXPECT_TRUE(one->world().HasJoint(JointsOf(kLower)[0].id));
  }
}

TEST_F(RegionJointsTest, OneWhoseOtherBodyIsGoneEnds) {
  Begin({{-6, 0, 0}, {-4, 0, 0}}, [](GameCalls& calls, std::int64_t tick) {
    if (tick == 2) return Connect(calls, kLower, kHigher);
    return tick != 10 || calls.Call(game::kBodyRemove, {kHigher});
  });
  StepTo(9);
  EXPECT_THAT(JointsOf(kLower), SizeIs(1));
  StepTo(12);
  EXPECT_THAT(JointsOf(kLower), IsEmpty());
  EXPECT_THAT(lines, IsEmpty());
}

// The other body goes to the neighbour, who is then not heard any more: within a second it is given up.
TEST_F(RegionJointsTest, OneThatCannotBeMadeIsAnsweredAfterASecond) {
  Begin({{-0.6, 0, 0}, {0.6, 0, 0}},
        [](GameCalls& calls, std::int64_t tick) { return tick != 8 || Connect(calls, kLower, kHigher); });
  StepTo(7);
  one->TakeLinkDown(kTwo);
  for (int i = 0; i < 90; ++i) {
    ASSERT_TRUE(one->CanStep());
    one->Step();
  }
  EXPECT_THAT(answers, ElementsAre("held"));
  EXPECT_FALSE(connected);
  EXPECT_TRUE(one->Owns(kLower));
  EXPECT_THAT(JointsOf(kLower), IsEmpty());
}

TEST_F(RegionJointsTest, BrokenRulesAreNamed) {
  std::vector<std::string> errors;
  Begin({{-6, 0, 0}, {-4, 0, 0}, {-5, 0, 2}}, [&](GameCalls& calls, std::int64_t tick) {
    if (tick == 2) return Connect(calls, kLower, kHigher);
    if (tick != 5) return true;
    const auto refused = [&](BodyId a, BodyId b, const char* kind = "fixed") {
      EXPECT_FALSE(Connect(calls, a, b, kind));
      errors.push_back(calls.error());
    };
    refused(kLower, kLower);
    refused(kLower, BodyId(77));
    refused(kHigher, kLower);
    refused(kLower, kThird, "glue");
    refused(kLower, kThird, "spring");
    refused(kLower, kThird, "distance");
    return true;
  });
  StepTo(6);
  EXPECT_THAT(errors, ElementsAre("connect: body 1 with itself", "connect: body 77 is not here",
                                  "connect: bodies 1 and 2 are connected already",
                                  "connect: `joint.kind` is none of ball, fixed, hinge, slider, spring, distance",
                                  "connect: `joint.stiffness` is missing", "connect: `joint.length` is missing"));
  EXPECT_THAT(JointsOf(kLower), SizeIs(1));
}

TEST_F(RegionJointsTest, MoreThanTheMostAreRefused) {
  std::vector<Vec3d> places;
  places.reserve(40);
  for (int i = 0; i < 40; ++i) places.push_back({-9 + 1.5 * (i % 6), -9 + 1.5 * (i / 6), 0});
  std::vector<std::string> errors;
  Begin(places, [&](GameCalls& calls, std::int64_t tick) {
    if (tick == 2) {
      for (std::uint64_t other = 2; other <= 10; ++other) {
        if (!Connect(calls, kLower, BodyId(other))) errors.push_back(calls.error());
      }
    } else if (tick > 10 && tick < 50) {  // a chain, one a tick, so that each is in force before the next
      const auto from = static_cast<std::uint64_t>(tick - 2);
      if (from + 1 <= 40 && !Connect(calls, BodyId(from), BodyId(from + 1))) errors.push_back(calls.error());
    }
    return true;
  });
  StepTo(60);
  ASSERT_THAT(errors, ::testing::Not(IsEmpty()));
  EXPECT_EQ(errors[0], "connect: body 1 has 8 joints already");
  EXPECT_THAT(errors.back(), HasSubstr("bodies would hang together, at most 32"));
}

TEST_F(RegionJointsTest, ASavedStateHasThem) {
  Begin({{-6, 0, 0}, {-4, 0, 0}},
        [](GameCalls& calls, std::int64_t tick) { return tick != 2 || Connect(calls, kLower, kHigher); });
  StepTo(5);
  const auto state = DecodeState(one->SaveState(), one->catalog());
  ASSERT_TRUE(state.ok()) << state.status();
  const JointId id = JointsOf(kLower)[0].id;
  one = Make(kOne, std::make_shared<const RegionState>(*state));
  EXPECT_TRUE(one->world().HasJoint(id));
}

// Region 2 has taken the pair in and dies before its standby acknowledges anything: region 1 still has its copies.
TEST_F(RegionJointsTest, ADeathPartsNobody) {
  Begin(
      {{-2, 0, 0}, {-4, 0, 0}},
      [](GameCalls& calls, std::int64_t tick) { return tick != 2 || Connect(calls, kLower, kHigher); }, 6);
  two->SetStandby(true);
  StandbyCopy copy(kTwo, two->catalog());
  for (int i = 0; i < 60; ++i) {
    const StepResult first = one->Step(), second = two->Step();
    Send(kOne, first.frames);
    Send(kTwo, second.frames);
    ASSERT_TRUE(SameOwner(kLower, kHigher));
    // The copy stops in a tick before the pair comes.
    if (i < 5) {
      ASSERT_TRUE(copy.Receive(second.log).ok());
    }
  }
  ASSERT_TRUE(two->Owns(kLower));
  const auto resolution = CarryOn(*one, kTwo, copy, {kLower, kHigher});
  ASSERT_TRUE(resolution.ok()) << resolution.status();
  EXPECT_THAT(resolution->lost, IsEmpty());
  ASSERT_TRUE(one->Owns(kLower) && one->Owns(kHigher));
  ASSERT_TRUE(one->CanStep());
  for (int i = 0; i < 10; ++i) one->Step();
  const KeptRecord* record = one->records().Find(kLower);
  ASSERT_TRUE(record != nullptr && record->game.joints.size() == 1);
  EXPECT_TRUE(one->world().HasJoint(record->game.joints[0].id));
  EXPECT_NEAR(one->world().StateOf(kLower).position.x - one->world().StateOf(kHigher).position.x, kTwoMetres, 1e-3);
}

}  // namespace
}  // namespace tessera::region::game_joints
